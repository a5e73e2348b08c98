"""Verdicts: whether a property holds of a file, with the numbers that say so."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from pftrack.core.arrays import Floats


@dataclass(frozen=True)
class Verdict:
    """What came of looking at a property.

    Attributes:
        holds: Whether it holds.
        words: What was found, a sentence.
        numbers: By name, those that decided.
        seed: Of the random numbers that show it; None where nothing is random.
    """

    holds: bool
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    seed: int | None = None


# A right solution practically never fails by chance: each check that rests on random draws has a false alarm with a
# probability of `RISK`, shared among all that it compares. Seeds are fixed, so what has passed once passes again.


RISK = 1e-6
"""Probability that a right solution fails a check by chance."""


def bernstein_margin(variances: Floats, risk: float) -> Floats:
    """Return how far sums of independent 0-or-1 numbers may be off their expectations (Bernstein's inequality).

    It holds for every variance and every number of draws, not only for many. With v the sum of the variances, the
    probability of being off by more than t is at most 2 exp(-t^2 / (2 v + 2 t / 3)).

    Args:
        variances: (N,) sums of variances, or more than these.
        risk: Probability that one of the N sums is further off.
    """
    exponent = math.log(2.0 * len(variances) / risk)
    margin: Floats = exponent / 3.0 + np.sqrt((exponent / 3.0) ** 2 + 2.0 * exponent * variances)
    return margin


def student_margin(values: Floats, risk: float) -> float:
    """Return how far the mean of independent, about normal numbers may be off its expectation, by Student's t."""
    count = len(values)
    quantile = float(stats.t.ppf(1.0 - risk / 2.0, count - 1))
    return quantile * float(np.std(values, ddof=1)) / math.sqrt(count)
