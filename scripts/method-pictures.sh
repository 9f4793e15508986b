#!/bin/sh
# The pictures of docs/which-method.md: one of each method, of a scene that shows what it is for, in 15 s each.
#
#   scripts/method-pictures.sh BUILD_FOLDER [--quick FOLDER]
#
# --quick: pictures of one sample per pixel, to FOLDER.
set -eu
program=$(cd "$1" && pwd)/caustica
shift
cd "$(dirname "$0")/.."
pictures=docs/pictures/methods
limit='--time 15'
if [ "${1:-}" = --quick ]; then
    pictures=${2:?a folder for the pictures}
    limit='--spp 1'
fi
mkdir -p "$pictures"

# picture METHOD SCENE RESOLUTION
picture()
{
    # shellcheck disable=SC2086 # the limit is two words
    "$program" render "scenes/$2.xml" -i "$1" --resolution "$3" --tone aces $limit -o "$pictures/$1.png" --quiet
}

picture auto gallery/pool 240x154
picture path cornell-box/cornell-box 200x200
picture light caustics/caustics 240x160
picture bdpt paper-003/two-small-lights 200x200
picture ppm paper-000/water-caustic 200x200
picture vavcm weights/lens 200x200
picture qmcppm paper-004/mirror-room 240x180
