#!/bin/sh
# The Python package against the library just built, by pytest, where `make python` has made its environment.
set -u
cd "$(dirname "$0")/.." || exit 1
build=${CA_BUILD_DIR:-$PWD/build}
python=$build/python/environment/bin/python
if [ ! -x "$python" ]; then
    echo "1..1"
    echo "ok 1 # SKIP the Python package is not tested: \`make python\` makes the environment it needs"
    exit 0
fi
modules=$build/python/modules
export CAUSTICA_BUILD="$build" PYTHONPATH="$modules" CA_PROGRAM="$build/caustica"
if ! "$python" setup.py --quiet build --build-base "$build/python/temporary" --build-lib "$modules" \
    >"$build/python/build.log" 2>&1; then
    sed 's/^/# /' "$build/python/build.log"
    echo "1..1"
    echo "not ok 1 - the extension builds"
    exit 1
fi
"$python" -m pytest -p no:cacheprovider --color=no -q -rA python/tests >"$build/python/pytest.log" 2>&1
status=$?
awk '/^PASSED /  { print "ok " ++n " - " $2 }
     /^(FAILED|ERROR) / { print "not ok " ++n " - " $2 }
     /^SKIPPED / { sub(/^SKIPPED */, ""); print "ok " ++n " # SKIP " $0 }
     END { if (n == 0) { n = 1; print "not ok 1 - pytest runs" } print "1.." n }' "$build/python/pytest.log"
[ $status -eq 0 ] || sed 's/^/# /' "$build/python/pytest.log"
exit $status
