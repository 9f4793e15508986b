#!/bin/bash
# Checks that the project builds and runs on a bare Debian 12: makes an empty root folder with debootstrap, copies
# this checkout into it and runs there, as root with no other package than `make`:  make demo, make test.
#
#   scripts/check-fresh-machine.sh ROOT_FOLDER [make targets...]       (needs root and debootstrap)
#
# A ROOT_FOLDER that exists already is used again. The mirror and proxy of this machine's apt are used.
# CA_MIRROR overrides the mirror; where neither says one, it must be set.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 2; }
root=$1
shift
[ $# -gt 0 ] || set -- demo test
project=$(cd "$(dirname "$0")/.." && pwd)
. "$project/scripts/debian-root.sh"
make_debian_root "$root"

# As a clone would be: what is under version control or would be, and nothing built.
rm -rf "$root/root/caustica"
mkdir -p "$root/root/caustica"
if git -C "$project" rev-parse >/dev/null 2>&1; then
    git -C "$project" ls-files -z --cached --others --exclude-standard |
        tar -C "$project" --null --ignore-failed-read -cf - -T - # files deleted but not committed may be missing
else
    tar -C "$project" --exclude='./build*' --exclude='./out' -cf - .
fi | tar -C "$root/root/caustica" -xf -

enter_debian_root "$root"
inside sh -c 'command -v make >/dev/null ||
    { apt-get -q update && apt-get -qy install --no-install-recommends make; }'
for target in "$@"; do
    echo "== make $target"
    inside make -C /root/caustica "$target"
done
