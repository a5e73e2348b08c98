"""Features that do not agree with the solid that carries them: misplaced, or less exact than their variances.

- `agreeing`: an upper layer uses only the features that agree with it;
- `excess_variance`: the uncertainty of a fit whose measurements have unknown additional errors.
"""

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve

# The mean of a feature's particles is its place only if the feature is where the template fits best. A template that
# has slipped onto a cheek is confident and wrong. One such feature pulls the whole solid, which then predicts all other
# features wrongly. Here the distance between a feature and the solid's prediction has a t distribution with long tails,
# whose scale is a given slack. Each particle is weighed by that density, too. The mean of the remaining weight is the
# feature's measurement, and its variance grows as the remaining weight shrinks. The solid is then estimated again, and
# the weighing is repeated: this is iterated reweighting, which fits t-distributed errors (Lange, Little & Taylor,
# Journal of the American Statistical Association 84, 1989).

ROUNDS = 3
"""Estimates of the solid, each from the features as the last one weighs them."""

FREEDOM = 2.0
"""Degrees of freedom of the tails."""

LEAST_AGREEMENT = 1e-3
"""Least agreement that a feature is given."""

NOTHING_KNOWN_PX2 = 1e8
"""Variance of a feature without any evidence in the picture."""


def agreeing(
    positions: Floats,
    weights: Floats,
    expected: Floats,
    doubts: Floats,
    slack_px: float,
    sd_floor_px: float,
) -> tuple[Floats, Floats]:
    """Return the means (F, 2) px and variances (F, 2) px^2 of features as far as they agree with a solid.

    Args:
        positions: (F, N, 2) px of particles.
        weights: (F, N), normalised by feature.
        expected: (F, 2) px, where the solid has the features.
        doubts: (F,) factor by which the variances are too small; infinite for features without evidence.
        slack_px: Scale of a feature's distance from there.
        sd_floor_px: Smallest standard deviation of a feature's measurement.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: The arrays differ in length.
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
# A model of p unknowns is fitted to m measured numbers. Each comes with a variance v_i of its own, but its error is
# larger: the model's camera is too simple, its shape differs from the object's, or the measured feature has slipped.
# Such errors do not average out over frames, so a filter that has only v_i cannot account for them. They still show:
# the measurements fit together less well than v_i predicts.
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
# Where a measurement exists only with probability s_i, the expected sum is sum_i s_i instead of m: a measurement that
# is certainly missing has a huge v_i, adds nothing to the sum, and must not count as one that fits.
#
# A fit with other weights u then has the covariance G diag(v + tau^2) G^T, G = (J^T U J)^-1 J^T U.
#
# The method has a limit: an error that looks like a change of the unknowns leaves no residual, so it cannot be
# detected.

MOST_ROUNDS = 60
CLOSE = 1e-6
"""Relative difference of the sum from its expected value at which Newton's method ends."""


@compiled
def fit_gain(jacobian: Floats, weights: Floats) -> tuple[Floats, bool]:
    """Return G, (p, m), from measurements to the unknowns of a weighted fit, and whether these are determined.

    Args:
        jacobian: (m, p).
        weights: (m,).

    Raises:
        ValueError: The number of weights differs from that of the rows.
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
    """Return tau^2, the variance of measurements beyond their own; 0 if there is none, NaN if it cannot be estimated.

    Args:
        residuals: (m,) measured less expected at any point near the fit.
        jacobian: (m, p) derivatives of the predicted measurements.
        variances: (m,) known variance of each measurement, above 0.
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
        ValueError: The number of variances differs from that of the columns.
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
