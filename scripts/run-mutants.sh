#!/bin/bash
# Are the tests sharp? Puts each deliberate bug of tests/mutants/ into a copy of the sources and sees a test fail.
#
#   scripts/run-mutants.sh [PATTERN]...      those whose names match one of the patterns (grep -E); default: all
#
# tests/mutants/NAME.patch is a unified diff with paths from the project's folder (patch -p1), and before it two
# lines:
#
#   Bug: what is wrong now, in a sentence.
#   Killed-by: test_X [CASE]
#
# A mutant is killed when test_X, a program or a script, fails, which is stopped at the first of its cases that does.
# With CASE, the name of one of a program, only that one is run: for programs in which others take long. These have
# failed: a mutant that applies no longer (lines of context must be the same, they may have moved), one that does not
# compile, one that its test passes. Of the last kind all fast tests are run, until one fails, and it is named. A test
# that fails by the time limit has killed, and is marked. All that is named must pass before anything is changed.
#
# Prints a line for each mutant as it ends, how long it all took, those that failed, and last of all exactly
# "N killed, N failed". Exit status 1 when any failed or none was found.
#
# Copies, builds and logs are in build-mutants/, one copy for each mutant at a time; the checkout is not touched. Most
# of a mutant's time would go by in make's look at each file and in compiling again what the mutant before it changed:
# ninja and ccache spare both, and are used where they are installed.
#
# CA_MUTANT_JOBS: mutants at a time (default: the number of processors). CA_MUTANT_TIMEOUT: seconds for each test
# (180). CA_MUTANT_SEARCH=0: a mutant that its test passes has failed without a look at other tests.
set -u
project=$(cd "$(dirname "$0")/.." && pwd)
work=$project/build-mutants
slot=$work/${CA_MUTANT_SLOT:-0}
copy=$slot/source
generator='Unix Makefiles'
! command -v ninja >/dev/null || generator=Ninja
build=$slot/build-${generator// /-}
# An object that one copy has compiled is there for all copies.
export CCACHE_DIR=$work/ccache CCACHE_BASEDIR=$slot CCACHE_NOHASHDIR=1

header() { sed -n "s/^$1: *//p;/^--- /q" "$2"; } # header FIELD PATCH
named_test() { header Killed-by "$1" | awk '{ print $1 ($2 ? " " $2 : ""); exit }'; } # "test_X" or "test_X CASE"

is_script() { [ -f "$project/tests/$1.sh" ]; }

# What is built for a test: itself, or the program that a script starts.
targets_of() { # targets_of TEST...
    local test
    for test; do
        if is_script "$test"; then echo caustica; else echo "$test"; fi
    done
}

# ---- one copy of the sources: each of these runs within the slot that xargs gives it ------------------------------

# Files under version control or that could be; without git all but what is built.
list_files() {
    cd "$project" || exit 2
    git ls-files -z --cached --others --exclude-standard 2>/dev/null ||
        find . -path ./.git -prune -o -path './build*' -prune -o -path ./out -prune -o -type f -printf '%P\0'
}

# Only what differs gets a new time: a second run compiles only what changed, or was left mutated.
bring_copy_up_to_date() {
    local file
    mkdir -p "$copy"
    while IFS= read -r -d '' file; do
        [ -f "$project/$file" ] || continue
        printf '%s\n' "$file"
        cmp -s "$project/$file" "$copy/$file" && continue
        mkdir -p "$copy/$(dirname "$file")"
        cp "$project/$file" "$copy/$file"
    done < <(list_files) | LC_ALL=C sort >"$slot/wanted"
    (cd "$copy" && find . -type f -printf '%P\n' | LC_ALL=C sort | comm -23 - "$slot/wanted" | xargs -d '\n' -r rm)
}

compile() { # compile LOG TARGET...
    local log=$1
    shift
    cmake --build "$build" --parallel "$(nproc)" --target "$@" >"$log" 2>&1
}

# Sets `outcome` to pass, fail or time-out, and `details`.
run_test() { # run_test NAME [CASE]
    local output status
    grep -E "/$1(\.sh)?\$" "$build/tests/tests.list" >"$build/tests/mutant.list"
    output=$(CA_TEST_ONLY='' CA_TEST_JOBS=1 CA_TEST_STOP=1 CA_TEST_CASE=${2:-} \
        CA_TEST_TIMEOUT=${CA_MUTANT_TIMEOUT:-180} "$copy/scripts/run-tests.sh" "$build" mutant)
    status=$?
    outcome=fail
    [ $status -ne 0 ] || outcome=pass
    [[ $output != *", stopped after "* ]] || outcome=time-out
    details=$(printf '%s\n' "$output" | sed -n '1s/^[^ ]* *//p')
    printf '%s\n' "$output" >>"$log"
}

prepare() { # prepare TEST...
    bring_copy_up_to_date
    cmake -S "$copy" -B "$build" -G "$generator" -DCMAKE_C_COMPILER_LAUNCHER="$(command -v ccache)" \
        -DCMAKE_BUILD_TYPE=Release -DCA_LTO=OFF -DCA_WERROR=OFF >"$slot/configure.log" 2>&1 &&
        compile "$slot/prepare.log" "$@" && return
    echo "the sources as they are do not build: $slot/configure.log, $slot/prepare.log" >&2
    exit 1
}

check_unmutated() { # check_unmutated "TEST [CASE]"
    log="$work/logs/unmutated-$1.log"
    : >"$log"
    # shellcheck disable=SC2086 # a test and perhaps its case
    run_test $1
    [ "$outcome" != pass ] || exit 0
    echo "the sources as they are fail $1: $log" >&2
    exit 1
}

# Which fast test fails, if not the named one? Sets `killer`; empty: none.
search_killer() {
    local program name
    killer=
    compile "$work/logs/$mutant-all.log" all tests || return
    while IFS= read -r program; do
        name=$(basename "$program" .sh)
        [ "$name" != "$named" ] || continue
        run_test "$name"
        [ "$outcome" = pass ] || { killer=$name; return; }
    done <"$build/tests/tests.list"
}

# Sets `verdict`, which begins with "killed" or "FAILED".
try_mutant() {
    verdict="FAILED: does not compile ($log)"
    compile "$log" "$(targets_of "${named%% *}")" || return
    # shellcheck disable=SC2086 # a test and perhaps its case
    run_test $named
    case $outcome in
    fail) verdict="killed by $named: $details" && return ;;
    time-out) verdict="killed by $named, BY THE TIME LIMIT: $details" && return ;;
    esac
    verdict="FAILED: survives $named"
    [ "${CA_MUTANT_SEARCH:-1}" != 0 ] || return
    search_killer
    verdict="FAILED: survives $named${killer:+, killed by $killer}"
    [ -n "$killer" ] || verdict="$verdict and all other tests"
}

change_copy() { # change_copy PATCH OPTION...
    patch -d "$copy" -p1 --fuzz=0 --no-backup-if-mismatch -i "$@"
}

run_mutant() { # run_mutant FILE
    local patch=$project/tests/mutants/$1
    mutant=${1%.patch}
    named=$(named_test "$patch")
    log=$work/logs/$mutant.log
    if change_copy "$patch" --forward --dry-run >"$log" 2>&1; then
        change_copy "$patch" --forward >>"$log" 2>&1
        try_mutant
        change_copy "$patch" --reverse >>"$log" 2>&1
    else
        verdict="FAILED: no longer applies ($log)"
    fi
    times >>"$log" # of the processor, which other work on the machine does not lengthen
    printf '%-36s %s\n' "$mutant" "$verdict" | tee "$work/results/$mutant"
}

case ${1:-} in
--prepare) shift && prepare "$@" && exit 0 ;;
--unmutated) check_unmutated "$2" ;;
--one) run_mutant "$2" && exit 0 ;;
esac

# ---- all of them --------------------------------------------------------------------------------------------------

pattern=$(IFS='|'; echo "$*")
names=$(cd "$project/tests/mutants" && printf '%s\n' *.patch | grep -E "${pattern:-.}") ||
    { echo "no mutant of tests/mutants/ has such a name" >&2; exit 1; }
for name in $names; do
    patch=$project/tests/mutants/$name
    test=$(named_test "$patch" | cut -d ' ' -f 1)
    [ -n "$(header Bug "$patch")" ] && { [ -f "$project/tests/$test.c" ] || is_script "$test"; } && continue
    echo "$patch: \"Bug: ...\" and \"Killed-by: test_X [CASE]\" must come first, with a tests/test_X.c or .sh" >&2
    exit 1
done
named=$(for name in $names; do named_test "$project/tests/mutants/$name"; done | LC_ALL=C sort -u)
programs=$(printf '%s\n' "$named" | cut -d ' ' -f 1 | uniq)
jobs=${CA_MUTANT_JOBS:-$(nproc)}

in_slots() { xargs -d '\n' -n 1 -P "$jobs" --process-slot-var=CA_MUTANT_SLOT "$project/scripts/run-mutants.sh" "$1"; }

mkdir -p "$work/logs" "$work/results"
rm -f "$work"/results/* "$work"/logs/*
# One copy after the other: the first one's objects are there for the next.
for ((i = 0; i < jobs; i++)); do
    # shellcheck disable=SC2086 # one word per program is meant
    CA_MUTANT_SLOT=$i "$project/scripts/run-mutants.sh" --prepare $(targets_of $programs) || exit 1
done
printf '%s\n' "$named" | in_slots --unmutated || exit 1
echo "$(printf '%s\n' "$programs" | wc -l) test programs pass before anything is changed"
printf '%s\n' "$names" | in_slots --one

killed=$(cat "$work"/results/* | grep -c '^[^ ]* *killed')
echo "after $((SECONDS / 60)) minutes"
failed=$(($(printf '%s\n' "$names" | wc -l) - killed))
[ "$failed" -eq 0 ] || grep -h FAILED "$work"/results/*
echo "$killed killed, $failed failed" | tee "$work/summary"
[ "$failed" -eq 0 ]
