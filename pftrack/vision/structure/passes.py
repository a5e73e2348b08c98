"""The passes of variational Bayes, compiled: beliefs in the shape given the motion, and in the motion given the shape.

The model (Bando 2007, ch. 4 section 5.2): position d of point n is theta_d . (s_n; 1) + noise of
variance sigma_dn^2, s_n ~ N(0, I), theta_d ~ N(e_d, I / gamma). The posterior is taken as a product of beliefs in each
point, N(shat_n, Sig_n), and in each row of the motion, N(thhat_d, Vd^-1). Each is found given the moments of the other:

- `posterior_points`: Sig_n^-1 = I + sum_d sigma^-2 (Vd^-1 + thhat thhat^T)_ss, in the form that inverts 3 x 3 only;
- `posterior_rows`: Vd = gamma I + sum_n sigma^-2 G_n, G_n the second moment of (s_n; 1);
- `free_energy`: the bound on the log evidence that both raise, corrected (docs/methods/heads.md).

A precision of 0 says that a point was not seen: it adds nothing to any of the three.
"""

from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.vision.structure.factorization import invert

Seen: TypeAlias = tuple[Floats, Floats]
"""Rows (D, n) of positions, and their precisions, (D, n) inverse variances."""

Belief: TypeAlias = tuple[Floats, Floats]
"""Means and covariances: (n, 3) and (n, 3, 3) of a shape's points, or (D, 4) and (D, 4, 4) of a motion's rows."""


@compiled
def posterior_points(seen: Seen, motion: Belief) -> Belief:
    """Return the belief in the points: the E step.

    Args:
        seen: Positions and precisions.
        motion: The belief in the rows.
    """
    (rows, precisions), (thetas, spreads) = seen, motion
    count = rows.shape[1]
    means, covariances = np.empty((count, 3)), np.empty((count, 3, 3))
    precision, information = np.empty((3, 3)), np.empty(3)
    for n in range(count):
        for i in range(3):
            information[i] = 0.0
            for j in range(i + 1):
                precision[i, j] = 1.0 if i == j else 0.0
        for d in range(rows.shape[0]):
            weight = precisions[d, n]
            rest = rows[d, n] - thetas[d, 3]
            for i in range(3):
                information[i] += weight * (rest * thetas[d, i] - spreads[d, i, 3])
                for j in range(i + 1):
                    precision[i, j] += weight * (thetas[d, i] * thetas[d, j] + spreads[d, i, j])
        invert(precision, covariances[n])
        for i in range(3):
            means[n, i] = 0.0
            for j in range(3):
                means[n, i] += covariances[n, i, j] * information[j]
    return means, covariances


@compiled
def moments(means: Floats, covariances: Floats) -> Floats:
    """Return G (n, 4, 4), the second moments of (s; 1)."""
    count = means.shape[0]
    result = np.empty((count, 4, 4))
    for n in range(count):
        result[n, 3, 3] = 1.0
        for i in range(3):
            result[n, i, 3] = result[n, 3, i] = means[n, i]
            for j in range(3):
                result[n, i, j] = means[n, i] * means[n, j] + covariances[n, i, j]
    return result


@compiled
def posterior_rows(seen: Seen, second: Floats, gamma: float, first: int) -> tuple[Belief, Floats]:
    """Return the belief in the rows of motion, and log det Vd (D,): the M step.

    Args:
        seen: Positions and precisions.
        second: (n, 4, 4) second moments of (s; 1).
        gamma: Precision of the prior of the motion.
        first: Number of the first row, counted from the beginning of the tracks: the first four have a prior mean.
    """
    rows, precisions = seen
    height, count = rows.shape
    means, covariances, log_determinants = np.empty((height, 4)), np.empty((height, 4, 4)), np.empty(height)
    precision, information = np.empty((4, 4)), np.empty(4)
    for d in range(height):
        for i in range(4):
            information[i] = gamma if first + d == i else 0.0
            for j in range(i + 1):
                precision[i, j] = gamma if i == j else 0.0
        for n in range(count):
            weight = precisions[d, n]
            for i in range(4):
                information[i] += weight * rows[d, n] * second[n, i, 3]
                for j in range(i + 1):
                    precision[i, j] += weight * second[n, i, j]
        log_determinants[d] = invert(precision, covariances[d])
        for i in range(4):
            means[d, i] = 0.0
            for j in range(4):
                means[d, i] += covariances[d, i, j] * information[j]
    return (means, covariances), log_determinants


@compiled
def free_energy(seen: Seen, shape: Belief, motion: Belief, log_determinants: Floats, gamma: float, first: int) -> float:
    """Return F, the lower bound on the log density of the positions that were seen (Bando 2007, fig. 4.19, corrected).

    Args:
        seen: Positions and precisions.
        shape: The belief in the points.
        motion: The belief in the rows.
        log_determinants: (D,) log det Vd of the rows' precisions.
        gamma: Precision of the prior of the motion.
        first: Number of the first row.
    """
    (rows, precisions), (thetas, motion_covariances), (means, shape_covariances) = seen, motion, shape
    height, count = rows.shape
    second = moments(means, shape_covariances)
    scratch = np.empty((3, 3))
    energy = 0.0
    for n in range(count):
        # Prior and entropy of the point.
        energy += 1.5 + 0.5 * invert(shape_covariances[n], scratch)
        for i in range(3):
            energy -= 0.5 * second[n, i, i]
        for d in range(height):
            if precisions[d, n] > 0.0:
                square = _expected_square(rows[d, n], thetas[d], motion_covariances[d], second[n], shape_covariances[n])
                energy -= 0.5 * (np.log(2.0 * np.pi) - np.log(precisions[d, n]) + precisions[d, n] * square)
    for d in range(height):
        energy += 0.5 * (4.0 * (1.0 + np.log(gamma)) - log_determinants[d])
        for i in range(4):
            offset = thetas[d, i] - (1.0 if first + d == i else 0.0)
            energy -= 0.5 * gamma * (offset * offset + motion_covariances[d, i, i])
    return energy


@compiled
def _expected_square(
    position: float, motion: Floats, motion_covariance: Floats, second: Floats, shape_covariance: Floats
) -> float:
    """Return the expected square of a position less theta . (s; 1), given moments of theta and of s."""
    apart = position
    square = 0.0
    for i in range(4):
        apart -= motion[i] * second[i, 3]
        for j in range(4):
            square += motion_covariance[i, j] * second[i, j]
    for i in range(3):
        for j in range(3):
            square += motion[i] * motion[j] * shape_covariance[i, j]
    return square + apart * apart
