#!/bin/bash
# The arithmetic of `make bench-peers`: errors, costs, their ratio and its interval, the agreement of means. Speaks
# TAP.
set -u
if ! command -v python3 >/dev/null; then
    echo "1..1"
    echo "ok 1 - figures of bench-peers # SKIP python3 is not installed (scripts/install-dependencies.sh peers)"
    exit 0
fi
PYTHONPATH=scripts exec python3 -B - <<'END'
import random

import peers_figures as f

number = 0


def verdict(name, passed, found):
    global number
    number += 1
    print("%s %d - %s" % ("ok" if passed else "not ok", number, name))
    if not passed:
        print("# found:", found)


def near(name, found, expected, tolerance=1e-12):
    verdict(name, abs(found - expected) <= tolerance, found)


def runs(errors, seconds):
    return [{"relmse": e, "seconds": s} for e, s in zip(errors, seconds)]


print("1..15")
near("relative square", f.relative_square(1.5, 0.3), 1.44 / 0.1)
errors = [1.0] * 1998 + [500.0, 700.0]
random.Random(3).shuffle(errors)
near("the worst 0.1 % are left out, wherever they are", f.mean_without_worst(errors), 1.0)
near("of few errors one is left out", f.mean_without_worst([1.0, 3.0, 8.0]), 2.0)
near("a share rounds up", f.mean_without_worst([1.0] * 1000 + [10.0, 10.0]), 1.0)
near("0 leaves out nothing", f.mean_without_worst([1.0, 3.0, 8.0], 0.0), 4.0)
near("cost is the median of error times seconds", f.cost(runs([1, 2, 9], [5, 1, 1]), "relmse"), 5.0)

# The machine was slow for both at the later seeds, which is no noise of the ratio.
ours, theirs = runs([0.5, 0.5, 0.5], [1, 2, 3]), runs([0.5, 0.5, 0.5], [4, 8, 12])
ratio, low, high = f.efficiency_ratio(ours, theirs, "relmse")
near("a quarter of the cost is four times the efficiency", ratio, 4.0)
verdict("runs of a seed stay together", (low, high) == (4.0, 4.0), (low, high))

# Over many experiments the interval must hold the true ratio, 2, nearly as often as it says.
numbers = random.Random(7)
f.RESAMPLES = 200
held, width = 0, 0.0
for _ in range(200):
    sample = [runs([numbers.lognormvariate(mean, 0.3) for _ in range(16)], [1.0] * 16)
              for mean in (0.0, 0.6931471805599453)]
    _, low, high = f.efficiency_ratio(sample[0], sample[1], "relmse")
    held += low <= 2.0 <= high
    width += (high - low) / 200
verdict("95 % intervals hold the true ratio", 0.9 <= held / 200 <= 0.995, held / 200)
verdict("and are no wider than the noise", 0.5 < width < 1.4, width)

near("samples that take a time", f.samples_for(0.5, 16, 0.1), 80)
near("at least one sample", f.samples_for(0.01, 4, 3.0), 1)
bias, error = f.relative_bias([2.1, 2.2, 2.3], 2.0)
near("relative bias", bias, 0.1)
near("its standard error", error, 0.1 / 3 ** 0.5 / 2.0)
# Four blocks of three seeds: exact; within its noise; within the share; off by more than both.
seeds = [[1.0, 0.5, 1.005, 1.10], [1.0, 1.0, 1.005, 1.11], [1.0, 1.5, 1.005, 1.12]]
near("share of the blocks that differ", f.share_that_differs(seeds, [1.0, 1.5, 1.0, 1.0], 0.01), 0.25)
END
