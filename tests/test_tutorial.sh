#!/bin/bash
# The tutorial: its scene is good, and each of its commands does what it says. And the index of documents: each is in
# it. Speaks TAP. CA_BUILD_DIR: the build folder.
set -u
. tests/support/tap.sh
build=$(cd "${CA_BUILD_DIR:?the build folder}" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export PATH=$build:$PATH

sed -n '/^```xml$/,/^```$/p' docs/tutorial.md | grep -v '^```' >"$folder/glass.xml"
grep '^caustica ' docs/tutorial.md >"$folder/commands"
count=$(wc -l <"$folder/commands")
echo "1..$((count + 3))"

run_command() { cd "$folder" && sh -c "$1" </dev/null; }
while IFS= read -r line; do check "$line" run_command "$line"; done <"$folder/commands"

files_are_there() {
    [ "$count" -ge 7 ] || { echo "only $count commands"; return 1; }
    for file in path.exr path.png ovcm.exr ovcm.png ovcm.json reference.exr report.html; do
        [ -s "$folder/$file" ] || { echo "$file is missing"; return 1; }
    done
}
check "all files are there" files_are_there

if command -v python3 >/dev/null; then
    check "its statistics are JSON" python3 -m json.tool "$folder/ovcm.json"
else
    left_out "its statistics are JSON" "python3 is not installed"
fi

all_in_index() {
    for document in docs/*.md docs/papers/*.md docs/decisions/README.md; do
        [ "$document" = docs/README.md ] && continue
        [ "$(grep -c "](${document#docs/})" docs/README.md)" -eq 1 ] || { echo "$document"; return 1; }
    done
    for document in $(sed -n 's/^| \[[^]]*\](\([^)]*\)).*/\1/p' docs/README.md); do
        [ -f "docs/$document" ] || { echo "docs/$document is not there"; return 1; }
    done
}
check "each document is in the index" all_in_index
