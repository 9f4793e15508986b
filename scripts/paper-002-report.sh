#!/bin/sh
# Paper 002's comparison to look at: for each scene a page of `caustica compare --html` with eight images (path
# tracing, the six estimators of docs/papers/002.md and a reference), their difference and FLIP maps and sigma of an
# iteration, as in the paper's figure 6. Takes some two minutes on two processors.
#
#   scripts/paper-002-report.sh BUILD_FOLDER FOLDER [SIZE [SPP [SCENE...]]]
#
# Writes FOLDER/SCENE.html, and the images to FOLDER/SCENE/. An image that is there already is not rendered again.
set -eu
program=$(cd "$1" && pwd)/caustica
folder=$2
size=${3:-256} spp=${4:-8}
if [ $# -gt 4 ]; then shift 4; else set -- rough-glass long-diffuse; fi
scenes=$(cd "$(dirname "$0")/../scenes" && pwd)
mkdir -p "$folder"
cd "$folder"

render() { # render SCENE FILE INTEGRATOR SPP SEED
    [ -s "$1/$2" ] || "$program" render "$scenes/$1/$1.xml" -i "$3" --spp "$4" --seed "$5" \
        --resolution "${size}x$size" --quiet -o "$1/$2"
}

for scene; do
    mkdir -p "$scene"
    images=
    for integrator in path bdpt vcm vcm-plus vcm-star ovcm cavcm; do
        render "$scene" "$integrator.exr" "$integrator" "$spp" 1
        images="$images $scene/$integrator.exr"
    done
    render "$scene" reference.exr ovcm $((8 * spp)) 2
    # shellcheck disable=SC2086 # these names have no spaces
    "$program" compare $images --reference "$scene/reference.exr" --html "$scene.html" \
        --html-layers StandardDeviation --stats "$scene.json" --maps "$scene/maps.exr" >"$scene.txt"
    echo "$PWD/$scene.html"
done
