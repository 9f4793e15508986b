"""What a build without its tools and libraries tells: one message, with the line that installs them."""
import os
import pathlib
import re
import subprocess
import sys
import zipfile

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


@pytest.mark.skipif("CAUSTICA_BUILD" not in os.environ, reason="CAUSTICA_BUILD names no build")
def test_the_wheel(tmp_path):
    """Its tag, what is in it, and that what is unpacked anywhere works."""
    subprocess.run([sys.executable, "setup.py", "--quiet", "build", "--build-base", tmp_path / "base", "bdist_wheel",
                    "--bdist-dir", tmp_path / "parts", "--dist-dir", tmp_path], cwd=ROOT, check=True, capture_output=True)
    wheel, = tmp_path.glob("*.whl")
    assert re.fullmatch(r"caustica-[0-9.]+-cp311-abi3-linux_\w+\.whl", wheel.name)
    with zipfile.ZipFile(wheel) as file:
        file.extractall(tmp_path / "there")
    names = {path.name for path in (tmp_path / "there" / "caustica").iterdir()}
    assert {"__init__.pyi", "util.pyi", "py.typed", "_program"} <= names and any(n.startswith("libcaustica.so") for n in names)
    code = "import caustica; print(caustica.__file__, caustica.load_dict({'type': 'sphere'}))"
    told = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(tmp_path / "there")}, check=True,
                          capture_output=True, text=True).stdout
    assert told.startswith(str(tmp_path)) and "Object sphere" in told
