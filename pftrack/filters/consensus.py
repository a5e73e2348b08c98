"""Features of which some are elsewhere: an upper layer that listens to those that agree with it.

The mean of a feature's particles is its place only if the feature is where the template fits best. A template that has
slipped onto a cheek is sure of itself and wrong, and one such feature pulls the whole solid, which is then wrong about
all others. Here a feature is within some slack of where the solid has it, with the long tails of a t distribution. So
each particle is weighed by that too, and what a feature says is the mean of what is left, believed the less the less
is left. The solid is then estimated again, and the weighing repeated: the iterated reweighting by which t-distributed
errors are fitted (Lange, Little & Taylor, Journal of the American Statistical Association 84, 1989).
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.checks import check
from pftrack.core.numerics.compiled import compiled

__all__ = ["ROUNDS", "agreeing", "middle"]

ROUNDS = 3
"""Estimates of the solid, each from the features as the last one weighs them."""

FREEDOM = 2.0
"""Degrees of freedom of the tails."""

LEAST_AGREEMENT = 1e-3
"""A feature that agrees less counts as if it agreed as much as this."""

NOTHING_KNOWN_PX2 = 1e8
"""Variance of a feature that the picture says nothing of."""


def agreeing(
    positions: Floats,
    weights: Floats,
    expected: Floats,
    doubts: Floats,
    slack_px: float,
    sd_floor_px: float,
) -> tuple[Floats, Floats]:
    """Return what features say as far as they agree with a solid: means (F, 2) px and variances (F, 2) px^2.

    Args:
        positions: (F, N, 2) px of particles.
        weights: (F, N), normalised by feature.
        expected: (F, 2) px, where the solid has the features.
        doubts: (F,) by how much the variances are too small, infinite for features that say nothing.
        slack_px: How far a feature is from there.
        sd_floor_px: Smallest standard deviation of what a feature says.

    Raises:
        TypeError: One is not an array of real numbers.
        ValueError: There are not as many of one as of the others.
    """
    check(
        missing=True,
        positions=(positions, "F N 2"),
        weights=(weights, "F N"),
        expected=(expected, "F 2"),
        doubts=(doubts, "F"),
    )
    at, where = np.ascontiguousarray(positions), np.ascontiguousarray(expected)
    return _agreeing(at, weights, where, doubts, float(slack_px), float(sd_floor_px))


def middle(values: Floats) -> Floats:
    """Return the median (...,) of finite values (n, ...) along the first axis; NumPy's takes ten times as long."""
    ordered, half = np.sort(values, axis=0), len(values) // 2
    found: Floats = ordered[half] if len(values) % 2 else 0.5 * (ordered[half - 1] + ordered[half])
    return found


@compiled
def _agreeing(
    positions: Floats,
    weights: Floats,
    expected: Floats,
    doubts: Floats,
    slack: float,
    sd_floor: float,
) -> tuple[Floats, Floats]:
    features, count, _ = positions.shape
    means, variances, shares = np.empty((features, 2)), np.empty((features, 2)), np.empty(count)
    for n in range(features):
        agreement = 0.0
        for i in range(count):
            across, down = positions[n, i, 0] - expected[n, 0], positions[n, i, 1] - expected[n, 1]
            near = 1.0 + (across * across + down * down) / (FREEDOM * slack * slack)
            shares[i] = weights[n, i] / (near * near)
            agreement += shares[i]
        for axis in range(2):
            mean, spread = 0.0, 0.0
            for i in range(count):
                mean += shares[i] * positions[n, i, axis] / agreement
            for i in range(count):
                spread += shares[i] * (positions[n, i, axis] - mean) ** 2 / agreement
            means[n, axis] = mean
            known = max(spread, sd_floor * sd_floor) / max(agreement, LEAST_AGREEMENT)
            variances[n, axis] = known * doubts[n] if np.isfinite(doubts[n]) else NOTHING_KNOWN_PX2
    return means, variances
