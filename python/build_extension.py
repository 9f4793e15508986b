"""The extension module caustica._library: caustica.h, as the compiler reads it, through cffi."""
import os
import re
import subprocess

from cffi import FFI

HEADER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "include", "caustica.h")


def declarations():
    """The header without what is only for compilers; cffi knows the types of stdint.h and stdbool.h itself."""
    with open(HEADER) as file:
        text = re.sub(r"^#include.*$", "", file.read(), flags=re.MULTILINE)
    command = [os.environ.get("CC", "cc"), "-E", "-P", "-U__GNUC__", "-x", "c", "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


ffi = FFI()
ffi.cdef(declarations())
ffi.cdef('extern "Python" bool caustica_progress(const ca_render_progress *progress, void *user);')
ffi.cdef('extern "Python" void caustica_release(void *user);')
ffi.cdef("const int *caustica_watch_begin(void); void caustica_watch_end(void);")
ffi.set_source("caustica._library", '#include "caustica.h"\n#include "interrupts.h"', define_macros=[("Py_LIMITED_API", "0x030b0000")],
               include_dirs=["python"], py_limited_api=True)
