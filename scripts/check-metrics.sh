#!/bin/bash
# SSIM and FLIP of `caustica compare` against scikit-image and NVIDIA's flip-evaluator, on ten pairs of renders.
#
#   check-metrics.sh [BUILD]   BUILD has the program caustica (default: build); a Python environment with the packages
#                              is made in BUILD/metrics-python, the renders go to BUILD/metrics
#
# Exit status: 0 equal, 1 not, 77 skipped because the packages cannot be had.
set -eu
cd "$(dirname "$0")/.."
build=${1:-build}
python=$build/metrics-python

skip() {
    echo "SKIPPED: SSIM and FLIP were not compared with independent implementations: $1" >&2
    exit 77
}

packages="flip-evaluator==1.7 scikit-image==0.26.0 OpenEXR==3.5.3"
if ! "$python/bin/python" -c "import flip_evaluator, skimage, OpenEXR" 2>/dev/null; then
    rm -rf "$python"
    python3 -m venv "$python" >/dev/null 2>&1 || skip "python3 -m venv does not work (Debian: python3-venv)"
    # shellcheck disable=SC2086
    "$python/bin/pip" install --quiet --disable-pip-version-check $packages >&2 || skip "pip cannot install $packages"
fi
mkdir -p "$build/metrics"
exec "$python/bin/python" scripts/check-metrics.py pairs "$build/caustica" "$build/metrics"
