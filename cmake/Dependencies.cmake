# Finds what Caustica stands on; the target caustica-dependencies carries it all. Each library is used by one file of
# ours (scripts/check-sources.sh knows which). Debian 12 names: see scripts/packages.txt.

find_package(PNG REQUIRED)
find_package(EXPAT REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Threads REQUIRED)

# A library without a reliable CMake package: target `name` from one header and the first library name found.
function(caustica_find_library name header)
    find_path(${name}_INCLUDE_DIR ${header} PATH_SUFFIXES OpenEXR REQUIRED)
    find_library(${name}_LIBRARY NAMES ${ARGN} REQUIRED)
    add_library(${name} INTERFACE)
    target_include_directories(${name} SYSTEM INTERFACE ${${name}_INCLUDE_DIR})
    target_link_libraries(${name} INTERFACE ${${name}_LIBRARY})
endfunction()

# Embree 4 where it is installed, else 3.
find_path(embree4_HEADER_DIR embree4/rtcore.h)
if(embree4_HEADER_DIR)
    caustica_find_library(caustica-embree embree4/rtcore.h embree4)
    target_compile_definitions(caustica-embree INTERFACE CA_EMBREE_MAJOR=4)
    set(CA_EMBREE_LIBRARY embree4)
else()
    caustica_find_library(caustica-embree embree3/rtcore.h embree3)
    target_compile_definitions(caustica-embree INTERFACE CA_EMBREE_MAJOR=3)
    set(CA_EMBREE_LIBRARY embree3)
endif()
# Of OpenEXR only the C core; its CMake package complains about parts of Imath that Debian puts elsewhere.
caustica_find_library(caustica-openexr openexr.h OpenEXRCore-3_1 OpenEXRCore)
caustica_find_library(caustica-turbojpeg turbojpeg.h turbojpeg)
caustica_find_library(caustica-webp webp/decode.h webp)
caustica_find_library(caustica-jansson jansson.h jansson)
caustica_find_library(caustica-microhttpd microhttpd.h microhttpd)
find_path(stb_INCLUDE_DIR stb_image.h PATH_SUFFIXES stb REQUIRED)

add_library(caustica-dependencies INTERFACE)
target_include_directories(caustica-dependencies SYSTEM INTERFACE ${stb_INCLUDE_DIR})
target_link_libraries(caustica-dependencies INTERFACE
    caustica-embree caustica-openexr PNG::PNG EXPAT::EXPAT ZLIB::ZLIB caustica-turbojpeg caustica-webp
    caustica-jansson caustica-microhttpd Threads::Threads m)

# MPI is for the program alone, and only where it is installed. Sanitizers know nothing of its memory.
set(CA_MPI_FOUND OFF)
if(CA_MPI AND NOT CA_SANITIZE)
    find_package(MPI QUIET COMPONENTS C)
    set(CA_MPI_FOUND ${MPI_C_FOUND})
endif()
