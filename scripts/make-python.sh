#!/bin/sh
# The Python package: its wheel in BUILD_FOLDER/python, and a virtual environment there in which tests run.
#
#   scripts/make-python.sh BUILD_FOLDER [--environment]      --environment: that alone
#
# What the environment holds comes from the Python package index. The library is that of BUILD_FOLDER.
set -eu
build=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
environment=$build/python/environment
pip="$environment/bin/python -m pip --quiet --disable-pip-version-check"
if [ ! -x "$environment/bin/jupyter-execute" ]; then
    python3 -m venv --clear "$environment"
    $pip install 'setuptools>=70.1' 'cffi>=1.16' 'numpy>=1.24' pytest tqdm matplotlib nbclient ipykernel
fi
[ -x "$environment/bin/stubtest" ] || $pip install mypy ||
    echo "mypy cannot be installed: stubs are only tested for their names"
[ "${2:-}" != --environment ] || exit 0
rm -f "$build"/python/*.whl
CAUSTICA_BUILD=$build $pip wheel --no-build-isolation --no-deps --wheel-dir "$build/python" .
ls "$build"/python/*.whl
