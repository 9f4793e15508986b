#!/bin/bash
# The installed library as a stranger meets it: the header compiles as C and C++ without a warning, programs link
# through pkg-config with the shared and the static library, and the shared one exports the documented names only.
# Speaks TAP. CA_BUILD_DIR: the build folder to install from.
set -u
. tests/support/tap.sh
build=${CA_BUILD_DIR:?the build folder to install from}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cached() { sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"; }
compiler=$(cached CMAKE_C_COMPILER)

if [ -n "$(cached CA_SANITIZE)" ]; then
    echo "1..1"
    left_out "installation" "a library with sanitizers is not for other programs"
    exit 0
fi

echo "1..8"
check "installs" cmake --install "$build" --prefix "$folder/prefix"
PKG_CONFIG_PATH=$(dirname "$(find "$folder/prefix" -name caustica.pc)")
export PKG_CONFIG_PATH
library_folder=$(pkg-config --variable=libdir caustica)

cat >"$folder/user.c" <<'END'
#include <caustica.h>
#include <string.h>

int main(void)
{
    ca_scene *scene = NULL;
    ca_error error;
    if (strcmp(ca_status_name(CA_OK), "ok") != 0 || ca_version()[0] == 0) return 1;
    if (ca_scene_load("missing.xml", NULL, 0, &scene, &error) == CA_OK) return 2;
    return strstr(error.message, "missing.xml") ? 0 : 3;
}
END
cp "$folder/user.c" "$folder/user.cpp"
warnings="-Wall -Wextra -Wpedantic -Wshadow -Werror"

# shellcheck disable=SC2046,SC2086 # flags are several words
check "header compiles as C11" \
    $compiler -std=c11 -Wstrict-prototypes $warnings $(pkg-config --cflags caustica) \
    -c "$folder/user.c" -o "$folder/c.o"
# shellcheck disable=SC2046,SC2086
check "header compiles as C++11" \
    g++ -std=c++11 $warnings $(pkg-config --cflags caustica) -c "$folder/user.cpp" -o "$folder/cpp.o"

shared_program() {
    # shellcheck disable=SC2046
    g++ "$folder/cpp.o" $(pkg-config --libs caustica) -o "$folder/shared" &&
        LD_LIBRARY_PATH=$library_folder "$folder/shared"
}
check "a C++ program runs with the shared library" shared_program

found_by_cmake() {
    mkdir -p "$folder/user"
    cp "$folder/user.c" "$folder/user"
    printf '%s\n' 'cmake_minimum_required(VERSION 3.22)' 'project(user C)' 'find_package(caustica 0.1 REQUIRED)' \
        'add_executable(user user.c)' 'target_link_libraries(user caustica::caustica)' >"$folder/user/CMakeLists.txt"
    cmake -S "$folder/user" -B "$folder/user/build" -DCMAKE_PREFIX_PATH="$folder/prefix" &&
        cmake --build "$folder/user/build" && "$folder/user/build/user"
}
check "CMake finds it" found_by_cmake

# With all of the library, whatever this program wants of it: every library behind it must be named.
static_program() {
    local whole='-Wl,--whole-archive -l:libcaustica.a -Wl,--no-whole-archive'
    # shellcheck disable=SC2046
    "$compiler" "$folder/c.o" $(pkg-config --static --libs caustica | sed "s/-lcaustica/$whole/") \
        -o "$folder/static" && "$folder/static"
}
check "a C program runs with the static library" static_program

# The names the header declares, and the names a dynamic linker sees.
exports_agree() {
    tr '\n' ' ' <include/caustica.h | grep -oE 'CA_API [^;{]*' | grep -oE '\bca_[a-z0-9_]+ *\(' | tr -d ' (' |
        sort -u >"$folder/declared"
    nm -D --defined-only "$library_folder/libcaustica.so" | awk '{ print $3 }' | sort -u >"$folder/exported"
    diff "$folder/declared" "$folder/exported"
}
check "the shared library exports what the header declares" exports_agree

manuals_are_there() {
    for file in man/man1/caustica.1 man/man1/caustica-render.1 \
        bash-completion/completions/caustica zsh/site-functions/_caustica; do
        test -s "$folder/prefix/share/$file" || return 1
    done
}
check "man pages and completion are installed" manuals_are_there
