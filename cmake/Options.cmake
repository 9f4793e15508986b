# How everything is compiled: the target caustica-flags carries language level, warnings, optimisation and sanitizers.

set(CA_ARCH "x86-64-v3" CACHE STRING "Instruction set for -march (\"\" for the compiler's default)")
set(CA_OPTIMISE "3" CACHE STRING "Optimisation of release builds, as for -O; the same bits come from each")
set(CA_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (\"address,undefined\" or \"thread\")")
option(CA_WERROR "Treat warnings as errors" ON)
option(CA_TESTS "Build the tests (needs cmocka)" ON)
option(CA_FUZZ "Build the fuzzers (needs clang)" OFF)
option(CA_MPI "Let several processes make one picture (needs an MPI library; left out where there is none)" ON)
option(CA_LTO "Optimise over all files when linking (gcc, release builds)" ON)

if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Release or Debug" FORCE)
endif()
set(CMAKE_C_FLAGS_RELEASE "-O${CA_OPTIMISE} -DNDEBUG")
set(CMAKE_C_FLAGS_DEBUG "-O1 -g")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

add_library(caustica-flags INTERFACE)
target_compile_options(caustica-flags INTERFACE
    -std=c17 -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wdouble-promotion
    -Wconversion -Wsign-conversion -Wcast-qual)
if(CA_WERROR)
    target_compile_options(caustica-flags INTERFACE -Werror)
endif()
if(CA_ARCH)
    target_compile_options(caustica-flags INTERFACE -march=${CA_ARCH})
endif()

# Same bits everywhere: no contraction to fused operations, no reordering. Only what cannot change a result is given
# away: errno and floating-point traps.
target_compile_options(caustica-flags INTERFACE -ffp-contract=off -fno-math-errno -fno-trapping-math)

if(CA_SANITIZE)
    target_compile_options(caustica-flags INTERFACE
        -fsanitize=${CA_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(caustica-flags INTERFACE -fsanitize=${CA_SANITIZE})
endif()
if(CA_FUZZ)
    target_compile_options(caustica-flags INTERFACE -fsanitize=fuzzer-no-link) # coverage that steers the fuzzer
endif()

# Link-time optimisation, of the libraries, the program and the benches. Their objects keep plain machine code beside the
# intermediate code, so that the static library is of use to any linker. The tests are compiled and linked without it
# (CA_NO_LTO: for linking, since the linker would else find the intermediate code): they are many, and it would take longer
# than they do.
add_library(caustica-lto INTERFACE)
if(CA_LTO AND CMAKE_C_COMPILER_ID STREQUAL "GNU" AND CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT CA_SANITIZE)
    target_compile_options(caustica-lto INTERFACE -flto=auto -ffat-lto-objects)
    target_link_options(caustica-lto INTERFACE -flto=auto)
    if(CMAKE_C_COMPILER_AR)
        set(CMAKE_AR ${CMAKE_C_COMPILER_AR})
        set(CMAKE_RANLIB ${CMAKE_C_COMPILER_RANLIB})
    endif()
    set(CA_NO_LTO -fno-lto)
endif()
