#!/bin/bash
# The page of `caustica study` in a headless Chromium: tests/browser/study_page.py, which speaks TAP. CA_BUILD_DIR: the build
# folder, where its screenshots stay, in tests/study-page/.
set -u
build=${CA_BUILD_DIR:?the build folder}
for program in python3 chromium chromedriver; do
    if ! command -v "$program" >/dev/null; then
        echo "1..1"
        echo "ok 1 - study page in a browser # SKIP $program is not installed (scripts/install-dependencies.sh check)"
        exit 0
    fi
done
rm -rf "$build/tests/study-page"
python3 -B tests/browser/study_page.py "$build/caustica" "$build/tests/study-page"
