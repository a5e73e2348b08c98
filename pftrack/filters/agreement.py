"""Features that do not agree with the solid that carries them: elsewhere, or less exact than they say.

- `agreeing`: an upper layer listens to those features that agree with it;
- `excess_variance`: how sure a fit is whose measurements have errors that nobody told it.
"""

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve

# The mean of a feature's particles is its place only if the feature is where the template fits best. A template that
# has slipped onto a cheek is sure of itself and wrong, and one such feature pulls the whole solid, which is then wrong
# about all others. Here a feature is within some slack of where the solid has it, with the long tails of a t
# distribution. So each particle is weighed by that too, and what a feature says is the mean of what is left, believed
# the less the less is left. The solid is then estimated again, and the weighing repeated: the iterated reweighting by
# which t-distributed errors are fitted (Lange, Little & Taylor, Journal of the American Statistical Association 84,
# 1989).

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


# Random effects by Paule and Mandel.
#
# A model of p unknowns is fitted to m measured numbers. Each comes with a variance v_i of its own, but there is more
# error in it than that: the model's camera is too simple, its shape is not quite the object's, what is measured has
# slipped. None of this is noise that averages out over frames, so no filter that is told v_i alone can know of it. It
# shows nevertheless, in that the numbers do not fit together as well as v_i says.
#
# Let the unknown part have one variance tau^2 for all numbers, as between laboratories that measure the same quantity.
# With weights w_i = 1 / (v_i + tau^2) the residuals e of the fit obey
#
#     E[ sum_i w_i e_i^2 ] = m - p,
#
# and tau^2 is the number for which the sum is just that, or 0 if it is smaller already (R. Paule and J. Mandel 1982;
# for regressions R. DerSimonian and R. Kacker 2007). The sum is convex and falls with tau^2, and its slope is -sum_i
# w_i^2 e_i^2, since the fit minimises it: Newton's method from 0 approaches the root from one side.
#
# Measurements of what may not be there at all, each said with probability s_i, are expected to add sum_i s_i in place
# of m: one that is surely missing has a huge v_i, adds nothing to the sum, and may not be counted as one that fits.
#
# What a fit with other weights u comes to has then the covariance G diag(v + tau^2) G^T, G = (J^T U J)^-1 J^T U.
#
# The limit of this: an error that looks like a change of the unknowns leaves no residual, and is seen by nobody.

MOST_ROUNDS = 60
CLOSE = 1e-6
"""Of the sum to what is expected, relative: where Newton's method ends."""


@compiled
def fit_gain(jacobian: Floats, weights: Floats) -> tuple[Floats, bool]:
    """Return G, (p, m), from measurements to the unknowns of a weighted fit, and whether these are determined.

    Args:
        jacobian: (m, p).
        weights: (m,).

    Raises:
        ValueError: There are not as many weights as rows.
    """
    if weights.shape[0] != jacobian.shape[0]:
        raise ValueError("expected weights (m,) for a slope (m, p), got another number")
    weighted = jacobian.T.copy()
    for k in range(weighted.shape[0]):
        for i in range(weighted.shape[1]):
            weighted[k, i] *= weights[i]
    return solve(multiply(weighted, jacobian), weighted)


@compiled
def excess_variance(
    residuals: Floats,
    jacobian: Floats,
    variances: Floats,
    shown: Floats,
) -> float:
    """Return tau^2, the variance that measurements have beyond their own; 0 if none shows, NaN if none can be told.

    Args:
        residuals: (m,) measured less expected at any point near the fit.
        jacobian: (m, p) derivatives of what is expected.
        variances: (m,) of each measurement as it is known, above 0.
        shown: (m,) how likely each is a measurement at all, 0..1.

    Raises:
        ValueError: The sizes do not agree.
    """
    count, unknowns = jacobian.shape
    if residuals.shape[0] != count or variances.shape[0] != count or shown.shape[0] != count:
        raise ValueError("expected residuals, variances and shares (m,) for a slope (m, p), got other sizes")
    freedom = -float(unknowns)
    for i in range(count):
        freedom += shown[i]
    excess = 0.0
    for _ in range(MOST_ROUNDS):
        weights = 1.0 / (variances + excess)
        gain, regular = fit_gain(jacobian, weights)
        if freedom < 1.0 or not regular:
            return np.nan
        found = multiply(gain, residuals.copy().reshape(count, 1))
        fitted = multiply(jacobian, found)
        squares, slope = 0.0, 0.0
        for i in range(count):
            square = weights[i] * (residuals[i] - fitted[i, 0]) ** 2
            squares += square
            slope += weights[i] * square
        surplus = squares - freedom
        if not surplus > CLOSE * freedom:
            break
        excess += surplus / slope
    return excess


@compiled
def fit_covariance(gain: Floats, variances: Floats) -> Floats:
    """Return the covariance (p, p) of a fit by its gain (p, m), to numbers that have these variances (m,) in truth.

    Raises:
        ValueError: There are not as many variances as columns.
    """
    if variances.shape[0] != gain.shape[1]:
        raise ValueError("expected variances (m,) for a gain (p, m), got another number")
    scaled = gain.copy()
    for k in range(gain.shape[0]):
        for i in range(gain.shape[1]):
            scaled[k, i] *= variances[i]
    spread = multiply(scaled, gain.T.copy())
    for k in range(spread.shape[0]):
        for i in range(k):
            spread[k, i] = 0.5 * (spread[k, i] + spread[i, k])
            spread[i, k] = spread[k, i]
    return spread
