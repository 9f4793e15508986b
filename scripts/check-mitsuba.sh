#!/bin/bash
# The recorded images of tests/mitsuba against a live Mitsuba 3, from the Python package index.
#
#   check-mitsuba.sh [BUILD [record [SCENE...]]]   a Python environment with mitsuba is made in BUILD/mitsuba-python
#                                                  (default: build); `record` writes tests/mitsuba/references.txt
#
# Exit status: 0 equal, 1 not, 77 skipped because the package cannot be had.
set -eu
cd "$(dirname "$0")/.."
build=${1:-build}
[ $# -eq 0 ] || shift
[ $# -gt 0 ] || set again
python=$build/mitsuba-python

skip() {
    echo "SKIPPED: the recorded images were not compared with Mitsuba: $1" >&2
    exit 77
}

packages="mitsuba==3.9.1 numpy"
if ! "$python/bin/python" -c "import mitsuba, numpy" 2>/dev/null; then
    rm -rf "$python"
    mkdir -p "$build"
    python3 -m venv "$python" >/dev/null 2>&1 || skip "python3 -m venv does not work (Debian: python3-venv)"
    # shellcheck disable=SC2086
    "$python/bin/pip" install --quiet --disable-pip-version-check $packages >&2 || skip "pip cannot install $packages"
fi
exec "$python/bin/python" scripts/check-mitsuba.py "$@"
