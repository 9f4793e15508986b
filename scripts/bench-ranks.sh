#!/bin/bash
# The efficiency of ranks: the time of a render by one rank with two threads over that by two ranks with one thread
# each, on one machine, start and end included (docs/cluster.md). The two take turns; medians.
#
#   scripts/bench-ranks.sh BUILD_FOLDER [RUNS]      default: 5 runs of each; two minutes on two quiet processors
set -eu
build=$(cd "$1" && pwd)
runs=${2:-5}
cd "$(dirname "$0")/.."
scene=scenes/cornell-box/cornell-box.xml
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

ldd "$build/caustica" | grep -q libmpi || { echo "$build/caustica is built without MPI" >&2; exit 1; }

# Prints the seconds that a render takes: timed RANKS THREADS PICTURE OPTION...
timed() {
    local ranks=$1 threads=$2 picture=$3 began=$EPOCHREALTIME
    shift 3
    mpirun --bind-to none -n "$ranks" "$build/caustica" render "$scene" --threads "$threads" -o "$folder/$picture" \
        --quiet "$@" >"$folder/said" 2>&1 || { cat "$folder/said" >&2; return 1; }
    awk -v a="$began" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }'
}

median() { sort -g | awk '{ v[NR] = $1 } END { print NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'; }

measure() { # measure NAME OPTION...
    local name=$1 i
    shift
    rm -f "$folder"/*.txt
    for ((i = 0; i < runs; i++)); do
        timed 1 2 one.pfm "$@" >>"$folder/one.txt"
        timed 2 1 two.pfm "$@" >>"$folder/two.txt"
        cmp "$folder/one.pfm" "$folder/two.pfm"
    done
    awk -v name="$name" -v one="$(median <"$folder/one.txt")" -v two="$(median <"$folder/two.txt")" \
        'BEGIN { printf "| %s | %.2f s | %.2f s | %.3f |\n", name, one, two, one / two }'
}

echo "| $runs renders each | 1 rank, 2 threads | 2 ranks, 1 thread | efficiency |"
echo "|---|---|---|---|"
measure "200 passes of \`path\`, 512 × 512" -i path --resolution 512x512 --spp 200
measure "100 passes of \`ovcm\`, 256 × 256" -i ovcm --resolution 256x256 --spp 100
