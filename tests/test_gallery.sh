#!/bin/bash
# The gallery's script: renders each scene twice, and tells the figures of what it rendered. Speaks TAP. CA_BUILD_DIR:
# the build folder.
set -u
. tests/support/tap.sh
build=${CA_BUILD_DIR:?the build folder}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
names="pool glass-of-water glass-blocks jewels"

echo "1..7"
runs() { scripts/gallery.sh "$build" --quick "$folder/all" >"$folder/table"; }
check "renders all scenes" runs

# The sides of a PNG stand behind its signature and the head of its first chunk.
sides_of() { od -An -tu1 -j16 -N8 "$1" | awk '{ print 256 * $3 + $4, 256 * $7 + $8 }'; }
pictures_are_there() {
    for name in $names; do
        for file in "$folder/all/$name.png" "$folder/all/$name-path.png"; do
            read -r width height < <(sides_of "$file") || return 1
            [ "$width" -ge 100 ] && [ "$height" -ge 60 ] || { echo "$file: $width x $height"; return 1; }
        done
        ! cmp "$folder/all/$name.png" "$folder/all/$name-path.png" || return 1
    done
    [ "$(find "$folder/all" -name '*.png' | wc -l)" -eq 8 ]
}
check "pictures of both methods, which differ" pictures_are_there

cell='[0-9]+ s, 2 samples, noise [1-9][0-9]* %'
table_is_full() {
    cat "$folder/table"
    [ "$(wc -l <"$folder/table")" -eq 6 ] || return 1
    for name in $names; do
        grep -Eq "^\| \`$name\` \| \`[a-z]+\`, $cell \| $cell, loses [0-9.]+ % \|$" "$folder/table" ||
            { echo "$name has no good row"; return 1; }
    done
}
check "a row of figures for each scene" table_is_full

one_scene() {
    scripts/gallery.sh "$build" --quick "$folder/one" jewels >"$folder/table" || return 1
    [ "$(find "$folder/one" -name '*.png' | wc -l)" -eq 2 ] && [ "$(wc -l <"$folder/table")" -eq 3 ]
}
check "one scene alone" one_scene

fails() {
    ! scripts/gallery.sh "$build" --quick "$folder/none" nothing || return 1
    ! scripts/gallery.sh "$build" --quick /dev/null/none jewels || return 1
    [ ! -e "$folder/none/nothing.png" ]
}
# A program that fails at its second picture.
cat >"$folder/caustica" <<'END'
#!/bin/sh
case $* in *--integrator*) echo "it cannot" >&2; exit 1 ;; esac
END
chmod +x "$folder/caustica"
fails_with_the_program() {
    ! scripts/gallery.sh "$folder" --quick "$folder/broken" jewels >"$folder/table" 2>"$folder/errors" || return 1
    grep "it cannot" "$folder/errors"
}
check "what cannot be done fails" fails
check "what the program cannot do fails, with its words" fails_with_the_program

# Each picture of the page is made, and each that is made stands there.
methods() {
    scripts/method-pictures.sh "$build" --quick "$folder/methods" 2>/dev/null || return 1
    shown() { grep -o 'pictures/methods/[a-z]*.png' docs/which-method.md | sed 's/.*\///' | sort; }
    diff <(ls "$folder/methods") <(shown) && diff <(ls "$folder/methods") <(ls docs/pictures/methods)
}
check "pictures of which method, when" methods
