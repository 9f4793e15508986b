#!/bin/bash
# Checks that the Debian package installs and works on a bare Debian 12: makes an empty root folder with debootstrap,
# installs there the package of `make package` with apt, then a compiler, and renders: by the program, and by the
# first program of docs/library.md, built with pkg-config and with CMake's find_package. The pictures must be the
# same.
#
#   scripts/check-package.sh ROOT_FOLDER [PACKAGE.deb]         (needs root and debootstrap)
#
# A ROOT_FOLDER that exists already is used again. Default PACKAGE.deb: that in build/package. Mirror and proxy as in
# scripts/check-fresh-machine.sh.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '2,12s/^# \{0,1\}//p' "$0"; exit 2; }
root=$1
project=$(cd "$(dirname "$0")/.." && pwd)
package=${2:-$(ls "$project"/build/package/*.deb 2>/dev/null | tail -n 1)}
[ -f "$package" ] || { echo "there is no package: make package" >&2; exit 1; }
. "$project/scripts/debian-root.sh"
make_debian_root "$root"
enter_debian_root "$root"

cp "$package" "$root/root/caustica.deb"
inside apt-get -q update
inside apt-get -qy install --reinstall --no-install-recommends /root/caustica.deb
inside caustica --version
inside apt-get -qy install --no-install-recommends gcc libc6-dev pkg-config cmake make

# The README's scene, and the library's first program.
awk '/^```xml$/ { on = 1; next } /^```$/ { on = 0 } on' "$project/README.md" >"$root/root/ball.xml"
awk '/^```c$/ { on = ++n == 1; next } /^```$/ { on = 0 } on' "$project/docs/library.md" |
    sed 's/settings.samples_per_pixel = 4;/& settings.integrator = "path";/' >"$root/root/ten.c"
cat >"$root/root/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.22)
project(ten C)
find_package(caustica 0.1 REQUIRED)
add_executable(by-cmake ten.c)
target_link_libraries(by-cmake caustica::caustica)
CMAKE

inside sh -ec '
    cd /root
    rm -rf *.exr build
    caustica render ball.xml -o program.exr --spp 4 --integrator path
    cc ten.c $(pkg-config --cflags --libs caustica) -o by-pkg-config
    cmake -S . -B build >/dev/null
    cmake --build build >/dev/null
    for way in ./by-pkg-config build/by-cmake; do
        $way
        caustica compare ball.exr --reference program.exr --stats compared.json >/dev/null
        grep "\"rmse\": 0.0," compared.json
    done
    man_page=$(dpkg -L caustica | grep man1/caustica.1)
    test -n "$man_page"
    dpkg -r caustica
    test ! -e /usr/bin/caustica'
echo "the package installs, works and goes"
