#!/bin/sh
# The figures of paper 004: renders, and writes its tables into docs/papers/004.md (between the two markers there) and
# its plots and pictures to docs/pictures/paper-004/. Less than two hours on two quiet processors: each section stops
# when it is done, or at its share of the time.
#
#   scripts/paper-004.sh BUILD_FOLDER [--full | --minutes N] [--quick] [--only SECTION]
#
# --full: no section looks at the time; --minutes: another time for all. --quick: less of everything; --only: one
# section. Either of these only prints, and leaves the document alone. Where
# build-clang/ has the program too, pictures of the two builds are compared.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
case " $* " in
*' --quick '* | *' --only '* | *' --iterations '*) exec "$build/paper_004" "$@" ;;
esac

document=docs/papers/004.md
folder=$(mktemp -d)
table=$folder/table
trap 'rm -rf "$folder"' EXIT
mkdir -p docs/pictures/paper-004
status=0

# The same picture by the program $1, settings behind it, as $2.
same_picture()
{
    program=$1 image=$2
    shift 2
    "$program" render "$@" -o "$image" --quiet
}

compare_builds()
{
    echo '### Two compilers'
    echo
    clang=build-clang/caustica
    if [ ! -x "$clang" ]; then
        echo 'SKIPPED: build-clang/ has no program to compare with (make build PRESET=clang)' >&2
        return
    fi
    echo 'The same source, built by gcc and by clang, on one machine:'
    echo
    for scene in mirror-room camera-is-light; do
        for sampler in halton independent; do
            set -- "scenes/paper-004/$scene.xml" -i qmcppm --sampler "$sampler" --spp 4 --resolution 128x81
            if ! same_picture "$build/caustica" "$folder/gcc.exr" "$@" ||
                ! same_picture "$clang" "$folder/clang.exr" "$@"; then
                echo "SKIPPED: $scene, $sampler does not render with both builds" >&2
                continue
            fi
            echo "- $scene, $sampler: $("$build/paper_004" --difference "$folder/gcc.exr" "$folder/clang.exr")."
        done
    done
    echo
}

"$build/paper_004" "$@" --table "$table" --pictures docs/pictures/paper-004 || status=$?
grep -q 'What it should show' "$table" # complete, whatever it shows
compare_builds >"$folder/builds"
awk -v builds="$folder/builds" '
    /^### What it should show/ { while ((getline line < builds) > 0) print line }
    { print }
' "$table" >"$table.all"
cat "$table.all"
scripts/put-tables.sh "$document" paper-004 "$table.all"
exit $status
