#!/usr/bin/env python3
"""How often the error bars of `auto` hold the expectation of their pixel, by the Python package as `make python test` leaves it.

    PYTHONPATH=build/python/modules build/python/environment/bin/python scripts/bench-auto-bars.py [--seconds S] [--size N]
        [--seeds K] [--only SCENE]

Each of the first five scenes is rendered K times for S seconds. A pixel's expectation is the mean of the other renders, whose own
noise lets an interval of 95 % hold it in 95 % - 11 % / (K - 1) of cases: 94.7 % with 40 renders. Prints a table in Markdown: the
share of pixels with noise and a finite interval, of these the widened ones, and how often either kind holds the luminance's
expectation. The limits are 95 % intervals over renders, since pixels of one render are not independent."""
import argparse
import math
import statistics

import caustica
import numpy as np
from auto_scenes import SCENES

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
NO_NOISE = 1e-5  # of the expectation: a pixel without noise has an interval of a float's last digits


def render(scene, options, seed):
    return caustica.render(scene, integrator="auto", seconds=options.seconds, size=(options.size, options.size), threads=2,
                           seed=seed, progress=False)


def of_intervals(shares):
    """Mean and half an interval of shares, in percent."""
    if not shares:
        return "–"
    half = 1.96 * statistics.stdev(shares) / math.sqrt(len(shares)) if len(shares) > 1 else math.nan
    return f"{100 * statistics.mean(shares):.1f} ± {100 * half:.1f}"


def row(name, file, options):
    scene = caustica.load_file(file)
    images = [render(scene, options, 1 + k) for k in range(options.seeds)]
    values = np.array([image.rgb @ LUMINANCE for image in images])
    ordinary, widened, finite = [], [], []
    for k, image in enumerate(images):
        low, high = image["ConfidenceLow.Y"], image["ConfidenceHigh.Y"]
        expected = (values.sum(axis=0) - values[k]) / (options.seeds - 1)
        known = np.isfinite(low) & np.isfinite(high) & (high - low > NO_NOISE * expected)
        wide = known & (image["ConfidenceWidened.Y"] > 0)
        holds = (low <= expected) & (expected <= high)
        finite.append((known.mean(), wide.sum() / max(known.sum(), 1)))
        for which, shares in ((known & ~wide, ordinary), (wide, widened)):
            if which.any():
                shares.append(holds[which].mean())
    methods = {image.statistics["method"]["reason"].split()[1].strip(",") for image in images}
    known, wide = (100 * statistics.mean(shares) for shares in zip(*finite))
    cells = name, f"{known:.0f} %", f"{wide:.0f} %", of_intervals(ordinary), of_intervals(widened), ", ".join(sorted(methods))
    return f"| {' | '.join(cells)} |"


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--only")
    options = parser.parse_args()
    print("| scene | noisy, finite | widened | ordinary ones hold, % | widened ones hold, % | chosen |", flush=True)
    print("|---|---|---|---|---|---|", flush=True)
    for name, file in SCENES[:5]:
        if not options.only or options.only in name:
            print(row(name, file, options), flush=True)


if __name__ == "__main__":
    main()
