#!/bin/sh
# Holds the binary interface that include/caustica.h declares against that of the last release, docs/abi/caustica.xml
# (abidw's form, of Debian's abigail-tools). Functions may be added, and fields at the ends of the structures that
# carry their size or are only handed out; anything else breaks programs, and is refused unless caustica.h has a newer
# version number by which it may (CHANGELOG.md says which).
#
#   scripts/check-abi.sh             compare
#   scripts/check-abi.sh --write     a release: docs/abi/caustica.xml becomes what the header declares
#
# What is looked at is a library of empty functions made from the header: tests/test_install.sh sees to it that the
# real one exports the same names, and the compiler that their definitions agree with the header.
set -eu
cd "$(dirname "$0")/.."
header=${CA_HEADER:-include/caustica.h}
kept=docs/abi/caustica.xml
for tool in abidw abidiff; do
    command -v $tool >/dev/null 2>&1 ||
        { echo "the binary interface is not checked: there is no $tool (apt-get install abigail-tools)" >&2; exit 1; }
done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

number() { sed -n "s/^#define CA_VERSION_$1 //p" "$header"; }
version=$(number MAJOR).$(number MINOR)

# make_library LAST...: a library of the header's types and of functions without content. Of the structures that grow
# there are the fields up to the LAST ones (STRUCTURE.FIELD); all of them where it is not among these.
make_library() {
    ${CC:-cc} -std=gnu17 -E -P -x c "$header" | awk -v last="$*" '
        BEGIN { for (n = split(last, names, "[ .]"); n > 1; n -= 2) last_of[names[n - 1]] = names[n] }
        /^typedef struct [a-z_]+ {/ { field = last_of[$3] }
        /^}/ { field = ""; cut = 0 }
        cut { next }
        field != "" && match($0, "[ *]" field "((\\[[^]]*\\])?;|\\))") { cut = 1 } # a function, too
        /^__attribute__/ { inside = 1 }
        inside && /;/ { sub(/;[^;]*$/, " { __builtin_trap(); }"); inside = 0 }
        { print }' >"$folder/stub.c"
    # From within the folder, whose name would be in the library.
    (cd "$folder" && ${CC:-cc} -std=gnu17 -g -shared -fPIC -w stub.c -Wl,-soname,libcaustica -o libcaustica.so)
}

if [ "${1:-}" = --write ]; then
    mkdir -p "$(dirname $kept)"
    make_library
    {
        echo "<!-- version $version -->"
        abidw --no-corpus-path --no-comp-dir-path --no-show-locs --type-id-style hash "$folder/libcaustica.so"
    } >"$folder/new.xml"
    mv "$folder/new.xml" $kept
    echo "$kept: version $version"
    exit 0
fi

# May the interface differ by the version number alone? From 1.0 on with a new MAJOR, before that with a new MINOR.
released=$(sed -n 's/^<!-- version \(.*\) -->$/\1/p' $kept)
differs=$version
differs_from=$released
case $version in 0.*) ;; *) differs=${version%.*} differs_from=${released%.*} ;; esac
if [ "$differs" != "$differs_from" ]; then
    echo "binary interface: version $version may differ from the released $released"
    exit 0
fi

# The last field that each of them had.
last=
for structure in ca_render_settings ca_render_statistics ca_render_progress; do
    field=$(sed -n "/<class-decl name='$structure'/,/<\/class-decl>/s/.*<var-decl name='\([a-z_]*\)'.*/\1/p" $kept |
        tail -n 1)
    last="$last $structure.$field"
done
# shellcheck disable=SC2086 # one word per structure
make_library $last
sed 1d $kept >"$folder/released.xml"
if ! abidiff --no-added-syms "$folder/released.xml" "$folder/libcaustica.so" \
    >"$folder/report"; then
    cat "$folder/report"
    echo "programs compiled with version $released would break: see CHANGELOG.md, and $0"
    exit 1
fi
