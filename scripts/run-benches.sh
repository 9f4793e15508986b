#!/bin/sh
# Runs every bench program of a build folder, one after the other, from the project's folder.
#
#   scripts/run-benches.sh BUILD_FOLDER
set -eu
build=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
count=0
for program in "$build"/bench_*; do
    [ -x "$program" ] || continue
    echo "== $(basename "$program")"
    "$program"
    count=$((count + 1))
done
if [ "$count" -eq 0 ]; then
    echo "there is no bench program in $build" >&2
    exit 1
fi
echo "$count bench program(s) ran"
if [ -f bench/results.json ]; then echo "figures: bench/results.json"; fi
