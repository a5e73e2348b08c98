"""Properties: requirements on a file, each a function that checks one and returns a verdict.

Those of single functions call these with arrays made for it; those of a filter compare runs with an exact answer, with
another tracker, or with the truth. They concern weights, which must be a distribution for any likelihood; resampling,
which must draw the right number of each parent; a tracker, which must hold its target; exact answers; and the behaviour
of functions. `PROPERTIES` has all by name; their titles, options, margins and verdicts are in `properties.yaml`.
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
    SettledError,
    Submission,
    Verdict,
    arrays_in,
    bernstein_margin,
    generator,
    moments_on_grid,
    student_margin,
)


@dataclass(frozen=True)
class Property:
    """Something that should hold of a file.

    Attributes:
        name: In the heads of exercises.
        origin: File and line where it is declared.
        title: The property, a clause.
        options: Their defaults; an empty text has to be given.
        margin: Tolerance for a right solution, and its rate of failure; a sentence for the documentation.
        words: Texts of verdicts, by finding; numbers are in braces.
    """

    __pydantic_config__ = CLOSED

    name: str
    origin: str
    title: str
    options: dict[str, Option] = field(default_factory=dict)
    margin: str = "This check involves no chance."
    words: dict[str, str] = field(default_factory=dict)

    @property
    def look(self) -> Look:
        """(submission, options, first seed) -> what was found."""
        return LOOKS[self.name]


PROPERTIES: Mapping[str, Property] = {
    each.name: each for each in read_as(Property, Path(__file__).with_name("properties.yaml"), "name")
}


def _say(
    found: str, seed: int | None, numbers: Mapping[str, float] | None = None, /, *, holds: bool = False, **said: object
) -> Verdict:
    """Return a verdict in the words that the file has for it.

    Args:
        found: Name of the property, and of its words: "held few".
        seed: As `Verdict.seed`.
        numbers: As `Verdict.numbers`; the words may name them.
        holds: As `Verdict.holds`.
        **said: Further values in the words.
    """
    name, _, what = found.partition(" ")
    numbers = numbers or {}
    return Verdict(holds, PROPERTIES[name].words[what].format(**{**numbers, **said}), numbers, seed)


# Properties of a filter whose exact answer is known, and of how its functions go about their work.
#
# Evidence and moments must be right within the error of sampling. A particle filter's estimate of the evidence is
# unbiased, so its logarithm lies on average half its variance too low. A right filter is judged by the scatter of its
# own answers over the seeds, which is bounded, too. Functions are judged by what they cost, what they leave alone, and
# that they replay.


def _log_evidence(submission: Submission, seed: int, tracker: str | None = None) -> float:
    return math.fsum(row.log_evidence for row in submission.rows(seed, tracker))


def _differences(submission: Submission, options: Options, seed: int, tracker: str | None) -> Floats:
    """Return the log evidence of each run, less the exact one."""
    seeds = range(seed, seed + int(options["runs"]))
    exact = str(options["exact"])
    found = [_log_evidence(submission, each, tracker) - _log_evidence(submission, each, exact) for each in seeds]
    return np.array(found)


def evidence(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether the log evidence is the exact filter's within its Monte Carlo error."""
    off = _differences(submission, options, seed, None)
    worst = seed + int(np.argmax(np.abs(np.where(np.isfinite(off), off, np.inf))))
    if not np.isfinite(off).all():
        return _say("evidence endless", worst, off=off[worst - seed], worst=worst)
    spread, mean = float(np.std(off, ddof=1)), float(np.mean(off))
    expected = -0.5 * spread**2
    # Half a variance is estimated from few runs, and is exact only for a normal law.
    margin = student_margin(off, RISK) + spread**2
    most = float(options["most_spread"])
    numbers = {"mean": mean, "expected": expected, "margin": margin, "spread": spread, "most_spread": most}
    holds = abs(mean - expected) <= margin and spread <= most
    said = {"runs": len(off), "frames": submission.exercise.frames, "worst": worst, "off": off[worst - seed]}
    return _say("evidence result", worst, numbers, holds=holds, **said)


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
    holds = True
    for name, values in (("mean", np.array(means)), ("sigma", np.array(deviations))):
        off, spread = float(np.mean(values)), float(np.std(values, ddof=1))
        margin = student_margin(values, RISK) + float(options["rounding"])
        holds = holds and abs(off) <= margin and spread <= most
        numbers |= {f"{name}_off": off, f"{name}_margin": margin, f"{name}_spread": spread}
    worst = seed + int(np.argmax(np.abs(means) + np.abs(deviations)))
    return _say("moments result", worst, numbers, holds=holds, runs=len(seeds), most=most)


def steadier(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether the log evidence scatters less than that of another tracker, which does not look ahead."""
    other = str(options["than"])
    mine, theirs = (
        float(np.std(_differences(submission, options, seed, tracker), ddof=1)) for tracker in (None, other)
    )
    ratio, most = mine / theirs, float(options["most"])
    numbers = {"mine": mine, "theirs": theirs, "ratio": ratio, "most": most}
    return _say("steadier ratio", seed, numbers, holds=ratio <= most, runs=options["runs"], other=other)


COUNT = 100
TRIES = 3
"""Repetitions of a time measurement, because other processes may have used the processor."""
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
    holds, more = numbers["exponent"] <= most, FACTOR * numbers["count"]
    return _say("linear growth", seed, numbers, holds=holds, worst=worst, more=more, most=most)


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
    """Check whether a function leaves its arguments unchanged."""
    del options
    for function in submission.defined:
        given = submission.arguments(function, COUNT, seed)
        before = {name: each for key, value in given.items() for name, each in arrays_in(value, key).items()}
        _call(submission, function, seed, given)
        after = {name: each for key, value in given.items() for name, each in arrays_in(value, key).items()}
        for name, array in before.items():
            if not np.array_equal(array, after[name], equal_nan=True):
                places = int(np.sum(~np.isclose(array, after[name], equal_nan=True, rtol=0, atol=0)))
                return _say("unchanged changed", seed, {"places": float(places)}, function=function, name=name)
    return _say("unchanged right", seed, holds=True, functions=", ".join(submission.defined))


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
            return _say("replays differently", seed, function=function)
        if not _same(first, again(seed, fresh)):
            return _say("replays remembered", seed, function=function)
        if function in DRAWING and all(_same(first, other) for other in others):
            return _say("replays alike", seed, function=function)
    return _say("replays right", seed, holds=True, functions=", ".join(submission.defined))


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)


TOLERANCE = 1e-9
"""Relative tolerance; rounding errors of a few hundred numbers are a thousandth of it."""


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
        "a third of them -inf": with_none,
        "all but one -inf": one,
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
        what, said = _problem(found, given)
        if what:
            numbers = {name: value for name, value in said.items() if isinstance(value, float)}
            return _say(f"distribution {what}", seed, numbers, kind=kind, **said)
    return _say("distribution right", seed, holds=True, count=len(_cases(seed)), how="sum to one")


def _problem(found: object, given: Floats) -> tuple[str, dict[str, Any]]:
    """Return the name of what is wrong, and what its words name, numbers among it; empty if nothing is."""
    if not isinstance(found, tuple) or len(found) != 2:
        return "pair", {}
    try:
        logs, log_sum = np.asarray(found[0], dtype=np.float64), float(found[1])
    except (TypeError, ValueError):
        return "numbers", {}
    if logs.shape != given.shape or np.isnan(logs).any():
        return "shape", {"shape": logs.shape, "nan": np.isnan(logs).sum(), "due": given.shape}
    return _compare(logs, log_sum, given)


def _compare(logs: Floats, log_sum: float, given: Floats) -> tuple[str, dict[str, Any]]:
    weights, (exact, exact_sum) = np.exp(logs), normalise(given)
    total, expected = float(weights.sum()), np.exp(exact)
    if abs(total - 1.0) > TOLERANCE:
        return "sum", {"sum": total}
    if not np.allclose(weights, expected, rtol=1e-6, atol=TOLERANCE):
        place = int(np.argmax(np.abs(weights - expected)))
        return "weight", {"place": place, "weight": float(weights[place]), "expected": float(expected[place])}
    if not np.isclose(log_sum, exact_sum, rtol=TOLERANCE, atol=TOLERANCE):
        return "log", {"log_sum": log_sum, "expected": float(exact_sum)}
    return "", {}


def _of_step(submission: Submission, seed: int) -> Verdict:
    count = 200
    given = submission.arguments("step", count, seed)
    kinds = {"that are equal": np.zeros(count), "half of them -inf": np.where(np.arange(count) % 2, -np.inf, 0.0)}
    for kind, logs in kinds.items():
        given["log_weights"], _ = normalise(logs)
        found = submission.call("step", rng=generator(seed), **given)
        if not isinstance(found, tuple) or len(found) not in {2, 3}:
            return _say("distribution step", seed)
        returned = np.asarray(found[1], dtype=np.float64)
        bad = np.isnan(returned) | (returned == np.inf)
        if returned.shape != (len(found[0]),) or bad.any() or not np.isfinite(normalise(returned)[1]):
            return _say("distribution infinite", seed, {"bad": float(bad.sum())}, kind=kind, shape=returned.shape)
        dead = np.isneginf(given["log_weights"])
        if len(found) == 3 and dead[np.asarray(found[2])].any():
            parent = int(np.asarray(found[2])[np.argmax(dead[np.asarray(found[2])])])
            return _say("distribution dead", seed, {"parent": float(parent)}, kind=kind)
    return _say("distribution right", seed, holds=True, count=len(kinds), how="are a distribution")


ROUNDING = 1e-9
"""Distance of an expected number of children from a whole number within which it may be rounded either way."""


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


def _draw(
    submission: Submission,
    kind: str,
    weights: Floats,
    count: int,
    seed: int,
    draw: int = 0,
    numbers: Mapping[str, float] | None = None,
) -> Ints:
    """Return the places of parents.

    Args:
        submission: Whose `resample` is called.
        kind: Kind of weights.
        weights: They sum to 1.
        count: Number of parents.
        seed: Seed of the random numbers.
        draw: Index of the draw with this seed.
        numbers: Numbers of the verdict for a wrong result.

    Raises:
        SettledError: Something else came back.
    """
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    rng, parameters = generator(seed, draw), submission.parameters
    found = submission.call("resample", log_weights=log_weights, count=count, parameters=parameters, rng=rng)
    places = np.asarray(found)
    said: dict[str, Any] = {"type": places.dtype, "shape": places.shape, "due": count, "last": len(weights) - 1}
    what = ""
    if places.ndim != 1 or places.dtype.kind not in "iu":
        what = "type"
    elif len(places) != count:
        what, said["got"] = "number", len(places)
    elif count and (places.min() < 0 or places.max() >= len(weights)):
        what, said["got"] = "place", places.min() if places.min() < 0 else places.max()
    if what:
        raise SettledError(_say(f"keeps-count {what}", seed, numbers, kind=kind, **said))
    return places.astype(np.int64)


def keeps_count(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether as many parents come as are asked for, all of them there, and none of weight zero."""
    tried = 0
    for kind, weights in _weights(seed).items():
        for count in (len(weights), 1, 2 * len(weights), 3 * len(weights) // 2):
            for number in range(seed, seed + int(options["draws"])):
                places = _draw(submission, kind, weights, count, number, numbers={"count": float(count)})
                dead = np.flatnonzero(weights[places] == 0)
                if len(dead):
                    return _say("keeps-count dead", number, {"count": float(count)}, kind=kind, parent=places[dead[0]])
                tried += 1
    return _say("keeps-count right", None, {"draws": float(tried)}, holds=True)


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
            places = _draw(submission, kind, weights, count, seed, draw, numbers={"draw": float(draw)})
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
    return _say("unbiased result", seed, numbers, holds=ratio <= 1.0, kind=kind, draws=draws)


def even(submission: Submission, options: Options, seed: int) -> Verdict:
    """See whether each particle has N times its weight children, rounded up or down."""
    for kind, weights in _weights(seed).items():
        count = len(weights)
        for number in range(seed, seed + int(options["draws"])):
            places = _draw(submission, kind, weights, count, number)
            children, expected = np.bincount(places, minlength=count), count * weights
            low, high = np.floor(expected - ROUNDING), np.ceil(expected + ROUNDING)
            bad = np.flatnonzero((children < low) | (children > high))
            if len(bad):
                place = int(bad[0])
                numbers = {"particle": place, "children": float(children[place]), "expected": float(expected[place])}
                return _say("even uneven", number, numbers, kind=kind, low=low[place], high=high[place])
    return _say("even right", None, holds=True)


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
            continue  # too close to distinguish rounding from a mistake
        found = submission.call("should_resample", log_weights=logs, parameters=submission.parameters)
        if not isinstance(found, bool | np.bool_) or bool(found) != (size < share * count):
            numbers = {"effective_sample_size": size, "count": float(count)}
            return _say("threshold wrong", seed, numbers, found=found, share=share, part=size / count)
        seen += 1
        if seen == cases:
            break
    return _say("threshold right", seed, {"cases": float(seen)}, holds=True)


LAST = 0.25
"""Share of the frames, at the end, in which the target must be held."""


def held(submission: Submission, options: Options, seed: int) -> Verdict:
    """Count the seeds with which the target is held at the end, whatever was in its way."""
    runs, needed = int(options["runs"]), int(options["needed"])
    lost = [
        each
        for each in range(seed, seed + runs)
        if not _is_held(submission.rows(each), float(options["largest_error"]))
    ]
    numbers = {"held": float(runs - len(lost)), "runs": float(runs), "needed": float(needed)}
    told = ", ".join(map(str, lost[:5])) + (" and others" if len(lost) > 5 else "")
    what = "held lost" if lost else "held all"
    return _say(what, lost[0] if lost else seed, numbers, holds=runs - len(lost) >= needed, lost=told)


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
