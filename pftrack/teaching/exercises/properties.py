"""Properties: what a file should do, each a function that looks and returns a verdict.

Those of single functions call these with arrays made for it; those of a filter compare runs with an exact answer, with
another tracker, or with the truth. Here are those of weights, which are a distribution, whatever the likelihood says;
of resampling, which draws so many parents, each so often; and of a tracker, which holds its target. `exact` has those
with an exact answer and those of how functions go about it. `PROPERTIES` has all by name; their titles, options and
margins stand in `properties.yaml`.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.texts import CLOSED, read_as
from pftrack.experiments.own.code import FilterCode, FilterFileError
from pftrack.filters.particles import normalise
from pftrack.teaching.exercises.submission import (
    RISK,
    Look,
    Option,
    Options,
    Submission,
    Verdict,
    arrays_in,
    bernstein_margin,
    generator,
    moments_on_grid,
    student_margin,
)

# Properties of a filter whose exact answer is known, and of how its functions go about their work.
#
# Evidence and moments must be right within the error of sampling. A particle filter's estimate of the evidence is
# unbiased, so its logarithm lies on average half its variance too low. A right filter is judged by how much its own
# answers scatter over the seeds; how much they may scatter is bounded, too. Functions are judged by what they cost,
# what they leave alone, and that they replay.


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


TOLERANCE = 1e-9
"""Relative; what rounding makes of a few hundred numbers is a thousandth of it."""


def _cases(seed: int) -> dict[str, Floats]:
    drawn = generator(seed, 3).standard_normal(200)
    with_none = drawn.copy()
    with_none[::3] = -np.inf
    one = np.full(20, -np.inf)
    one[7] = -3.0
    return {
        "of about 1": drawn,
        "as of 1,000 pixels, around -2,000": 300.0 * drawn - 2000.0,
        "around 900": drawn + 900.0,
        "a third of which is -inf": with_none,
        "all but one of which are -inf": one,
        "that are all equal": np.full(50, -5.0),
        "of two values": np.repeat([-1.0, -2.0], 30),
        "of one particle": np.array([-4.0]),
        "that are all -inf": np.full(10, -np.inf),
    }


def distribution(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether weights sum to one and keep their ratios, or of a whole step whether they can be scaled so."""
    del options
    defined = submission.defined
    if "normalise" in defined:
        return _of_normalise(submission, seed)
    if "step" in defined:
        return _of_step(submission, seed)
    raise FilterFileError(submission.code.file, None, "defines neither normalise nor step")


def _of_normalise(submission: Submission, seed: int) -> Verdict:
    for kind, given in _cases(seed).items():
        found = submission.call("normalise", log_weights=given.copy())
        problem, numbers = _problem(found, given)
        if problem:
            return Verdict(False, f"With log weights {kind}, normalise {problem}.", numbers, seed)
    return Verdict(True, f"They sum to one in all of {len(_cases(seed))} cases.", {}, seed)


def _problem(found: object, given: Floats) -> tuple[str, dict[str, float]]:
    """Return what is wrong, a clause, and its numbers; empty if nothing is."""
    if not isinstance(found, tuple) or len(found) != 2:
        return "returned no pair of log_weights and the logarithm of their sum", {}
    try:
        logs, log_sum = np.asarray(found[0], dtype=np.float64), float(found[1])
    except (TypeError, ValueError):
        return "returned what is no array of numbers and a number", {}
    if logs.shape != given.shape or np.isnan(logs).any():
        shape = f"of shape {logs.shape}, {np.isnan(logs).sum()} of them NaN"
        return f"returned log_weights {shape}; expected {given.shape} numbers", {}
    return _compare(logs, log_sum, given)


def _compare(logs: Floats, log_sum: float, given: Floats) -> tuple[str, dict[str, float]]:
    total = float(np.exp(logs).sum())
    if abs(total - 1.0) > TOLERANCE:
        return f"returned weights that sum to {total:.12g}", {"sum": total}
    exact, exact_sum = normalise(given)
    if not np.allclose(np.exp(logs), np.exp(exact), rtol=1e-6, atol=TOLERANCE):
        place = int(np.argmax(np.abs(np.exp(logs) - np.exp(exact))))
        numbers = {"weight": float(np.exp(logs[place])), "expected": float(np.exp(exact[place]))}
        return f"gave particle {place} the weight {numbers['weight']:.6g}; expected {numbers['expected']:.6g}", numbers
    if not np.isclose(log_sum, exact_sum, rtol=TOLERANCE, atol=TOLERANCE):
        numbers = {"log_sum": log_sum, "expected": float(exact_sum)}
        return f"returned {log_sum:.6g} as the logarithm of their sum; expected {exact_sum:.6g}", numbers
    return "", {}


def _of_step(submission: Submission, seed: int) -> Verdict:
    count = 200
    given = submission.arguments("step", count, seed)
    kinds = {"that are equal": np.zeros(count), "of which half are -inf": np.where(np.arange(count) % 2, -np.inf, 0.0)}
    for kind, logs in kinds.items():
        given["log_weights"], _ = normalise(logs)
        found = submission.call("step", rng=generator(seed), **given)
        if not isinstance(found, tuple) or len(found) not in {2, 3}:
            return Verdict(
                False, "step must return states and log_weights, and may return ancestors as well.", {}, seed
            )
        returned = np.asarray(found[1], dtype=np.float64)
        bad = np.isnan(returned) | (returned == np.inf)
        if returned.shape != (len(found[0]),) or bad.any() or not np.isfinite(normalise(returned)[1]):
            words = f"With log weights {kind}, step returned {bad.sum()} that are NaN or infinite of {returned.shape}."
            return Verdict(False, words, {"bad": float(bad.sum())}, seed)
        dead = np.isneginf(given["log_weights"])
        if len(found) == 3 and dead[np.asarray(found[2])].any():
            parent = int(np.asarray(found[2])[np.argmax(dead[np.asarray(found[2])])])
            words = f"With log weights {kind}, step drew parent {parent}, whose weight is zero."
            return Verdict(False, words, {"parent": float(parent)}, seed)
    return Verdict(True, f"They are a distribution in all of {len(kinds)} cases.", {}, seed)


ROUNDING = 1e-9
"""Of an expected number of children: so close to a whole number it may be rounded either way."""


def _weights(seed: int) -> dict[str, Floats]:
    """Return weights of several kinds by what is special of them; they sum to one."""
    rng = generator(seed, 1)
    drawn = rng.dirichlet(np.full(17, 0.6))
    some = rng.random(24) * (np.arange(24) % 3 > 0)
    tied = np.repeat([1.0, 3.0, 4.0], [5, 4, 3])
    one = np.full(9, 1e-4)
    one[4] = 1.0
    kinds = {"uneven": drawn, "a third of them zero": some, "ties": tied, "one that has nearly all": one}
    return {name: weights / weights.sum() for name, weights in kinds.items()}


def _draw(submission: Submission, weights: Floats, count: int, seed: int, draw: int) -> Ints | str:
    """Return the places of parents, or what is wrong with what came back, a clause."""
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    found = submission.call(
        "resample",
        log_weights=log_weights,
        count=count,
        parameters=submission.parameters,
        rng=generator(seed, draw),
    )
    places = np.asarray(found)
    if places.ndim != 1 or places.dtype.kind not in "iu":
        return f"returned {places.dtype} of shape {places.shape} instead of whole numbers one after the other"
    if len(places) != count:
        return f"returned {len(places)} parents where {count} were asked for"
    if count and (places.min() < 0 or places.max() >= len(weights)):
        return f"returned the parent {places.min() if places.min() < 0 else places.max()} of 0 to {len(weights) - 1}"
    return places.astype(np.int64)


def keeps_count(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether as many parents come as are asked for, all of them there, and none of weight zero."""
    tried = 0
    for kind, weights in _weights(seed).items():
        for count in (len(weights), 1, 2 * len(weights), 3 * len(weights) // 2):
            for number in range(seed, seed + int(options["draws"])):
                places = _draw(submission, weights, count, number, 0)
                numbers = {"count": float(count)}
                if isinstance(places, str):
                    return Verdict(False, f"With weights that are {kind}, resample {places}.", numbers, number)
                dead = np.flatnonzero(weights[places] == 0)
                if len(dead):
                    words = f"With {kind}, resample drew parent {places[dead[0]]}, whose weight is zero."
                    return Verdict(False, words, numbers, number)
                tried += 1
    return Verdict(True, f"All {tried} draws had as many parents as were asked for.", {"draws": float(tried)})


def unbiased(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether particle n has on average N times its weight children.

    The number of children of a particle is a sum of independent numbers that are 0 or 1, for multinomial, stratified,
    residual and systematic resampling alike, with a variance of at most N w (1 - w): so Bernstein's bound holds.
    """
    draws = int(options["draws"])
    kinds = _weights(seed)
    worst: tuple[float, str, dict[str, float]] = (-math.inf, "", {})
    for kind, weights in kinds.items():
        count = len(weights)
        children = np.zeros(count)
        for draw in range(draws):
            places = _draw(submission, weights, count, seed, draw)
            if isinstance(places, str):
                return Verdict(False, f"With weights that are {kind}, resample {places}.", {"draw": float(draw)}, seed)
            children += np.bincount(places, minlength=count)
        margins = bernstein_margin(draws * count * weights * (1.0 - weights), RISK / len(kinds)) / draws
        off = np.abs(children / draws - count * weights)
        place = int(np.argmax(off / margins))
        numbers = {
            "particle": float(place),
            "children": float(children[place] / draws),
            "expected": float(count * weights[place]),
            "margin": float(margins[place]),
        }
        worst = max(worst, (float(off[place] / margins[place]), kind, numbers), key=lambda each: each[0])
    ratio, kind, numbers = worst
    words = (
        f"Furthest off, with weights that are {kind}: particle {numbers['particle']:.0f} had on average "
        f"{numbers['children']:.3f} children in {draws} draws; expected {numbers['expected']:.3f}, "
        f"give or take {numbers['margin']:.3f}."
    )
    return Verdict(ratio <= 1.0, words, numbers, seed)


def even(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether each particle has N times its weight children, rounded up or down."""
    for kind, weights in _weights(seed).items():
        count = len(weights)
        for number in range(seed, seed + int(options["draws"])):
            places = _draw(submission, weights, count, number, 0)
            if isinstance(places, str):
                return Verdict(False, f"With weights that are {kind}, resample {places}.", {}, number)
            children, expected = np.bincount(places, minlength=count), count * weights
            low, high = np.floor(expected - ROUNDING), np.ceil(expected + ROUNDING)
            bad = np.flatnonzero((children < low) | (children > high))
            if len(bad):
                place = int(bad[0])
                numbers = {"particle": place, "children": float(children[place]), "expected": float(expected[place])}
                words = (
                    f"With weights that are {kind}, particle {place} had {children[place]} children where "
                    f"{low[place]:.0f} or {high[place]:.0f} are due."
                )
                return Verdict(False, words, numbers, number)
    return Verdict(True, "Each particle had N times its weight children, rounded up or down.", {})


def threshold(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether parents are drawn just when the effective sample size is below a share of N."""
    share, cases = float(options["share"]), int(options["cases"])
    rng = generator(seed, 2)
    seen = 0
    for case in range(20 * cases):
        count = int(rng.integers(5, 400))
        logs = rng.uniform(0.05, 3.0) * rng.standard_normal(count)
        logs[rng.random(count) < (0.4 if case % 3 == 0 else 0.0)] = -np.inf
        logs[0] = 0.0
        logs -= np.log(np.exp(logs).sum())
        size = 1.0 / float(np.square(np.exp(logs)).sum())
        if abs(size / count - share) < 0.01:
            continue  # too close to tell rounding from a mistake
        found = submission.call("should_resample", log_weights=logs, parameters=submission.parameters)
        if not isinstance(found, bool | np.bool_) or bool(found) != (size < share * count):
            words = (
                f"The effective sample size is {size:.2f} of {count}, {size / count:.0%}; should_resample returned "
                f"{found}, and is to be true below {share:.0%}."
            )
            return Verdict(False, words, {"effective_sample_size": size, "count": float(count)}, seed)
        seen += 1
        if seen == cases:
            break
    return Verdict(True, f"It was right in all of {seen} cases.", {"cases": float(seen)}, seed)


LAST = 0.25
"""Of the frames: so long the target has to be held at the end."""


def held(submission: Submission, options: Options, seed: int) -> Verdict:
    """See in how many seeds the target is held at the end, whatever was in its way."""
    runs, needed = int(options["runs"]), int(options["needed"])
    lost = [
        each
        for each in range(seed, seed + runs)
        if not _is_held(submission.rows(each), float(options["largest_error"]))
    ]
    words = f"The target is held in {runs - len(lost)} of {runs} seeds; {needed} are due."
    if lost:
        words += f" It is lost in seed {', '.join(map(str, lost[:5]))}{' and others' if len(lost) > 5 else ''}."
    numbers = {"held": float(runs - len(lost)), "runs": float(runs), "needed": float(needed)}
    return Verdict(runs - len(lost) >= needed, words, numbers, lost[0] if lost else seed)


def _is_held(run: Sequence[Diagnostics], largest_error: float) -> bool:
    """Return whether a run ends on its target: by the experiment's notion of lost, or by its mean error."""
    rows = run[-max(math.ceil(LAST * len(run)), 1) :]
    if largest_error > 0:
        errors = [row.error for row in rows if row.error is not None]
        return bool(errors) and float(np.mean(errors)) <= largest_error
    return not any(row.is_lost for row in rows)


LOOKS: Mapping[str, Look] = {
    "keeps-count": keeps_count,
    "unbiased": unbiased,
    "even": even,
    "threshold": threshold,
    "distribution": distribution,
    "evidence": evidence,
    "moments": moments,
    "steadier": steadier,
    "held": held,
    "linear": linear,
    "unchanged": unchanged,
    "replays": replays,
}


@dataclass(frozen=True)
class Property:
    """Something that should hold of a file.

    Attributes:
        name: In the heads of exercises.
        origin: File and line where it is declared.
        title: What holds, a clause.
        options: Their defaults; an empty text has to be given.
        margin: How far a right solution may be off, and how seldom it fails; a sentence for the documentation.
    """

    __pydantic_config__ = CLOSED

    name: str
    origin: str
    title: str
    options: dict[str, Option] = field(default_factory=dict)
    margin: str = "Nothing in it is left to chance."

    @property
    def look(self) -> Look:
        """(submission, options, first seed) -> what was found."""
        return LOOKS[self.name]


PROPERTIES: Mapping[str, Property] = {
    each.name: each for each in read_as(Property, Path(__file__).with_name("properties.yaml"), "name")
}
