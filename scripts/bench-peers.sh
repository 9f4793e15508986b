#!/bin/sh
# Caustica's `path` against Mitsuba 3's, the same scenes in equal time: prints a table, writes bench/peers.json.
#
#   scripts/bench-peers.sh BUILD_FOLDER [--quick] [--only SCENE]
#
# A Python environment with Mitsuba is made in BUILD_FOLDER/peers/python, from the Python package index; scenes and
# reference images are kept in BUILD_FOLDER/peers. Mitsuba compiles its kernels with LLVM 19 (Debian: libllvm19);
# DRJIT_LIBLLVM_PATH names another library.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
folder=$build/peers
python=$folder/python
packages="mitsuba==3.9.1 drjit==1.5.0 numpy==2.3.5"

fail() {
    echo "bench-peers: $1" >&2
    exit 1
}

if [ -z "${DRJIT_LIBLLVM_PATH:-}" ]; then
    for library in /usr/lib/*/libLLVM.so.19* /usr/lib/llvm-19/lib/libLLVM.so.19*; do
        if [ -e "$library" ]; then DRJIT_LIBLLVM_PATH=$library; fi
    done
fi
[ -n "${DRJIT_LIBLLVM_PATH:-}" ] ||
    fail "there is no library of LLVM 19 (Debian: libllvm19); DRJIT_LIBLLVM_PATH can name one"
[ -e "$DRJIT_LIBLLVM_PATH" ] || fail "DRJIT_LIBLLVM_PATH names $DRJIT_LIBLLVM_PATH, which is not there"
export DRJIT_LIBLLVM_PATH

if [ "$(cat "$folder/packages" 2>/dev/null)" != "$packages" ]; then
    rm -rf "$python" "$folder/packages"
    mkdir -p "$folder"
    python3 -m venv "$python" >/dev/null || fail "python3 -m venv does not work (Debian: python3-venv)"
    echo "bench-peers: installing $packages from the Python package index"
    # shellcheck disable=SC2086 # one word per package is meant
    "$python/bin/pip" install --quiet --disable-pip-version-check $packages >&2 || fail "pip cannot install $packages"
    echo "$packages" >"$folder/packages"
fi
exec "$python/bin/python" -B scripts/bench-peers.py "$build/caustica" "$folder" "$@"
