# An empty Debian 12 in a folder: for scripts in bash that are root, sourced by them. The mirror and proxy of this
# machine's apt are used; CA_MIRROR overrides the mirror, and must be set where apt names none.

setting() { apt-config dump "$1" 2>/dev/null | sed -n 's/^[^"]*"\(.*\)";$/\1/p' | head -n 1 || true; }
configured_mirror() {
    cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources 2>/dev/null |
        grep -oE '(https?|file):/[^ ]*/debian/?( |$)' | head -n 1 | tr -d ' ' || true
}

# make_debian_root FOLDER: by debootstrap, unless it is there.
make_debian_root() {
    [ "$(id -u)" -eq 0 ] || { echo "debootstrap and chroot need root" >&2; exit 1; }
    local mirror=${CA_MIRROR:-$(configured_mirror)} proxy
    [ -n "$mirror" ] ||
        { echo "this machine's apt names no Debian mirror: set CA_MIRROR to the address of one" >&2; exit 1; }
    proxy=$(setting Acquire::http::Proxy)
    [ ! -e "$1/etc/debian_version" ] || return 0
    http_proxy=${proxy:-${http_proxy:-}} debootstrap --variant=minbase bookworm "$1" "$mirror"
    [ -z "$proxy" ] || echo "Acquire::http::Proxy \"$proxy\";" >"$1/etc/apt/apt.conf.d/proxy"
    cp -L /etc/resolv.conf "$1/etc/resolv.conf" 2>/dev/null || true
}

# enter_debian_root FOLDER: `inside COMMAND...` then runs there; what that takes is undone when the script ends.
enter_debian_root() {
    debian_root=$1
    mountpoint -q "$1/proc" || mount -t proc proc "$1/proc"
    mkdir -p "$1/dev/pts"
    mountpoint -q "$1/dev/pts" || mount --bind /dev/pts "$1/dev/pts"
    [ -e "$1/dev/ptmx" ] || ln -s pts/ptmx "$1/dev/ptmx"
    trap 'umount "$debian_root/proc" "$debian_root/dev/pts"' EXIT
}
inside() {
    chroot "$debian_root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy="$http_proxy"} "$@"
}
