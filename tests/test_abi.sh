#!/bin/sh
# What scripts/check-abi.sh says of headers that break programs, and of those that do not. Speaks TAP.
set -u
cd "$(dirname "$0")/.." || exit 1
. tests/support/tap.sh
if ! command -v abidiff >/dev/null 2>&1 || ! command -v abidw >/dev/null 2>&1; then
    echo "1..1"
    left_out "changes of the binary interface" "there is no abidiff (Debian's abigail-tools)"
    exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
echo "1..8"

# with SED_SCRIPT: is the edited header accepted?
with() {
    sed -e "$1" include/caustica.h >"$folder/caustica.h"
    ! cmp -s include/caustica.h "$folder/caustica.h" || { echo "nothing was edited: $1"; return 1; }
    CA_HEADER=$folder/caustica.h scripts/check-abi.sh >"$folder/said" 2>&1
}
without() { with "$1" && return 1 || grep -q "would break" "$folder/said"; }

check "the header as it is" scripts/check-abi.sh
check "a new function" with 's/^CA_API void ca_scene_release/CA_API int ca_new(int a);\n&/'
check "a new field at the end of the settings" with 's/^} ca_render_settings;/    int later;\n&/'
check "no new field at their start" without 's/^    const char \*integrator;/    double sooner;\n&/'
check "no new field in an array of the program's" without 's/^} ca_mesh_data;/    int later;\n&/'
check "no function less" without '/^CA_API void ca_scene_release/d'
check "no other parameter" without 's/^CA_API void ca_scene_release(ca_scene \*scene/&, int more/'
check "anything with a new version" with \
    's/^#define CA_VERSION_MINOR .*/#define CA_VERSION_MINOR 99/; /^CA_API void ca_scene_release/d'
