#!/bin/sh
# Installs the Debian packages that are missing, and does nothing at all when none is.
#
#   scripts/install-dependencies.sh [GROUP]...      groups of scripts/packages.txt; default: build
set -eu
folder=$(dirname "$0")
[ $# -gt 0 ] || set -- build

if ! command -v dpkg-query >/dev/null 2>&1; then
    echo "not a Debian system: packages are not installed; scripts/packages.txt lists what is needed" >&2
    exit 0
fi

missing=
for group in "$@"; do
    for package in $(awk -v group="$group" '$1 !~ /^#/ && $2 == group { print $1 }' "$folder/packages.txt"); do
        status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
        # A package that others provide (pkgconf for pkg-config) counts as installed when its program is there.
        [ "$status" = installed ] || command -v "$package" >/dev/null 2>&1 || missing="$missing $package"
    done
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo >/dev/null 2>&1; then
    as_root=sudo
else
    echo "these Debian packages are missing:$missing" >&2
    echo "installing them needs root; run as root: apt-get install$missing" >&2
    exit 1
fi

install_missing() {
    # shellcheck disable=SC2086 # one word per package is meant
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
}
package_lists_know_all() {
    for package in $missing; do
        apt-cache show --no-all-versions "$package" >/dev/null 2>&1 || return 1
    done
}

echo "installing:$missing"
if package_lists_know_all && install_missing; then
    exit 0
fi
# No package lists yet, or lists so old that their files are gone from the mirror.
$as_root apt-get update
install_missing
