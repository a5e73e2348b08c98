"""Properties of a filter whose exact answer is known, and of how its functions go about their work.

Evidence and moments must be right within the error of sampling. A particle filter's estimate of the evidence is
unbiased, so its logarithm lies on average half its variance too low. A right filter is judged by how much its own
answers scatter over the seeds; how much they may scatter is bounded, too. Functions are judged by what they cost, what
they leave alone, and that they replay.
"""

import math
import time
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.experiments.own.code import FilterCode
from pftrack.teaching.exercises.submission import (
    RISK,
    Options,
    Submission,
    Verdict,
    arrays_in,
    generator,
    moments_on_grid,
    student_margin,
)


def _log_evidence(submission: Submission, seed: int, tracker: str | None = None) -> float:
    return math.fsum(row.log_evidence for row in submission.rows(seed, tracker))


def _differences(submission: Submission, options: Options, seed: int, tracker: str | None) -> Floats:
    """Return by how much the log evidence of each run is above the exact one."""
    seeds = range(seed, seed + int(options["runs"]))
    exact = str(options["exact"])
    found = [_log_evidence(submission, each, tracker) - _log_evidence(submission, each, exact) for each in seeds]
    return np.array(found)


def evidence(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether the log evidence is the exact filter's within its Monte Carlo error."""
    off = _differences(submission, options, seed, None)
    worst = seed + int(np.argmax(np.abs(np.where(np.isfinite(off), off, np.inf))))
    if not np.isfinite(off).all():
        return Verdict(False, f"The evidence is {off[worst - seed]} in the run of seed {worst}.", {}, worst)
    spread, mean = float(np.std(off, ddof=1)), float(np.mean(off))
    expected = -0.5 * spread**2
    # That half a variance is known from few runs only, and is exact for a normal law only.
    margin = student_margin(off, RISK) + spread**2
    most = float(options["most_spread"])
    numbers = {"mean": mean, "expected": expected, "margin": margin, "spread": spread, "most_spread": most}
    words = (
        f"Over {len(off)} runs of {submission.exercise.frames} frames the log evidence is on average {mean:+.3f} off "
        f"the exact one, scattered by {spread:.3f}; a right filter's is {expected:+.3f} off, give or take "
        f"{margin:.3f}, scattered by at most {most:g}. Furthest off is the run of seed {worst}, by "
        f"{off[worst - seed]:+.3f}."
    )
    return Verdict(abs(mean - expected) <= margin and spread <= most, words, numbers, worst)


def moments(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether mean and standard deviation at the end are those of a grid over the states."""
    seeds = range(seed, seed + int(options["runs"]))
    means, deviations = [], []
    for each in seeds:
        mean, deviation = moments_on_grid(submission, each, noise=str(options["noise"]))
        row = submission.rows(each)[-1]
        means.append((row.estimate[0] - mean) / deviation)
        deviations.append(math.log(max(row.sigma[0], 1e-300) / deviation))
    most = float(options["most_spread"])
    numbers: dict[str, float] = {}
    holds, told = True, []
    for name, values in (("mean", np.array(means)), ("sigma", np.array(deviations))):
        off, spread = float(np.mean(values)), float(np.std(values, ddof=1))
        margin = student_margin(values, RISK) + float(options["rounding"])
        holds = holds and abs(off) <= margin and spread <= most
        numbers |= {f"{name}_off": off, f"{name}_margin": margin, f"{name}_spread": spread}
        unit = "standard deviations of the grid's" if name == "mean" else "of its logarithm"
        told.append(
            f"{name} {off:+.3f} {unit}, give or take {margin:.3f}, scattered by {spread:.3f} (at most {most:g})"
        )
    worst = seed + int(np.argmax(np.abs(means) + np.abs(deviations)))
    return Verdict(holds, f"Over {len(seeds)} runs, off the grid's on average: {'; '.join(told)}.", numbers, worst)


def steadier(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether the log evidence scatters less than that of another tracker, which does not look ahead."""
    other = str(options["than"])
    mine, theirs = (
        float(np.std(_differences(submission, options, seed, tracker), ddof=1)) for tracker in (None, other)
    )
    ratio, most = mine / theirs, float(options["most"])
    words = (
        f"Over {options['runs']} runs the log evidence scatters by {mine:.3f}, and that of {other} by {theirs:.3f}: "
        f"{ratio:.2f} times, and at most {most:g} are due."
    )
    return Verdict(ratio <= most, words, {"mine": mine, "theirs": theirs, "ratio": ratio, "most": most}, seed)


COUNT = 100
TRIES = 3
"""A time is told anew so often before it counts: others may have been at the processor."""
FACTOR = 8
ENOUGH_S = 0.3
"""A call that takes so long is measured well enough."""
DRAWING = "propagate", "propose", "resample", "step"
"""Functions whose results hang on their random numbers."""


def _call(
    submission: Submission, function: str, seed: int, given: dict[str, Any], code: FilterCode | None = None
) -> Any:  # noqa: ANN401
    return submission.call(function, code=code, rng=generator(seed), **given)


def linear(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether eight times as many particles take about eight times as long, and not sixty-four times."""
    small, large, most = int(options["small"]), int(options["large"]), float(options["most_exponent"])
    worst, numbers = "", {"exponent": -math.inf}
    for function in submission.defined:
        count = small
        while count < large and numbers["exponent"] <= most:
            exponent, times = _growth(submission, function, count, seed, most)
            if exponent > numbers["exponent"]:
                worst = function
                numbers = {"exponent": exponent, "count": count, "ms": 1e3 * times[0], "ms_after": 1e3 * times[1]}
            count *= FACTOR
    words = (
        f"Of all functions {worst} grows fastest: {numbers['ms']:.3g} ms for {numbers['count']:,.0f} particles and "
        f"{numbers['ms_after']:.3g} ms for {FACTOR * numbers['count']:,.0f}, as N to the power "
        f"{numbers['exponent']:.2f}; at most {most:g} is due."
    )
    return Verdict(numbers["exponent"] <= most, words, numbers, seed)


def _growth(
    submission: Submission, function: str, count: int, seed: int, most: float
) -> tuple[float, tuple[float, float]]:
    """Return the power of N with which a function grows from a number of particles on, and both times, s."""
    exponent, times = math.inf, (0.0, 0.0)
    for _ in range(TRIES):
        before, after = (_seconds(submission, function, each, seed) for each in (count, FACTOR * count))
        found = math.log(after / before) / math.log(FACTOR)
        if found < exponent:
            exponent, times = found, (before, after)
        if exponent <= most:
            break
    return exponent, times


def _seconds(submission: Submission, function: str, count: int, seed: int) -> float:
    """Return the least processor time of some calls."""
    given = submission.arguments(function, count, seed)
    least, spent = math.inf, 0.0
    for _ in range(7):
        begun = time.thread_time()
        _call(submission, function, seed, given)
        took = max(time.thread_time() - begun, 1e-6)
        least, spent = min(least, took), spent + took
        if spent > ENOUGH_S:
            break
    return least


def unchanged(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether a function leaves what it is given as it was."""
    del options
    for function in submission.defined:
        given = submission.arguments(function, COUNT, seed)
        before = {name: each for key, value in given.items() for name, each in arrays_in(value, key).items()}
        _call(submission, function, seed, given)
        after = {name: each for key, value in given.items() for name, each in arrays_in(value, key).items()}
        for name, array in before.items():
            if not np.array_equal(array, after[name], equal_nan=True):
                places = int(np.sum(~np.isclose(array, after[name], equal_nan=True, rtol=0, atol=0)))
                words = f"{function} changes {name}, which belongs to the run, in {places} places; make a copy first."
                return Verdict(False, words, {"places": float(places)}, seed)
    return Verdict(True, f"{', '.join(submission.defined)} left what they were given as it was.", {}, seed)


def replays(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether the numbers follow from the seed: the same again, the same in a new process, others with another."""
    del options
    fresh = submission.fresh()
    for function in submission.defined:
        given = submission.arguments(function, COUNT, seed)

        def again(number: int, code: FilterCode | None = None, name: str = function) -> dict[str, Any]:
            return arrays_in(_call(submission, name, number, submission.arguments(name, COUNT, seed), code), name)

        first = arrays_in(_call(submission, function, seed, given), function)
        others = [again(number) for number in range(seed + 1, seed + 8)]
        if not _same(first, again(seed)):
            words = f"{function} comes to other numbers with the same seed: take randomness from rng, and keep nothing."
            return Verdict(False, words, {}, seed)
        if not _same(first, again(seed, fresh)):
            words = f"{function} comes to other numbers when the file is loaded anew: it remembers what it did before."
            return Verdict(False, words, {}, seed)
        if function in DRAWING and all(_same(first, other) for other in others):
            words = f"{function} comes to the same numbers whatever the seed is: it does not draw from rng."
            return Verdict(False, words, {}, seed)
    return Verdict(True, f"{', '.join(submission.defined)} come to the same numbers with the same seed.", {}, seed)


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)
