#!/bin/bash
# Every program of docs/library.md compiles without a warning and runs, with the library just built. Speaks TAP.
# CA_BUILD_DIR: the build folder.
set -u
. tests/support/tap.sh
build=$(cd "${CA_BUILD_DIR:?the build folder}" && pwd)
include=$PWD/include
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
compiler=$(cached CMAKE_C_COMPILER)
if [ -n "$(cached CA_SANITIZE)" ]; then
    echo "1..1"
    left_out "programs of docs/library.md" "a library with sanitizers is not for other programs"
    exit 0
fi

awk -v folder="$folder" '/^```c$/ { file = folder "/" ++n ".c"; next }
    /^```$/ { file = "" }
    file { print > file }' docs/library.md
awk '/^```xml$/ { on = 1; next } /^```$/ { on = 0 } on' README.md >"$folder/ball.xml"
programs=$(find "$folder" -name '*.c' | sort)
echo "1..$(($(wc -w <<<"$programs") + 2))"

run_program() {
    "$compiler" -std=c17 -Wall -Wextra -Wpedantic -Werror -I"$include" "$1" -L"$build" -lcaustica -lm -o "${1%.c}" &&
        cd "$folder" && LD_LIBRARY_PATH=$build "${1%.c}"
}
for program in $programs; do check "program $(basename "$program" .c) of docs/library.md" run_program "$program"; done

enough_programs() { [ "$(wc -w <<<"$programs")" -ge 5 ]; }
check "five programs or more" enough_programs
all_files() { [ -s "$folder/ball.exr" ] && [ "$(find "$folder" -name 'orbit-*.png' | wc -l)" -eq 8 ]; }
check "their pictures are there" all_files
