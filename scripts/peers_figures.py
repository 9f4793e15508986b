"""The arithmetic of scripts/bench-peers.py: errors of an image, costs, and their ratio with an interval. Needs nothing but Python;
tests/test_peers_figures.py checks it."""
import math
import random
import statistics

RELMSE_FLOOR = 0.01   # as in `caustica compare`, docs/metrics.md
WORST = 0.001         # share of the pixels that the trimmed error leaves out
RESAMPLES = 2000
CONFIDENCE = 0.95
NOISE_BOUND = 4.0     # standard errors


def relative_square(value, reference):
    """What relMSE is the mean of; numbers, or arrays of them."""
    return (value - reference) ** 2 / (reference ** 2 + RELMSE_FLOOR)


def mean_without_worst(errors, share=WORST):
    """Mean of the errors but for the largest ones; at least one is left out, and at least one is kept."""
    left_out = max(1, math.ceil(share * len(errors) - 1e-9)) if share > 0.0 else 0
    kept = sorted(errors)[:max(1, len(errors) - left_out)]
    return math.fsum(kept) / len(kept)


def cost(runs, error):
    """Error times seconds, the median over runs: the inverse of the efficiency. It stays the same for any number of samples."""
    return statistics.median(run[error] * run["seconds"] for run in runs)


def efficiency_ratio(ours, theirs, error):
    """Efficiency of ours over that of theirs, and the bounds of a bootstrap interval over the seeds; the runs of a seed, which
    followed one another, stay together."""
    def ratio(seeds):
        return cost([theirs[i] for i in seeds], error) / cost([ours[i] for i in seeds], error)

    count = len(ours)
    if count != len(theirs) or count == 0:
        raise ValueError("a run of each renderer is needed for every seed")
    numbers = random.Random(1)
    resampled = sorted(ratio(numbers.choices(range(count), k=count)) for _ in range(RESAMPLES))
    tail = int(RESAMPLES * (1.0 - CONFIDENCE) / 2.0)
    return ratio(range(count)), resampled[tail], resampled[RESAMPLES - 1 - tail]


def samples_for(seconds, measured_samples, measured_seconds):
    """Samples per pixel that take so many seconds."""
    return max(1, round(measured_samples * seconds / measured_seconds))


def standard_error(values):
    return statistics.stdev(values) / math.sqrt(len(values))


def relative_bias(values, expected):
    """Of the mean of the values over what is expected, and its standard error."""
    return statistics.fmean(values) / expected - 1.0, standard_error(values) / expected


def differs(values, expected, relative):
    """Whether the mean of the values, one of each seed, is off by more than a share of what is expected and its own noise."""
    return abs(statistics.fmean(values) - expected) > relative * abs(expected) + NOISE_BOUND * standard_error(values)


def share_that_differs(blocks_of_seeds, expected_blocks, relative):
    """Share of the blocks of an image whose mean over the seeds differs from what is expected."""
    return statistics.fmean(differs(values, expected, relative)
                            for values, expected in zip(zip(*blocks_of_seeds), expected_blocks, strict=True))
