"""What a build without its tools and libraries tells: one message, with the line that installs them."""
import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
NO_PNG = "-DCMAKE_FIND_ROOT_PATH=/nowhere -DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY"


def build(folder, **changes):
    """setup.py's standard error, after it failed."""
    environment = {name: value for name, value in os.environ.items() if name not in ("CAUSTICA_BUILD", "CC")}
    done = subprocess.run([sys.executable, "setup.py", "--quiet", "build", "--build-base", folder / "base", "--build-lib", folder / "lib"],
                          cwd=ROOT, env={**environment, **changes}, capture_output=True, text=True)
    assert done.returncode == 1 and "Traceback" not in done.stderr and not (folder / "lib" / "caustica" / "_program").exists()
    assert len(re.findall("^ +apt-get install .*python3-dev", done.stderr, re.MULTILINE)) == 1
    return done.stderr


@pytest.mark.parametrize("changes, words", [
    ({"PATH": "/nowhere"}, "missing: cmake, cc."),
    ({"CC": "no-such-compiler -O2"}, "missing: no-such-compiler."),
    ({"CAUSTICA_CMAKE_ARGS": NO_PNG}, "Could NOT find PNG"),
])
def test_what_is_missing(tmp_path, changes, words):
    told = build(tmp_path, **changes)
    assert told.count(words) == 1 and "-- Detecting" not in told
