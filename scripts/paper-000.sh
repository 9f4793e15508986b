#!/bin/sh
# The figures of paper 000: measures noise, and writes its tables into docs/papers/000.md (between the two markers there) and its
# pictures to docs/pictures/paper-000/.
#
#   scripts/paper-000.sh BUILD_FOLDER [--quick] [--only SECTION]...
#
# --quick: less of everything, to see that it works; --only: some sections. Either only prints, and leaves the document alone.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
if [ $# -gt 0 ]; then exec "$build/paper_000" "$@"; fi

document=docs/papers/000.md
table=$(mktemp)
trap 'rm -f "$table" "$table.new"' EXIT
mkdir -p docs/pictures/paper-000
status=0
"$build/paper_000" --table "$table" --pictures docs/pictures/paper-000 || status=$?
cat "$table"
grep -q 'What it should show' "$table" # complete, whatever it shows
awk -v table="$table" '
    /<!-- paper-000: end/ { inside = 0 }
    !inside { print }
    /<!-- paper-000: begin/ { inside = 1; while ((getline line < table) > 0) print line }
' "$document" >"$table.new"
cat "$table.new" >"$document"
exit $status
