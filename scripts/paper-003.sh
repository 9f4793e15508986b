#!/bin/sh
# Paper 003's figures: renders figures 1 and 2 by the report's own program (bdpt:paper=true, 400 x 400 pixels, 75
# samples) to docs/pictures/paper-003/, and writes how long they took, how much of the light each strategy finds and
# what tests/long_paper_003.c measures into the tables of docs/papers/003.md. Ten minutes on two processors, most of
# them for the measurements.
#
#   scripts/paper-003.sh BUILD_FOLDER [--quick] [--only figures | shares | measurements]
#
# --quick: 100 x 100 pixels, pictures to out/paper-003/, and tables are only printed. --only: one part.
set -eu
usage()
{
    echo "usage: $0 BUILD_FOLDER [--quick] [--only figures | shares | measurements]" >&2
    exit 2
}

[ $# -gt 0 ] || usage
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
side=400 pictures=docs/pictures/paper-003 only=all
while [ $# -gt 0 ]; do
    case $1 in
    --quick) side=100 pictures=out/paper-003 ;;
    --only)
        only=${2:-}
        case $only in figures | shares | measurements) shift ;; *) usage ;; esac
        ;;
    *) usage ;;
    esac
    shift
done
mkdir -p "$pictures"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

is_asked_for() { [ "$only" = all ] || [ "$only" = "$1" ]; }

show() # show TABLE: prints it, and puts it into the document
{
    cat "$folder/$1"
    echo
    [ "$side" != 400 ] || scripts/put-tables.sh docs/papers/003.md "paper-003-$1" "$folder/$1"
}

# ---- Figures 1 and 2 ----

# Of a process that has ended: what `times` says of this shell's children, in seconds.
processor_seconds()
{
    sed -n '2s/\([0-9]*\)m\([0-9.]*\)s.*/\1 \2/p' "$folder/processor" | awk '{ printf "%.0f", 60 * $1 + $2 }'
}

figure() # figure NAME SCENE
{
    (
        "$build/caustica" render "scenes/paper-003/$2.xml" --integrator bdpt:paper=true -D "resolution=$side" \
            --quiet --stats "$folder/stats.json" -o "$pictures/$1.png"
        times >"$folder/processor"
    )
    seconds=$(sed -n 's/^  "seconds": *\([0-9.]*\).*/\1/p' "$folder/stats.json")
    echo "| $1 | \`scenes/paper-003/$2.xml\` | $(printf '%.0f' "$seconds") s | $(processor_seconds) s |"
}

write_times()
{
    echo "| picture | scene | $side × $side pixels, 75 samples, $(nproc) threads | processor time |"
    echo "|---|---|---|---|"
    figure figure-1-large large-light
    figure figure-1-small small-light
    figure figure-2 two-small-lights
}

# ---- Shares ----

# A line for each picture of the table that --dump-strategies writes: its technique, t and percent.
list_strategies()
{
    tr '<' '\n' <"$folder/strategies/index.html" | sed -n '
        s/.*s = [0-9]*, t = \([0-9]*\): \([-0-9.e+]*\) %.*/\1 \2/p
        s/^td data-technique="\([a-z_]*\)".*/\1/p' | awk 'NF == 1 { name = $1; next } { print name, $0 }'
}

# Of all light but the lamps' own: paths of two segments and more.
share() # share SCENE INTEGRATOR
{
    "$build/caustica" render "scenes/paper-003/$1.xml" --integrator "$2" -D resolution=100 --quiet \
        --dump-strategies "$folder/strategies" -o "$folder/image.exr"
    list_strategies | awk -v scene="$1" -v integrator="$2" '
        $1 == "hit" && !lamps++ { next } # s = 2, t = 0 comes first
        {
            column = $1 == "splat" ? 5 : $2 > 4 ? 4 : $2
            sum[column] += $3
            all += $3
        }
        END {
            printf "| %s | `%s` |", scene, integrator
            for (i = 0; i <= 5; i++) printf " %.1f %% |", 100 * sum[i] / all
            print ""
        }'
    rm -rf "$folder/strategies"
}

write_shares()
{
    echo '| scene | integrator | hit, t = 0 | next event, t = 1 | t = 2 | t = 3 | t ≥ 4 | splat, s = 1 |'
    echo '|---|---|---|---|---|---|---|---|'
    for scene in large-light small-light two-small-lights; do
        for integrator in bdpt:paper=true bdpt:strategies=no-splat bdpt; do share $scene $integrator; done
    done
}

# ---- Measurements ----

# Tables in the order in which the program prints them.
write_measurements()
{
    sed -n 's/^    \(|.*\)/\1/p' "$folder/log" |
        awk -v folder="$folder" '/^\| scene/ { n++ } { print >(folder "/table" n) }'
    for table in table1 table2 table3; do show $table; done
    grep 'of paper=true' "$folder/log"
}

if is_asked_for figures; then
    write_times >"$folder/times"
    show times
fi
if is_asked_for shares; then
    write_shares >"$folder/shares"
    show shares
fi
is_asked_for measurements || exit 0
status=0
"$build/tests/long_paper_003" "$side" >"$folder/log" || status=$?
write_measurements
exit $status
