#!/bin/sh
# The figures of a paper: runs its program (bench/paper_NUMBER.c), and writes the tables into docs/papers/NUMBER.md
# (between the two markers there) and pictures to docs/pictures/paper-NUMBER/.
#
#   scripts/paper-figures.sh NUMBER BUILD_FOLDER [the program's options: --full, --minutes N; --quick, --only ...]
#
# It takes less than two hours on two quiet processors: each section stops at its precision or at its share of the
# time. --full: at its precision, or as near as each program says; --minutes: another time for all. With --quick,
# --only, --times or --iterations it only prints, and leaves the document alone.
set -eu
paper=$1
build=$(cd "$2" && pwd)
shift 2
cd "$(dirname "$0")/.."
case " $* " in
*' --quick '* | *' --only '* | *' --times '* | *' --iterations '*) exec "$build/paper_$paper" "$@" ;;
esac

table=$(mktemp)
trap 'rm -f "$table"' EXIT
mkdir -p "docs/pictures/paper-$paper"
status=0
"$build/paper_$paper" "$@" --table "$table" --pictures "docs/pictures/paper-$paper" || status=$?
cat "$table"
grep -q 'What it should show' "$table" # complete, whatever it shows
scripts/put-tables.sh "docs/papers/$paper.md" "paper-$paper" "$table"
exit $status
