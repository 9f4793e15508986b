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
[ "$(id -u)" -eq 0 ] || { echo "debootstrap and chroot need root" >&2; exit 1; }
project=$(cd "$(dirname "$0")/.." && pwd)

setting() { apt-config dump "$1" 2>/dev/null | sed -n 's/^[^"]*"\(.*\)";$/\1/p' | head -n 1 || true; }
configured_mirror() {
    cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources 2>/dev/null |
        grep -oE '(https?|file):/[^ ]*/debian/?( |$)' | head -n 1 | tr -d ' ' || true
}
mirror=${CA_MIRROR:-$(configured_mirror)}
[ -n "$mirror" ] ||
    { echo "this machine's apt names no Debian mirror: set CA_MIRROR to the address of one" >&2; exit 1; }
proxy=$(setting Acquire::http::Proxy)

if [ ! -e "$root/etc/debian_version" ]; then
    http_proxy=${proxy:-${http_proxy:-}} debootstrap --variant=minbase bookworm "$root" "$mirror"
    [ -z "$proxy" ] || echo "Acquire::http::Proxy \"$proxy\";" >"$root/etc/apt/apt.conf.d/proxy"
    cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || true
fi

# As a clone would be: what is under version control or would be, and nothing built.
rm -rf "$root/root/caustica"
mkdir -p "$root/root/caustica"
if git -C "$project" rev-parse >/dev/null 2>&1; then
    git -C "$project" ls-files -z --cached --others --exclude-standard |
        tar -C "$project" --null --ignore-failed-read -cf - -T - # files deleted but not committed may be missing
else
    tar -C "$project" --exclude='./build*' --exclude='./out' -cf - .
fi | tar -C "$root/root/caustica" -xf -

mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
mkdir -p "$root/dev/pts"
mountpoint -q "$root/dev/pts" || mount --bind /dev/pts "$root/dev/pts"
[ -e "$root/dev/ptmx" ] || ln -s pts/ptmx "$root/dev/ptmx"
trap 'umount "$root/proc" "$root/dev/pts"' EXIT
inside() {
    chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        ${http_proxy:+http_proxy="$http_proxy"} "$@"
}

inside sh -c 'command -v make >/dev/null ||
    { apt-get -q update && apt-get -qy install --no-install-recommends make; }'
for target in "$@"; do
    echo "== make $target"
    inside make -C /root/caustica "$target"
done
