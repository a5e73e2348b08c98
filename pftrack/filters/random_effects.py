"""How sure a fit is whose measurements have errors that nobody told it: random effects by Paule and Mandel.

A model of p unknowns is fitted to m measured numbers. Each comes with a variance v_i of its own, but there is more
error in it than that: the model's camera is too simple, its shape is not quite the object's, what is measured has
slipped. None of this is noise that averages out over frames, so no filter that is told v_i alone can know of it. It
shows nevertheless, in that the numbers do not fit together as well as v_i says.

Let the unknown part have one variance tau^2 for all numbers, as between laboratories that measure the same quantity.
With weights w_i = 1 / (v_i + tau^2) the residuals e of the fit obey

    E[ sum_i w_i e_i^2 ] = m - p,

and tau^2 is the number for which the sum is just that, or 0 if it is smaller already (R. Paule and J. Mandel 1982; for
regressions R. DerSimonian and R. Kacker 2007). The sum is convex and falls with tau^2, and its slope is
-sum_i w_i^2 e_i^2, since the fit minimises it: Newton's method from 0 approaches the root from one side.

Measurements of what may not be there at all, each said with probability s_i, are expected to add sum_i s_i in place of
m: one that is surely missing has a huge v_i, adds nothing to the sum, and may not be counted as one that fits.

What a fit with other weights u comes to has then the covariance G diag(v + tau^2) G^T, G = (J^T U J)^-1 J^T U.

The limit of this: an error that looks like a change of the unknowns leaves no residual, and is seen by nobody.
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve

__all__ = ["excess_variance", "fit_covariance", "fit_gain"]

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
