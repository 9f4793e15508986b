#!/bin/sh
# clang-tidy over all of src/, with the checks of .clang-tidy.
#
#   scripts/check-tidy.sh BUILD_FOLDER [FILE]...      a build of the preset clang, which has compile_commands.json
#
# Asserts are on: they are what the analyzer may rely on. It looks through calls of a few levels more than it would by
# itself, since statuses come from far down. CA_JOBS: processes at a time (default: the number of processors).
set -eu
cd "$(dirname "$0")/.."
build=$1
shift
[ -f "$build/compile_commands.json" ] ||
    { echo "$build has no compile_commands.json: configure it first" >&2; exit 2; }
# Of sobol_table.c, 16,384 numbers that macros make, it would take as long as of twenty other files.
[ $# -gt 0 ] || set -- $(find src -name '*.c' ! -name sobol_table.c | LC_ALL=C sort)

# A few files a process, so that processes end at about the same time. On standard error is only how many warnings of
# system headers it does not show.
printf '%s\n' "$@" | xargs -n 4 -P "${CA_JOBS:-$(nproc)}" \
    clang-tidy-14 -p "$build" --quiet --extra-arg=-UNDEBUG \
    --extra-arg=-Xclang --extra-arg=-analyzer-inline-max-stack-depth=8 2>/dev/null
