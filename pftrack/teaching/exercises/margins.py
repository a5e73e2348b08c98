"""Margins of chance: how far a right solution may be off, so that it practically never fails.

Each check that rests on random draws has a false alarm with a probability of `RISK`, shared among all that it compares.
The seeds are fixed: a solution that has passed once passes again.
"""

import math

import numpy as np
from scipy import stats

from pftrack.core.arrays import Floats

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
