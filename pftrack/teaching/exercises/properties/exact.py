"""Properties of a filter whose exact answer is known: its evidence and its moments, within the error of sampling.

A particle filter's estimate of the evidence is unbiased, so its logarithm lies on average half its variance too low. A
right filter is judged by how much its own answers scatter over the seeds; how much they may scatter is bounded, too.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.teaching.exercises.grid import moments_on_grid
from pftrack.teaching.exercises.margins import RISK, student_margin
from pftrack.teaching.exercises.properties.property import Options
from pftrack.teaching.exercises.submission import Submission
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["evidence", "moments", "steadier"]


def _log_evidence(submission: Submission, seed: int, tracker: str | None = None) -> float:
    return math.fsum(row.log_evidence for row in submission.rows(seed, tracker))


def _differences(submission: Submission, options: Options, seed: int, tracker: str | None) -> NDArray[np.float64]:
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
