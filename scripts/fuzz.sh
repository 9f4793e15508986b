#!/bin/bash
# Runs the fuzzers (tests/fuzz/fuzz_*.c, built by the preset `fuzz`), each for an equal share of the time.
#
#   scripts/fuzz.sh BUILD_FOLDER HOURS [NAME]
#
# Each begins with the inputs of tests/fuzz/NAME/ and those of earlier runs in BUILD_FOLDER/corpora/NAME/, where it
# keeps what reaches new code. An input that finds a defect is left in BUILD_FOLDER/corpora/, as NAME-KIND-HASH with
# crash, timeout, leak or oom for its kind. Prints how many inputs ran, and last their sum; exit status 1 where a
# defect was found.
set -u
[ $# -ge 2 ] || { echo "usage: $0 BUILD_FOLDER HOURS [NAME]" >&2; exit 2; }
cd "$(dirname "$0")/.." || exit 2
build=$1 hours=$2 only=${3:-}
programs=$(ls "$build"/fuzz_* 2>/dev/null || ls "$build"/tests/fuzz_* 2>/dev/null)
[ -z "$only" ] || programs=$(printf '%s\n' "$programs" | grep "/fuzz_$only\$")
programs=$(for program in $programs; do [ -f "$program" ] && [ -x "$program" ] && echo "$program"; done)
[ -n "$programs" ] || { echo "no fuzzers in $build: build the preset fuzz first" >&2; exit 2; }
share=$(awk -v hours="$hours" -v count="$(printf '%s\n' "$programs" | wc -l)" \
    'BEGIN { printf "%d", hours * 3600 / count + 0.5 }')
[ "$share" -ge 1 ] || share=1

export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=1 LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp
total=0 defects=0
for program in $programs; do
    name=$(basename "$program") name=${name#fuzz_}
    mkdir -p "$build/corpora/$name"
    "$program" -max_total_time="$share" -timeout=20 -rss_limit_mb=3000 -max_len=65536 -print_final_stats=1 \
        -artifact_prefix="$build/corpora/$name-" "$build/corpora/$name" "tests/fuzz/$name" \
        >"$build/corpora/$name.log" 2>&1
    status=$?
    inputs=$(awk '/number_of_executed_units/ { print $2 }' "$build/corpora/$name.log")
    total=$((total + ${inputs:-0}))
    echo "$name: ${inputs:-0} inputs$([ $status -eq 0 ] || echo ", a defect: see $build/corpora/$name.log")"
    [ $status -eq 0 ] || defects=$((defects + 1))
done
echo "$total inputs in all, $defects fuzzers found a defect"
[ $defects -eq 0 ]
