#!/bin/sh
# Source rules that a compiler does not check:
#
#   1. A file includes only its own folder of src/ or lower ones (order below), and its headers exist.
#   2. Each foreign library is used by its one file.
#   3. Heap memory comes from base/memory.h; nothing below cli/ prints or exits.
#   4. No file is left half done.
#   5. No line of C, shell or Python is longer than .editorconfig says.
#   6. Outside of src/integrator no name is compared with an integrator's: its row in the table says what it can do.
#
# Prints one line for each breach; exit status 1 if there is any. Comments and strings do not count for 3.
set -eu
cd "$(dirname "$0")/.."
sources=$(find include src tests bench -name '*.[ch]' | LC_ALL=C sort)

awk '
BEGIN {
    count = split("base math sampling image geometry material light camera scene path photon metrics film report" \
                  " import integrator noise render live cli", order, " ")
    for (i = 1; i <= count; i++) level[order[i]] = i
    # library: the files that may include it; tests make their own sample files
    owner["embree"]    = "^src/geometry/accel[a-z0-9_]*\\.[ch]$|^(bench|tests)/"
    owner["openexr"]   = "^src/image/[a-z0-9_]*exr[a-z0-9_]*\\.[ch]$|^tests/"
    owner["png"]       = "^src/image/[a-z0-9_]*png[a-z0-9_]*\\.[ch]$|^tests/"
    owner["turbojpeg"] = "^src/image/[a-z0-9_]*jpe?g[a-z0-9_]*\\.[ch]$|^tests/"
    owner["webp"]      = "^src/image/[a-z0-9_]*webp[a-z0-9_]*\\.[ch]$|^tests/"
    owner["stb"]       = "^src/image/[a-z0-9_]*stb[a-z0-9_]*\\.[ch]$|^tests/"
    owner["expat"]     = "^src/import/[a-z0-9_]*xml[a-z0-9_]*\\.[ch]$|^tests/"
    owner["jansson"]   = "^src/[a-z]+/([a-z]+/)?[a-z0-9_]*json[a-z0-9_]*\\.[ch]$|^(bench|tests)/"
    owner["microhttpd"] = "^src/live/server\\.c$"
    owner["mpi"]       = "^src/cli/mpi_ranks\\.c$"
    owner["zlib"]      = "^src/import/([a-z]+/)?[a-z0-9_]*(serialized|inflate)[a-z0-9_]*\\.[ch]$" \
                         "|^src/report/plane\\.c$|^tests/"
}

function complain(text) { printf "%s:%d: %s\n", FILENAME, FNR, text; breaches++ }

function foreign_library(header)
{
    if (header ~ /^embree[0-9]*\//) return "embree"
    if (header ~ /^(OpenEXR\/)?openexr[a-z_]*\.h$/) return "openexr"
    if (header ~ /^stb/) return "stb"
    if (header ~ /^webp\//) return "webp"
    if (header ~ /^(png|turbojpeg|expat|jansson|zlib|microhttpd|mpi)\.h$/)
        return substr(header, 1, length(header) - 2)
    return ""
}

function check_include(line,    header, library, folder)
{
    header = line
    sub(/^[ \t]*#[ \t]*include[ \t]*[<"]/, "", header)
    sub(/[>"].*/, "", header)
    if (line ~ /</) {
        library = foreign_library(header)
        if (library != "" && FILENAME !~ owner[library])
            complain("<" header "> is not for this file; its place is " owner[library])
        return
    }
    if (header == "caustica.h" || FILENAME !~ /^src\//) return
    folder = header
    sub(/\/.*/, "", folder)
    if (!(folder in level) || header !~ /\//) { complain("\"" header "\" is not written from src/"); return }
    if (level[folder] > level[own]) complain("\"" header "\": " own " may not look up to " folder)
    if ((getline text < ("src/" header)) < 0) complain("\"" header "\" does not exist")
    close("src/" header)
}

# The line without strings, character constants and comments; `in_comment` lives on from line to line.
function code_of(line,    start)
{
    gsub(/\\\\|\\"|\\\x27/, "", line)
    gsub(/"[^"]*"/, "\"\"", line)
    gsub(/\x27[^\x27]\x27/, "0", line)
    if (in_comment) {
        start = index(line, "*/")
        if (!start) return ""
        line = substr(line, start + 2)
        in_comment = 0
    }
    while ((start = index(line, "/*")) > 0) {
        rest = substr(line, start + 2)
        line = substr(line, 1, start - 1)
        if (!index(rest, "*/")) { in_comment = 1; break }
        line = line " " substr(rest, index(rest, "*/") + 2)
    }
    sub(/\/\/.*/, "", line)
    return line
}

FNR == 1 { own = FILENAME; sub(/^src\//, "", own); sub(/\/.*/, "", own); in_comment = 0 }
/^[ \t]*#[ \t]*include/ { check_include($0) }
/TODO|FIXME|XXX[^X]|HACK/ { if ($0 !~ /XXXXXX/) complain("unfinished: " $0) }
{
    code = code_of($0)
    if (FILENAME !~ /^src\// || FILENAME ~ /^src\/base\/memory\.c$/) next
    if (code ~ /(^|[^a-z0-9_])(malloc|calloc|realloc|free|strdup|strndup|aligned_alloc|posix_memalign)[ ]*\(/)
        complain("heap memory comes from base/memory.h")
    if (own != "cli" && code ~ /(^|[^a-z0-9_])(printf|puts|putchar|perror|exit|_exit|abort)[ ]*\(/)
        complain("nothing below cli/ prints or exits")
    if (own != "cli" && code ~ /(^|[^a-z0-9_])(stdout|stderr)([^a-z0-9_]|$)/) complain("nothing below cli/ prints")
}
END { exit breaches > 0 }
' $sources

# Rows of the table: .name = "bdpm". ("auto" is a word of settings->rays as well.)
integrators=$(find src/integrator -name '*.c' -exec sed -n 's/.*\.name = "\([a-z-]*\)",.*/\1/p' {} + 2>/dev/null |
    paste -sd'|' -)
if [ -n "$integrators" ] &&
    grep -nE "strn?cmp\([^;]*\"($integrators)[:\"]" $(find src -name '*.[ch]' ! -path 'src/integrator/*') |
    grep -v 'strcmp(settings->rays, '; then
    echo "these lines compare with an integrator's name: ask its row for an ability (src/integrator/integrator.h)"
    exit 1
fi

# What .editorconfig promises for [PATTERN].
promised_width() {
    awk -v section="[$1]" '/^\[/ { inside = $0 == section } inside && /^max_line_length/ { print $3 }' .editorconfig
}

# Characters, not bytes: sigma counts once.
check_width() { # check_width WIDTH FILE...
    longest=$1
    shift
    LC_ALL=C.UTF-8 grep -nE "^.{$((longest + 1)),}\$" /dev/null "$@" || return 0
    echo "these lines are longer than the $longest characters that .editorconfig promises"
    return 1
}

named() { find . \( -path './build*' -o -path ./out -o -path ./.git \) -prune -o -name "$1" -printf '%P\n'; }
width=$(promised_width '*')
python_width=$(promised_width '*.py')
status=0
# shellcheck disable=SC2046,SC2086 # names have no spaces
check_width "$width" $sources $(named '*.sh') || status=1
# shellcheck disable=SC2046
check_width "$python_width" $(named '*.py') || status=1
exit $status
