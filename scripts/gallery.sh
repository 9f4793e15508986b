#!/bin/sh
# The gallery: renders the scenes of scenes/gallery/ to docs/pictures/gallery/NAME.png, and with `path` in the same
# time to NAME-path.png beside it; prints a table of the noise that was reached, and of the light that `path` will not
# find by what `render` says. Some twenty-eight minutes.
#
#   scripts/gallery.sh BUILD_FOLDER [--quick FOLDER] [NAME...]
#
# --quick: small pictures of two samples per pixel, to FOLDER. NAMEs: these scenes only. CA_GALLERY_SECONDS: time of
# each picture.
set -eu
program=$(cd "$1" && pwd)/caustica
shift
cd "$(dirname "$0")/.."
pictures=docs/pictures/gallery
seconds=${CA_GALLERY_SECONDS:-200}
quick=
if [ "${1:-}" = --quick ]; then
    quick=yes
    pictures=${2:?a folder for the pictures}
    shift 2
fi
[ $# -gt 0 ] || set -- pool glass-of-water glass-blocks jewels
mkdir -p "$pictures"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# How the pictures of a scene are shown.
look_of()
{
    case $1 in
    pool) echo "--tone aces" ;;
    glass-of-water) echo "--tone aces --exposure 0.5" ;;
    glass-blocks) echo "--tone aces" ;;
    jewels) echo "--tone aces --exposure 0.3" ;;
    *)
        echo "$1 is no scene of the gallery" >&2
        return 1
        ;;
    esac
}

size_in() { sed -n "s/.*<default name=\"$2\" value=\"\([0-9]*\)\".*/\1/p" "scenes/gallery/$1.xml"; }

# The number of that name, of the whole render, in the file of --stats $1.
number() { sed -n "s/^  \"$2\": \(-\{0,1\}[0-9][0-9.e+-]*\),\{0,1\}\$/\1/p" "$1"; }

# render SCENE PICTURE OPTION...
render()
{
    scene=$1 picture=$2
    shift 2
    if [ "$quick" ]; then
        set -- "$@" --spp 2 --resolution $(($(size_in "$scene" width) / 8))x$(($(size_in "$scene" height) / 8))
    else
        set -- "$@" --time "$seconds"
    fi
    # shellcheck disable=SC2046 # the look is several words
    "$program" render "scenes/gallery/$scene.xml" $(look_of "$scene") -o "$picture" --stats "$folder/stats" --quiet \
        "$@" 2>"$folder/warnings" || { cat "$folder/warnings" >&2; return 1; }
}

# What `render` foretells that the method will not find, from its warning.
lost()
{
    sed -n 's/.* will find none or too little of about \([0-9.]* %\) of the light.*/, loses \1/p' "$folder/warnings"
}

# The method that `auto` chose, in the file of --stats.
chosen() { sed -n 's/^ *"reason": "auto: \([a-z]*\).*/`\1`, /p' "$folder/stats"; }

figures()
{
    printf ' %s%.0f s, %.0f samples, noise %.0f %%%s |' "$(chosen)" "$(number "$folder/stats" seconds)" \
        "$(number "$folder/stats" samples_per_pixel)" "$(number "$folder/stats" noise_percent)" "$(lost)"
}

for name in "$@"; do look_of "$name" >/dev/null; done
echo '| scene | `auto` | `path` |'
echo '|---|---|---|'
for name in "$@"; do
    printf '| `%s` |' "$name"
    render "$name" "$pictures/$name.png"
    figures
    render "$name" "$pictures/$name-path.png" --integrator path
    figures
    echo
done
