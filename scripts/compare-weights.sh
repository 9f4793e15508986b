#!/bin/sh
# The deviation of an iteration of `vavcm` over that of each other method (bench/compare_weights.c): writes the table
# into docs/decisions/018-variance-aware-weights.md, between the two markers there.
#
#   scripts/compare-weights.sh BUILD_FOLDER [--quick]
#
# It takes some 20 minutes on two processors. With --quick it only prints, from fewer iterations.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
[ "${1:-}" != --quick ] || exec "$build/compare_weights" --iterations 40

table=$(mktemp)
trap 'rm -f "$table"' EXIT
status=0
"$build/compare_weights" --iterations 60 --table "$table" || status=$?
cat "$table"
grep -q 'largest' "$table"
scripts/put-tables.sh docs/decisions/018-variance-aware-weights.md compare-weights "$table"
exit $status
