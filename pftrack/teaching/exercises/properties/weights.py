"""The property of weights: that they are a distribution, whatever the likelihood comes to."""

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.own import FilterFileError
from pftrack.filters.particles import normalise
from pftrack.teaching.exercises.properties.property import Options
from pftrack.teaching.exercises.submission import Submission, generator
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["distribution"]

TOLERANCE = 1e-9
"""Relative; what rounding makes of a few hundred numbers is a thousandth of it."""


def _cases(seed: int) -> dict[str, NDArray[np.float64]]:
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


def _problem(found: object, given: NDArray[np.float64]) -> tuple[str, dict[str, float]]:
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


def _compare(logs: NDArray[np.float64], log_sum: float, given: NDArray[np.float64]) -> tuple[str, dict[str, float]]:
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
