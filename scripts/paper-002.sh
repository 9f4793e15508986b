#!/bin/sh
# The comparison of paper 002: renders, and writes its tables into docs/papers/002.md (between the two markers there) and its
# close-ups to docs/pictures/paper-002/. Some twenty minutes on two processors.
#
#   scripts/paper-002.sh BUILD_FOLDER [--quick | --iterations N] [--only SCENE]
#
# --quick: 40 iterations; --only: one scene. Either only prints, and leaves the document alone.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
if [ $# -gt 0 ]; then exec "$build/paper_002" "$@"; fi

document=docs/papers/002.md
table=$(mktemp)
trap 'rm -f "$table" "$table.new"' EXIT
mkdir -p docs/pictures/paper-002
status=0
"$build/paper_002" --table "$table" --pictures docs/pictures/paper-002 || status=$?
cat "$table"
grep -q 'What it should show' "$table" # complete, whatever it shows
awk -v table="$table" '
    /<!-- paper-002: end/ { inside = 0 }
    !inside { print }
    /<!-- paper-002: begin/ { inside = 1; while ((getline line < table) > 0) print line }
' "$document" >"$table.new"
cat "$table.new" >"$document"
exit $status
