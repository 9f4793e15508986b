#!/bin/bash
# Runs test programs and counts their tests.
#
#   scripts/run-tests.sh BUILD_FOLDER [tests | tests-sanitized | tests-long]
#
# Prints a line for each program as it ends, the whole output of those with failures, and last of all exactly
# "N passed, N failed" (", N skipped" only if any were). Exit status 1 when a test failed or nothing ran.
#
# Programs speak TAP: a plan "1..N", then "ok ..." or "not ok ..." a test, which cmocka does when asked. A test
# the plan promised and that has no result (crash, time limit) has failed; so has a program that has no plan or that
# ends with an error after all of its tests passed (a leak found at exit).
#
# CA_TEST_JOBS: programs at a time (default: one more than processors, for some mostly wait: those with a browser).
# CA_TEST_TIMEOUT: seconds for each (300).
# CA_TEST_VERBOSE=1 shows all output. CA_TEST_ONLY: a pattern for the names of the programs to run. CA_TEST_STOP=1: a
# program is stopped when its first test has failed. CA_TEST_CASE: the one test to run of each program (cmocka's).
# Logs stay in BUILD_FOLDER/tests/NAME.log.
set -u

# Sets `stopped` when a test of the program has failed and the program was still there to be stopped.
stop_at_failure() {
    while kill -0 "$watched"; do
        grep '^not ok' "$log" | grep -qv '# *SKIP' && kill "$watched" && stopped=1 && return
        sleep 0.05
    done
}

# One program: log, result file "passed failed skipped", report. Runs as a process of its own, by xargs.
if [ "${1:-}" = --one ]; then
    program=$2
    name=$(basename "$program")
    log=$CA_BUILD_DIR/tests/$name.log
    stopped=
    set -m # or what runs in the background would ignore interrupts, and what it tests, too
    started=$(date +%s.%N)
    {
        timeout -k 10 "$CA_TEST_TIMEOUT" "$program" >"$log" 2>&1 </dev/null &
        watched=$!
        [ "${CA_TEST_STOP:-0}" != 1 ] || stop_at_failure
        wait "$watched"
        status=$?
    } 2>/dev/null # no word from bash itself
    seconds=$(awk -v a="$started" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f", b - a }')
    read -r passed failed skipped < <(awk -v status=$status -v stopped=$stopped '
        /^1\.\.[0-9]+/ { plan += substr($1, 4) }
        /^(not )?ok [0-9]* *(- .*)?# *SKIP/ { skipped++; next } # cmocka 1.1 writes "not ok" here
        /^ok / { passed++ }
        /^not ok / { failed++ }
        END {
            if (plan == 0 && !failed) failed = 1
            if (passed + failed + skipped < plan && !stopped) failed = plan - passed - skipped
            if (status != 0 && !failed) failed = 1
            print passed + 0, failed + 0, skipped + 0
        }' "$log")
    echo "$passed $failed $skipped" >"$log.result"

    why=
    if [ -n "$stopped" ]; then why=", its failure ended it"
    elif [ $status -eq 124 ] || [ $status -eq 137 ]; then why=", stopped after $CA_TEST_TIMEOUT s"
    elif [ $status -gt 128 ]; then why=", killed by signal $((status - 128))"
    elif ! grep -q '^1\.\.' "$log"; then why=", reported no tests"
    elif [ $status -ne 0 ]; then why=", exit status $status"; fi
    line="$passed passed, $failed failed"
    [ "$skipped" -eq 0 ] || line="$line, $skipped skipped"
    report=$(printf '%-28s %s (%s s%s)' "$name" "$line" "$seconds" "$why")
    if [ "$failed" -gt 0 ] || [ "${CA_TEST_VERBOSE:-0}" = 1 ]; then shown=.; else shown='# *SKIP'; fi
    details=$(grep -E "$shown" "$log" | sed 's/^/    /')
    printf '%s\n' "$report${details:+$'\n'$details}"
    exit 0
fi

[ $# -ge 1 ] || { echo "usage: $0 BUILD_FOLDER [tests | tests-sanitized | tests-long]" >&2; exit 2; }
CA_BUILD_DIR=$(cd "$1" && pwd) || exit 2
list=$CA_BUILD_DIR/tests/${2:-tests}.list
[ -f "$list" ] || { echo "$list is missing: build first" >&2; exit 2; }
cd "$(dirname "$0")/.." || exit 2

export CA_BUILD_DIR
export CA_TEST_TIMEOUT=${CA_TEST_TIMEOUT:-300}
export CMOCKA_MESSAGE_OUTPUT=TAP
tsan="ignore_noninstrumented_modules=1 die_after_fork=0 suppressions=$PWD/tests/tsan.supp"
export TSAN_OPTIONS="$tsan ${TSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$PWD/tests/lsan.supp print_suppressions=0 ${LSAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1 ${UBSAN_OPTIONS:-}"

rm -f "$CA_BUILD_DIR"/tests/*.log "$CA_BUILD_DIR"/tests/*.result
grep -E "/[^/]*${CA_TEST_ONLY:-}[^/]*\$" "$list" |
    xargs -d '\n' -r -n 1 -P "${CA_TEST_JOBS:-$(($(nproc) + 1))}" "$PWD/scripts/run-tests.sh" --one

total=$(cat "$CA_BUILD_DIR"/tests/*.result 2>/dev/null | awk '
    { passed += $1; failed += $2; skipped += $3 }
    END { printf "%d passed, %d failed%s", passed, failed, skipped ? ", " skipped " skipped" : "" }')
echo "$total" | tee "$CA_BUILD_DIR/tests/summary"
[[ $total == *" 0 failed"* && $total != "0 passed"* ]]
