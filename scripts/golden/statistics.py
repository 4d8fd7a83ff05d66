"""Golden values of `mackrl::statistics`, from the published formulas in plain Python.

Interquartile mean: of the sorted sample, floor(n/4) values at each end are left out (scipy.stats.trim_mean at 0.25).
Probability of improvement: Mann-Whitney U over n*m, averaged over tasks (Agarwal and others 2021).
Intervals: stratified percentile bootstrap; draws by Philox4x32-10 (Salmon and others 2011) under the names that
`mackrl_env::EpisodeKey` documents, so that the intervals are equal and not only close.

`python3 scripts/golden/statistics.py --check` compares with the package `rliable`, which has to be installed for it; its draws
are others, so its intervals are only close.
"""

import json
import math
import sys
from pathlib import Path

COMMAND = "python3 scripts/golden/statistics.py"
PATH = Path(__file__).resolve().parents[2] / "crates/mackrl/tests/golden/statistics.json"
SEED, RESAMPLES, CONFIDENCE = 7, 500, 0.95
# Two algorithms on two tasks, 5 runs each, as win rates of 32 episodes, ties included.
FIRST = [[27 / 32, 30 / 32, 12 / 32, 31 / 32, 29 / 32], [8 / 32, 19 / 32, 21 / 32, 3 / 32, 25 / 32]]
SECOND = [[22 / 32, 27 / 32, 30 / 32, 18 / 32, 9 / 32], [2 / 32, 8 / 32, 0 / 32, 11 / 32, 19 / 32]]
OTHER = 3  # mackrl_env::Stream::Other
SETUP = 4  # mackrl_env::Draw::Setup


def philox(counter, key):
    counter, key = list(counter), list(key)
    for round_ in range(10):
        if round_ > 0:
            key = [(key[0] + 0x9E3779B9) & 0xFFFFFFFF, (key[1] + 0xBB67AE85) & 0xFFFFFFFF]
        product0, product1 = counter[0] * 0xD2511F53, counter[2] * 0xCD9E8D57
        counter = [
            (product1 >> 32) ^ counter[1] ^ key[0],
            product1 & 0xFFFFFFFF,
            (product0 >> 32) ^ counter[3] ^ key[1],
            product0 & 0xFFFFFFFF,
        ]
    return counter


def uniform(seed, episode, step, index):
    episode |= OTHER << 56
    counter = [episode & 0xFFFFFFFF, episode >> 32, step, SETUP << 28 | index]
    low, high = philox(counter, [seed & 0xFFFFFFFF, seed >> 32])[:2]
    return ((high << 32 | low) >> 11) / 2**53


def mean(sample):
    return sum(sample) / len(sample)


def standard_error(sample):
    centre = mean(sample)
    variance = sum((x - centre) ** 2 for x in sample) / (len(sample) - 1)
    return math.sqrt(variance / len(sample))


def quantile(sample, share):
    ordered = sorted(sample)
    place = share * (len(ordered) - 1)
    below = math.floor(place)
    above = math.ceil(place)
    return ordered[below] + (place - below) * (ordered[above] - ordered[below])


def interquartile_mean(sample):
    ordered = sorted(sample)
    cut = len(ordered) // 4
    return mean(ordered[cut : len(ordered) - cut])


def flat(tasks):
    return [run for runs in tasks for run in runs]


AGGREGATES = {
    "mean": lambda tasks: mean([mean(runs) for runs in tasks]),
    "median": lambda tasks: quantile([mean(runs) for runs in tasks], 0.5),
    "interquartile-mean": lambda tasks: interquartile_mean(flat(tasks)),
}


def improvement(first, second):
    def of_task(xs, ys):
        return sum((x > y) + 0.5 * (x == y) for x in xs for y in ys) / (len(xs) * len(ys))

    return mean([of_task(xs, ys) for xs, ys in zip(first, second)])


def resample(strata, number):
    def draw(stratum, runs):
        return [runs[int(uniform(SEED, number, stratum, i) * len(runs))] for i in range(len(runs))]

    return [draw(stratum, runs) for stratum, runs in enumerate(strata)]


def interval(strata, statistic):
    statistics = [statistic(resample(strata, number)) for number in range(RESAMPLES)]
    outside = (1 - CONFIDENCE) / 2
    return {
        "estimate": statistic(strata),
        "low": quantile(statistics, outside),
        "high": quantile(statistics, 1 - outside),
    }


def golden():
    both = FIRST + SECOND
    return {
        "command": COMMAND,
        "seed": SEED,
        "resamples": RESAMPLES,
        "confidence": CONFIDENCE,
        "first": FIRST,
        "second": SECOND,
        "uniform": [uniform(SEED, r, s, i) for r in (0, 3) for s in (0, 2) for i in (0, 5)],
        "standard_error": standard_error(FIRST[0]),
        "quantiles": [[share, quantile(FIRST[0], share)] for share in (0, 0.025, 0.3, 0.5, 0.975, 1)],
        "aggregates": {name: interval(FIRST, aggregate) for name, aggregate in AGGREGATES.items()},
        "improvement": interval(both, lambda strata: improvement(strata[: len(FIRST)], strata[len(FIRST) :])),
    }


def check():
    import numpy
    from rliable import library, metrics

    first, second = numpy.array(FIRST).T, numpy.array(SECOND).T
    ours = golden()
    theirs = {
        "mean": metrics.aggregate_mean,
        "median": metrics.aggregate_median,
        "interquartile-mean": metrics.aggregate_iqm,
    }
    for name, function in theirs.items():
        points, bounds = library.get_interval_estimates({"a": first}, lambda x: numpy.array([function(x)]), reps=50_000)
        print(name, "rliable", points["a"][0], bounds["a"][:, 0], "ours", ours["aggregates"][name])
        assert abs(points["a"][0] - ours["aggregates"][name]["estimate"]) < 1e-12
    points, bounds = library.get_interval_estimates(
        {"a,b": (first, second)}, lambda x, y: numpy.array([metrics.probability_of_improvement(x, y)]), reps=5_000
    )
    print("improvement rliable", points["a,b"][0], bounds["a,b"][:, 0], "ours", ours["improvement"])
    assert abs(points["a,b"][0] - ours["improvement"]["estimate"]) < 1e-12


if __name__ == "__main__":
    if "--check" in sys.argv:
        check()
    else:
        PATH.write_text(json.dumps(golden(), indent=1) + "\n")
        print(f"wrote {PATH.relative_to(Path.cwd())}")
