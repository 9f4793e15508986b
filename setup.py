"""Builds libcaustica and the program with CMake, then the extension around caustica.h, and puts all three into the
package. CAUSTICA_BUILD: a folder where both are built already. CAUSTICA_CMAKE_ARGS: further arguments for CMake."""
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig

from setuptools import setup
from setuptools.command.build_ext import build_ext

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:  # before setuptools 70.1
    from wheel.bdist_wheel import bdist_wheel

HERE = os.path.dirname(os.path.abspath(__file__))
PACKAGES = os.path.join(HERE, "scripts", "packages.txt")


def version():
    with open(os.path.join(HERE, "include", "caustica.h")) as file:
        numbers = dict(re.findall(r"#define CA_VERSION_(MAJOR|MINOR|PATCH) (\d+)", file.read()))
    return "{MAJOR}.{MINOR}.{PATCH}".format(**numbers)


def apt_line():
    """What installs all that a build needs, on Debian."""
    with open(PACKAGES) as file:
        names = [words[0] for words in map(str.split, file) if words and words[0] != "#" and "build" in words[1:]]
    return "apt-get install " + " ".join(sorted(set(names) | {"python3-dev"}))


def reason(output):
    """What CMake or the compiler complains of, of all that they print."""
    lines = output.splitlines()
    errors = [i for i, line in enumerate(lines) if line.startswith("CMake Error") or " error: " in line]
    if not errors:
        return "\n".join(lines[-20:])
    end = next((i for i in range(errors[0], len(lines)) if lines[i].startswith("Call Stack")), errors[0] + 20)
    return "\n".join(lines[errors[0]:min(end, errors[0] + 20)]).rstrip()


def run(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0:
        return
    sys.exit(f"{reason(done.stdout)}\n\ncaustica: \"{shlex.join(command)}\" failed. If a header or library is missing, this "
             f"installs what a build needs:\n    {apt_line()}")


def check_tools():
    """Before anything is built, or the header is read, which the compiler does."""
    compiler = shlex.split(os.environ.get("CC", "cc"))[0]
    missing = [tool for tool in ("cmake", compiler) if not shutil.which(tool)]
    if not os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h")):
        missing.append("Python.h")
    if missing:
        sys.exit(f"caustica: missing: {', '.join(missing)}. This installs what a build needs:\n    {apt_line()}")


def build_library(folder):
    """Builds the program and the shared library in this folder."""
    run(["cmake", "-S", HERE, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", "-DCA_TESTS=OFF", "-DCA_WERROR=OFF",
         *shlex.split(os.environ.get("CAUSTICA_CMAKE_ARGS", ""))])
    run(["cmake", "--build", folder, "--parallel", str(os.cpu_count()), "--target", "caustica", "caustica-shared"])
    return folder


class BuildWithLibrary(build_ext):
    """The library first, beside which the extension is linked; it finds the library in its own folder."""

    def run(self):
        folder = os.environ.get("CAUSTICA_BUILD") or build_library(os.path.join(HERE, self.build_temp, "library"))
        for extension in self.extensions:
            extension.include_dirs.append(os.path.join(HERE, "include"))
            extension.library_dirs.append(folder)
            extension.libraries.append("caustica")
            extension.runtime_library_dirs.append("$ORIGIN")
        super().run()
        package = os.path.join(HERE, "python", "caustica") if self.inplace else os.path.join(self.build_lib, "caustica")
        shutil.copy2(os.path.join(folder, "caustica"), os.path.join(package, "_program"))
        numbers = version().split(".")
        soname = "libcaustica.so." + ".".join(numbers[:2 if numbers[0] == "0" else 1])  # as CMakeLists.txt has it
        shutil.copy2(os.path.realpath(os.path.join(folder, soname)), os.path.join(package, soname))


class LimitedWheel(bdist_wheel):
    """For any Python from 3.11 on."""

    def finalize_options(self):
        super().finalize_options()
        self.py_limited_api = "cp311"


check_tools()
setup(
    version=version(),
    cffi_modules=["python/build_extension.py:ffi"],
    cmdclass={"build_ext": BuildWithLibrary, "bdist_wheel": LimitedWheel},
)
