#!/bin/bash
# The same bits from different builds: gcc and clang, -O1 and -O3, code for AVX2 and for AVX-512. (Embree always uses
# AVX2, whatever the machine has.) Renders small pictures with each and compares every value of every layer.
#
#   check-same-bits.sh [FOLDER]   builds go to FOLDER (default: build-same), some minutes each at the first time
#
# Prints a Markdown table. Exit status: 0 the same, 1 not. Builds that cannot be made or run here are named and left
# out. The last row is the same program with the C library's functions for processors without FMA and AVX2, as such a
# machine would choose them: what differs then is reported, not judged.
set -eu
cd "$(dirname "$0")/.."
folder=${1:-build-same}
mkdir -p "$folder"
jobs=${JOBS:-$(nproc)}

# name, compiler, -O, -march
builds="gcc-O3-avx2:gcc:3:x86-64-v3 gcc-O1-avx2:gcc:1:x86-64-v3 gcc-O3-avx512:gcc:3:x86-64-v4
clang-O3-avx2:clang-14:3:x86-64-v3 clang-O1-avx2:clang-14:1:x86-64-v3 clang-O3-avx512:clang-14:3:x86-64-v4"

# scene, integrator, sampler
pictures="paper-004/mirror-room:qmcppm:halton paper-004/mirror-room:qmcppm:independent
paper-004/camera-is-light:qmcppm:lattice-image caustics/caustics:ovcm:sobol cornell-box/cornell-box:path:sobol
rough-glass/rough-glass:bdpt:independent textured/textured:vavcm:independent"

build() { # build NAME COMPILER OPTIMISE ARCH
    command -v "$2" >/dev/null || { echo "SKIPPED: $1: there is no $2" >&2; return 1; }
    if [ "$4" = x86-64-v4 ] && ! grep -qw avx512vl /proc/cpuinfo; then
        echo "SKIPPED: $1: no AVX-512 here" >&2
        return 1
    fi
    cmake -S . -B "$folder/$1" --log-level=NOTICE -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER="$2" \
        -DCA_OPTIMISE="$3" -DCA_ARCH="$4" -DCA_LTO=OFF -DCA_TESTS=OFF -DCA_WERROR=OFF ${CMAKE_OPTIONS:-} >/dev/null
    cmake --build "$folder/$1" --parallel "$jobs" --target caustica >"$folder/$1.log" 2>&1 ||
        { tail -n 20 "$folder/$1.log" >&2; exit 1; }
}

picture() { # picture PROGRAM SCENE:INTEGRATOR:SAMPLER FILE
    local scene integrator sampler
    IFS=: read -r scene integrator sampler <<<"$2"
    rm -f "$3"
    "$1" render "scenes/$scene.xml" -i "$integrator" --sampler "$sampler" --spp 4 --resolution 96x72 --seed 7 \
        -o "$3" --quiet
}

# How many pixels differ, and the largest relative difference of R, G, B.
difference() { # difference A.exr B.exr
    "$folder/gcc-O3-avx2/paper_004" --difference "$1" "$2"
}

row() { # row NAME PROGRAM: compares with the first build's pictures
    local same=0 all=0 worst='' text
    for p in $pictures; do
        all=$((all + 1))
        picture "$2" "$p" "$folder/other.exr"
        text=$(difference "$folder/$(tr ':/' '--' <<<"$p").exr" "$folder/other.exr")
        case $text in 0\ of*) same=$((same + 1)) ;; *) worst="$worst ${p##*/} ($text)" ;; esac
    done
    echo "| $1 | $same of $all | ${worst:-–} |"
    [ "$same" = "$all" ]
}

status=0 first=
for b in $builds; do
    IFS=: read -r name compiler optimise arch <<<"$b"
    build "$name" "$compiler" "$optimise" "$arch" || continue
    program=$folder/$name/caustica
    if [ -z "$first" ]; then
        first=$program
        cmake --build "$folder/$name" --parallel "$jobs" --target paper_004 >>"$folder/$name.log" 2>&1
        for p in $pictures; do picture "$program" "$p" "$folder/$(tr ':/' '--' <<<"$p").exr"; done
        echo "| build | pictures with the same bits as $name | others |"
        echo "|---|---|---|"
        continue
    fi
    row "$name" "$program" || status=1
done
export GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable
row "the first, C library without FMA" "$first" || true
exit $status
