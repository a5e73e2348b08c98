"""Properties of resampling: how many parents are drawn, and how often each."""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.teaching.exercises.margins import RISK, bernstein_margin
from pftrack.teaching.exercises.properties.property import Options
from pftrack.teaching.exercises.submission import Submission, generator
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["even", "keeps_count", "threshold", "unbiased"]

ROUNDING = 1e-9
"""Of an expected number of children: so close to a whole number it may be rounded either way."""


def _weights(seed: int) -> dict[str, NDArray[np.float64]]:
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
    submission: Submission, weights: NDArray[np.float64], count: int, seed: int, draw: int
) -> NDArray[np.int64] | str:
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
