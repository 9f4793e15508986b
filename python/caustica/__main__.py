"""python -m caustica: the program, with its commands and options."""
import os
import sys


def main():
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "_program")
    os.execv(program, [program, *sys.argv[1:]])


if __name__ == "__main__":
    main()
