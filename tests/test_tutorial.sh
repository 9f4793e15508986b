#!/bin/bash
# The tutorial: its scene is good, and each of its commands does what it says. Whoever begins is led to
# auto. And the index of documents: each is in it; and that of scenes: it names their integrators. Speaks TAP.
# CA_BUILD_DIR: the build folder.
set -u
. tests/support/tap.sh
build=$(cd "${CA_BUILD_DIR:?the build folder}" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export PATH=$build:$PATH

sed -n '/^```xml$/,/^```$/p' docs/tutorial.md | grep -v '^```' >"$folder/glass.xml"
grep '^caustica ' docs/tutorial.md >"$folder/commands"
count=$(wc -l <"$folder/commands")
echo "1..$((count + 6))"

run_command() { cd "$folder" && sh -c "$1" </dev/null; }
while IFS= read -r line; do check "$line" run_command "$line"; done <"$folder/commands"

files_are_there() {
    [ "$count" -ge 7 ] || { echo "only $count commands"; return 1; }
    for file in auto.exr auto.png auto.json path.exr path.png reference.exr report.html; do
        [ -s "$folder/$file" ] || { echo "$file is missing"; return 1; }
    done
}
check "all files are there" files_are_there

if command -v python3 >/dev/null; then
    check "its statistics are JSON" python3 -m json.tool "$folder/auto.json"
else
    left_out "its statistics are JSON" "python3 is not installed"
fi

# The tutorial's first render, that of README, and the first commands that the program and the Makefile show.
begins_with_auto() {
    local render readme
    grep -q '"reason": *"auto: ' "$folder/auto.json" ||
        { echo "the tutorial's first render chooses no method"; return 1; }
    render=$(grep -m1 '^caustica render' "$folder/commands")
    case $render in *auto.json*) ;; *) echo "another one is first: $render"; return 1 ;; esac
    readme=$(grep -m1 '^build/caustica render' README.md)
    case $readme in *" -i "*) echo "README: $readme"; return 1 ;; esac
    awk '/^```xml$/ { on = 1; next } /^```$/ { on = 0 } on' README.md | grep -q '<integrator type="auto">' || return 1
    caustica --help | grep '^Example: caustica render .* -i auto ' || return 1
    caustica render --help | grep '^Examples: caustica render .* -i auto' || return 1
    make -n demo | grep 'caustica render' >"$folder/demo" && ! grep -v ' -i auto ' "$folder/demo"
}
check "whoever begins is led to auto" begins_with_auto

# What the tutorial says of its two pictures.
path_is_worse() {
    (cd "$folder" && caustica compare path.exr auto.exr --reference reference.exr) |
        awk '/relMSE/ { error[++n] = $2 } END { print error[1], error[2]; exit !(n == 2 && error[2] < error[1]) }'
}
check "auto has less error than path, as it says" path_is_worse

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

# The integrator of a scene, or of a part that it includes.
integrator_of() {
    local folder file
    folder=$(dirname "$1")
    for file in "$1" $(sed -n "s|.*<include filename=\"\([^\"]*\)\".*|$folder/\1|p" "$1"); do
        sed -n 's/.*<integrator type="\([^"]*\)".*/\1/p' "$file"
    done
}
scenes_are_as_listed() {
    local scenes said rows=0
    while IFS='|' read -r _ scenes _ said _; do
        said=$(sed 's/[^`]*`\([^`]*\)`.*/\1/' <<<"$said")
        for scene in $(grep -o '`[^`]*\.xml`' <<<"$scenes" | tr -d '`'); do
            [ "$(integrator_of "scenes/$scene")" = "$said" ] ||
                { echo "$scene: $(integrator_of "scenes/$scene") instead of $said"; return 1; }
            rows=$((rows + 1))
        done
    done < <(grep '^| `.*\.xml`' scenes/README.md)
    [ "$rows" -ge 35 ] || { echo "only $rows scenes"; return 1; }
}
check "scenes have the integrators that their list names" scenes_are_as_listed
