"""What a call of the library failed with, as exceptions."""
import contextlib
import re

from caustica._library import ffi, lib

_PLACE = re.compile(r"(?P<file>.*?):(?P<line>\d+):(?P<column>\d+): (?P<message>.*)", re.DOTALL)


class Error(Exception):
    """A call that failed. `file`, `line` and `column` tell the place in a file that is to blame, or are None. `path`: of a scene
    from a dictionary, the keys that lead to what is to blame, or None."""

    path = None

    def __init__(self, message, file=None, line=None, column=None):
        super().__init__(message)
        self.file, self.line, self.column = file, line, column


class OutOfMemory(Error, MemoryError):
    """There is not enough memory."""


class FileError(Error, OSError):
    """A file cannot be read or written."""


class FormatError(Error, ValueError):
    """A file is damaged or of an unknown format; arrays do not fit together."""


class SceneError(Error, ValueError):
    """The scene asks for something wrong or unknown."""


class Unsupported(Error, NotImplementedError):
    """The chosen method cannot do this."""


class ArgumentError(Error, ValueError):
    """A setting is out of range."""


_KINDS = {
    lib.CA_ERROR_MEMORY: OutOfMemory,
    lib.CA_ERROR_FILE: FileError,
    lib.CA_ERROR_FORMAT: FormatError,
    lib.CA_ERROR_SCENE: SceneError,
    lib.CA_ERROR_UNSUPPORTED: Unsupported,
    lib.CA_ERROR_ARGUMENT: ArgumentError,
}


def check(status, error):
    """Raises what the status says, with the message in the ca_error."""
    if status == lib.CA_OK:
        return
    if status == lib.CA_ERROR_INTERRUPTED:
        raise KeyboardInterrupt
    message = ffi.string(error.message).decode(errors="replace")
    place = _PLACE.fullmatch(message)
    file, line, column = (place["file"], int(place["line"]), int(place["column"])) if place else (None, None, None)
    raise _KINDS.get(status, Error)(message, file, line, column)


@contextlib.contextmanager
def interruptible():
    """Gives the number that Ctrl-C sets while a call of the library is under way; KeyboardInterrupt comes after the call."""
    try:
        yield lib.caustica_watch_begin()
    finally:
        lib.caustica_watch_end()


def new_error():
    return ffi.new("ca_error *")
