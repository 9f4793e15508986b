#!/bin/bash
# A page in a headless Chromium: tests/browser/NAME_page.py, which speaks TAP, on the program in CA_BUILD_DIR.
# Screenshots stay there, in tests/NAME-page/. Where there is no browser it says so.
#
#   tests/browser/run.sh NAME WHAT      (WHAT: for people)
set -u
build=${CA_BUILD_DIR:?the build folder}
for program in python3 chromium chromedriver; do
    if ! command -v "$program" >/dev/null; then
        echo "1..1"
        echo "ok 1 - $2 in a browser # SKIP $program is not installed (scripts/install-dependencies.sh check)"
        exit 0
    fi
done
rm -rf "$build/tests/$1-page"
python3 -B "tests/browser/$1_page.py" "$build/caustica" "$build/tests/$1-page"
