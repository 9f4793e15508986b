#!/bin/bash
# The scripts that judge the project are judged here: run-tests.sh must count crashes, silence, leaks and time limits
# as failures, check-sources.sh must find each kind of breach and nothing else, and run-mutants.sh must tell what a
# test finds from what none finds. Speaks TAP.
set -u
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
scripts=$PWD/scripts
number=0

verdict() { # verdict NAME EXPECTED ACTUAL
    number=$((number + 1))
    if [ "$2" = "$3" ]; then
        echo "ok $number - $1"
    else
        echo "not ok $number - $1"
        printf 'expected: %s\nfound: %s\n' "$2" "$3" | sed 's/^/# /'
    fi
}

# ---- run-tests.sh: the last line for one made-up program, given by its shell commands
counted() { # counted COMMANDS [STOP_AT_FAILURE]
    mkdir -p "$folder/build/tests"
    printf '#!/bin/bash\n%s\n' "$1" >"$folder/build/tests/made_up"
    chmod +x "$folder/build/tests/made_up"
    echo "$folder/build/tests/made_up" >"$folder/build/tests/tests.list"
    local output status
    output=$(CA_TEST_ONLY='' CA_TEST_TIMEOUT=1 CA_TEST_STOP=${2:-0} "$scripts/run-tests.sh" "$folder/build" tests)
    status=$?
    echo "$(printf '%s\n' "$output" | tail -n 1), status $status"
}

echo "1..34"
verdict "all pass" "2 passed, 0 failed, status 0" "$(counted 'echo 1..2; echo ok 1 - a; echo ok 2 - b')"
verdict "two groups" "2 passed, 0 failed, status 0" "$(counted 'echo 1..1; echo ok 1 - a; echo 1..1; echo ok 1 - b')"
verdict "one fails" "1 passed, 1 failed, status 1" "$(counted 'echo 1..2; echo ok 1 - a; echo not ok 2 - b; exit 1')"
verdict "one is skipped" "1 passed, 0 failed, 1 skipped, status 0" \
    "$(counted 'echo 1..2; echo ok 1 - a; echo "not ok 2 # SKIP b"')"
verdict "crash in the second of three" "1 passed, 2 failed, status 1" \
    "$(counted 'echo 1..3; echo ok 1 - a; kill -SEGV $$')"
verdict "over the time limit" "0 passed, 1 failed, status 1" "$(counted 'echo 1..1; sleep 5')"
verdict "silence" "0 passed, 1 failed, status 1" "$(counted 'exit 0')"
verdict "an error after the last test" "1 passed, 1 failed, status 1" "$(counted 'echo 1..1; echo ok 1 - a; exit 23')"
verdict "ends too early without an error" "1 passed, 1 failed, status 1" "$(counted 'echo 1..2; echo ok 1 - a')"
verdict "stopped when the first has failed" "0 passed, 1 failed, status 1" \
    "$(counted 'echo 1..3; echo not ok 1 - a; sleep 0.5; echo not ok 2 - b; sleep 5' 1)"
verdict "no failure to stop at" "1 passed, 0 failed, 1 skipped, status 0" \
    "$(counted 'echo 1..2; echo "not ok 1 # SKIP a"; sleep 0.2; echo ok 2 - b' 1)"

# ---- check-sources.sh: complaints about one file in a tree of its own
complaints() { # complaints PATH LINES
    rm -rf "$folder/tree"
    mkdir -p "$folder/tree/scripts" "$folder/tree/tests" "$folder/tree/bench" "$folder/tree/include"
    mkdir -p "$folder/tree/src/math" "$folder/tree/src/scene" "$folder/tree/$(dirname "$1")"
    cp "$scripts/check-sources.sh" "$folder/tree/scripts/"
    printf '[*]\nmax_line_length = 118\n[*.py]\nmax_line_length = 140\n' >"$folder/tree/.editorconfig"
    echo '/* a vector */' >"$folder/tree/src/math/vec.h"
    echo '/* a scene */' >"$folder/tree/src/scene/scene.h"
    mkdir -p "$folder/tree/src/integrator"
    echo 'const ca_integrator_type ca_integrator_bdpm = {.name = "bdpm", .create = create};' \
        >"$folder/tree/src/integrator/b.c"
    printf '%s\n' "$2" >"$folder/tree/$1"
    "$folder/tree/scripts/check-sources.sh" | grep -c "^$1:"
}

verdict "downward and system includes are fine" 0 \
    "$(complaints src/scene/a.c $'#include "math/vec.h"\n#include <math.h>')"
verdict "an upward include" 1 "$(complaints src/math/a.c '#include "scene/scene.h"')"
verdict "an include not from src/" 1 "$(complaints src/math/a.c '#include "vec.h"')"
verdict "a library outside of its file" 1 "$(complaints src/math/a.c '#include <embree3/rtcore.h>')"
verdict "malloc" 1 "$(complaints src/math/a.c 'void *p = malloc(3);')"
verdict "words in comments and strings are fine" 0 \
    "$(complaints src/math/a.c $'/* malloc(3)\n   exit(1) */ const char *s = "printf(\\"x\\")"; // free(s)')"
verdict "a comparison with an integrator's name" 1 \
    "$(complaints src/render/a.c 'return strcmp(type->name, "bdpm") == 0;')"
verdict "one in the folder of integrators is fine" 0 \
    "$(complaints src/integrator/a.c 'return strcmp(type->name, "bdpm") == 0;')"
letters() { printf "%$1s" '' | tr ' ' x; }
for place in "src/math/a.c 118" "tests/a.sh 118" "tests/a.py 140"; do
    read -r path width <<<"$place"
    verdict "a line of $width characters in $path" 0 "$(complaints "$path" "$(letters "$width")")"
    verdict "one more is too long" 1 "$(complaints "$path" "$(letters $((width + 1)))")"
done
verdict "exit below cli" 1 "$(complaints src/math/a.c '/* last */ exit(1);')"
verdict "exit in cli is fine" 0 "$(complaints src/cli/a.c 'exit(1); printf("x");')"

# ---- run-mutants.sh: one of each kind, in a project of one source and two tests
mkdir -p "$folder/mutated/scripts" "$folder/mutated/src" "$folder/mutated/tests/mutants"
cp "$scripts/run-mutants.sh" "$scripts/run-tests.sh" "$folder/mutated/scripts/"
printf '%s\n' 'int one(void) { return 1; }' '' 'int two(void) { return 2; }' '' 'int unseen(void) { return 3; }' \
    >"$folder/mutated/src/numbers.c"
for number_of in one=1 two=2; do
    name=${number_of%=*}
    printf '%s\n' '#include <stdio.h>' '#include <stdlib.h>' "int $name(void);" 'int main(void)' '{' \
        "    int wrong = $name() != ${number_of#*=}, dull = *getenv(\"CA_TEST_CASE\") == 'd';" \
        "    puts(wrong && !dull ? \"1..1\\nnot ok 1\" : \"1..1\\nok 1\");" '}' \
        >"$folder/mutated/tests/test_$name.c"
done
cat >"$folder/mutated/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.22)
project(numbers LANGUAGES C)
add_custom_target(tests)
foreach(name test_one test_two)
    add_executable(${name} src/numbers.c tests/${name}.c)
    add_dependencies(tests ${name})
    file(APPEND ${CMAKE_BINARY_DIR}/new.list "${CMAKE_BINARY_DIR}/${name}\n")
endforeach()
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
file(RENAME ${CMAKE_BINARY_DIR}/new.list ${CMAKE_BINARY_DIR}/tests/tests.list)
END
mutant() { # mutant NAME TEST OLD NEW
    printf 'Bug: %s.\nKilled-by: %s\n\n' "$1" "$2" >"$folder/mutated/tests/mutants/$1.patch"
    sed "s/$3/$4/" "$folder/mutated/src/numbers.c" |
        diff -u --label a/src/numbers.c --label b/src/numbers.c "$folder/mutated/src/numbers.c" - \
            >>"$folder/mutated/tests/mutants/$1.patch"
}
mutant finds test_one 'return 1' 'return 0'
mutant other test_one 'return 2' 'return 1'
mutant case 'test_two dull' 'return 2' 'return 1'
mutant passes test_two 'return 3' 'return 4'
mutant broken test_two 'return 3' 'return return'
mutant stale test_two 'return 3' 'return 4'
sed -i 's/^ int two.*/ int second(void) { return 2; }/' "$folder/mutated/tests/mutants/stale.patch"
told=$(CA_MUTANT_JOBS=2 "$folder/mutated/scripts/run-mutants.sh")
said() { grep -o "^$1 .*" <<<"$told" | head -n 1 | sed -E "s/^$1 *//; s/ ?\(.*//"; }
verdict "a mutant that its test finds" "killed by test_one: 0 passed, 1 failed" "$(said finds)"
verdict "a mutant that another test finds" "FAILED: survives test_one, killed by test_two" "$(said other)"
verdict "a mutant that its case does not find" "FAILED: survives test_two dull, killed by test_two" "$(said case)"
verdict "a mutant that no test finds" "FAILED: survives test_two and all other tests" "$(said passes)"
verdict "a mutant that does not compile" "FAILED: does not compile" "$(said broken)"
verdict "a mutant whose context is gone" "FAILED: no longer applies" "$(said stale)"
verdict "the count of mutants" "1 killed, 5 failed" "$(printf '%s\n' "$told" | tail -n 1)"
