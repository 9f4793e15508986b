#!/bin/sh
# Puts the file TABLE into DOCUMENT, in place of what stands between the lines "<!-- NAME: begin" and
# "<!-- NAME: end".
#
#   scripts/put-tables.sh DOCUMENT NAME TABLE
set -eu
new=$(mktemp)
trap 'rm -f "$new"' EXIT
awk -v name="$2" -v table="$3" '
    index($0, "<!-- " name ": end") == 1 { inside = 0 }
    !inside { print }
    index($0, "<!-- " name ": begin") == 1 { inside = 1; while ((getline line < table) > 0) print line }
' "$1" >"$new"
cat "$new" >"$1"
