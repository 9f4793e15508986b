#!/bin/sh
# Paper 003's figures: renders figures 1 and 2 by the report's own program (bdpt:paper=true, 400 x 400 pixels, 75
# samples) to docs/pictures/paper-003/, and writes how long they took and what tests/long_paper_003.c measures into
# the tables of docs/papers/003.md. Half an hour on two processors, most of it for the measurements.
#
#   scripts/paper-003.sh BUILD_FOLDER [--quick]
#
# --quick: 100 x 100 pixels, pictures to out/paper-003/, and tables are only printed.
set -eu
build=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
side=400 pictures=docs/pictures/paper-003
if [ "${2:-}" = --quick ]; then side=100 pictures=out/paper-003; fi
mkdir -p "$pictures"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

figure() # figure NAME SCENE
{
    "$build/caustica" render "scenes/paper-003/$2.xml" --integrator bdpt:paper=true -D "resolution=$side" --quiet \
        --stats "$folder/stats.json" -o "$pictures/$1.png"
    seconds=$(sed -n 's/^  "seconds": *\([0-9.]*\).*/\1/p' "$folder/stats.json")
    echo "| $1 | \`scenes/paper-003/$2.xml\` | $(printf '%.0f' "$seconds") s |"
}

{
    echo "| picture | scene | $side × $side pixels, 75 samples, $(nproc) threads |"
    echo "|---|---|---|"
    figure figure-1-large large-light
    figure figure-1-small small-light
    figure figure-2 two-small-lights
} >"$folder/times"

# Tables in the order in which the program prints them.
status=0
"$build/tests/long_paper_003" "$side" >"$folder/log" || status=$?
sed -n 's/^    \(|.*\)/\1/p' "$folder/log" |
    awk -v folder="$folder" '/^\| scene/ { n++ } { print >(folder "/table" n) }'
for table in times table1 table2 table3; do
    cat "$folder/$table"
    echo
    [ "$side" != 400 ] || scripts/put-tables.sh docs/papers/003.md "paper-003-$table" "$folder/$table"
done
grep 'of paper=true' "$folder/log"
exit $status
