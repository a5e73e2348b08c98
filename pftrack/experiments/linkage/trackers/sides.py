"""The sides on which a chain of given lengths may lean, by what is seen of it.

The prediction is linearised at itself and at its mirror images (`linearisation_points`), each iterated to the pose of
greatest posterior density (Gauss and Newton's method; Bell and Cathey 1993). With x the pose found from the prediction
N(m, M), C the slopes there, S = C M C' + W I, and e the innovation, the evidence of a side is that of Laplace's method,
(x - m)' M^-1 (x - m) being e' S^-1 e - W |S^-1 e|^2:

    log p(y) = -1/2 ((x - m)' M^-1 (x - m) + |y - h(x)|^2 / W + log |S|) + const.

A side is drawn by this evidence and by what its Gaussian has within the bounds of joints, and stands for all of them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.shape import LINKS, Constraints
from pftrack.experiments.linkage.trackers.chain import PLANE_STATES
from pftrack.experiments.linkage.trackers.linearised import linearisation_points
from pftrack.experiments.linkage.trackers.observation import log_image_lengths, project, project_slopes
from pftrack.filters.truncation import log_share

__all__ = ["see"]

ALMOST_PARALLEL, MOST_PARALLEL = 0.35, 0.95
"""Sine below which a link may lean to either side: the first where its direction is known, and at most the second."""
PARALLEL_SDS = 2.0
"""What is added to the first, in standard deviations of a direction."""
ROUNDS = 4
CLOSE = 0.2
"""What linearisation leaves out of what is seen, in standard deviations of the noise, below which it is good enough."""
APART = 1.5
"""Standard deviations between two sides below which they are one."""


class Work(NamedTuple):
    """What is computed of a linearised observation of m coordinates.

    Attributes:
        rest: (m,) innovation, e.
        left: (m,) what the linearised observation leaves of it at the pose that was found.
        exact: (m,) what the exact one does.
        cross: (m, f + 1) L^-1 of C M and of e.
        total: (m, m) L, of which the lower half is used.
    """

    rest: NDArray[np.float64]
    left: NDArray[np.float64]
    exact: NDArray[np.float64]
    cross: NDArray[np.float64]
    total: NDArray[np.float64]


@compiled
def see(
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    attitude: NDArray[np.float64],
    variance: float,
    bounds: Constraints,
    seen: NDArray[np.float64],
    rows: NDArray[np.int64],
    chance: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
    """Draw a side, given an observation.

    Args:
        mean: (n,) of the prediction, lengths included.
        covariance: (n, n) of the same, with zeros for lengths.
        attitude: (4,) that omega is relative to.
        variance: Of an observed coordinate, px^2.
        bounds: On joints.
        seen: (m, 3) observation, see `observation`.
        rows: Rows of it that were seen.
        chance: Uniform number by which a side is drawn.

    Returns:
        Mean (n,) and covariance (n, n) of the side, log p(y) without its power of 2 pi, and the distance of y from the
        nearest side, standard deviations.
    """
    size, count = mean.shape[0], rows.shape[0]
    free = size - LINKS  # lengths are known
    points = linearisation_points(mean, attitude, _parallel(covariance))
    sides = points.shape[0]
    found, spreads = np.empty((sides, size)), np.empty((sides, size, size))
    evidences, weights = np.full(sides, -np.inf), np.full(sides, -np.inf)
    work = Work(
        np.empty(count), np.empty(count), np.empty(count), np.empty((count, free + 1)), np.empty((count, count))
    )
    nearest = np.inf
    for side in range(sides):
        found[side] = _settle(work, mean, covariance, attitude, points[side].copy(), variance, seen, rows)
        square, log_root = 0.0, 0.0
        spreads[side] = covariance
        for i in range(count):
            # e' S^-1 e less what the linearised observation leaves unexplained, and what the exact one does instead.
            square += work.cross[i, free] * work.cross[i, free]
            square += (work.exact[i] * work.exact[i] - work.left[i] * work.left[i]) / variance
            log_root += np.log(work.total[i, i])
            for j in range(free):
                factor = work.cross[i, j]
                for k in range(free):
                    spreads[side, j, k] -= factor * work.cross[i, k]
        nearest = min(nearest, np.sqrt(max(square, 0.0)))
        if side == 0 or not _is_known(found, spreads, side):
            evidences[side] = -0.5 * square - log_root + log_image_lengths(found[side], attitude, seen)
            weights[side] = evidences[side]
            if sides > 1:
                weights[side] += log_share(found[side], spreads[side], bounds.rows, bounds.low, bounds.high)
    top = weights.max()
    if not top > -np.inf:
        return mean, covariance, -np.inf, nearest
    shares = np.cumsum(np.exp(weights - top))
    drawn = min(np.searchsorted(shares, chance * shares[-1], side="right"), sides - 1)
    # Sides are drawn by their evidence and the bounds; the bounds are counted by whoever calls.
    gained = top + np.log(shares[-1]) - weights[drawn] + evidences[drawn]
    return found[drawn].copy(), spreads[drawn].copy(), gained, nearest


@compiled
def _settle(
    work: Work,
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    attitude: NDArray[np.float64],
    point: NDArray[np.float64],
    variance: float,
    seen: NDArray[np.float64],
    rows: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the pose (n,) of greatest posterior density, from a point on; the work is that of the last round."""
    count, free = work.rest.shape[0], work.cross.shape[1] - 1
    half = free // 2  # velocities are not seen
    for _ in range(ROUNDS):
        slope, shown = project_slopes(point, attitude, seen), project(point, attitude, seen)
        _linearise(work, slope, shown, mean, covariance, point, variance, seen, rows)
        _whiten(work.total, work.cross)
        point = mean.copy()
        for i in range(count):
            for j in range(free):
                point[j] += work.cross[i, j] * work.cross[i, free]
        shown, bent = project(point, attitude, seen), 0.0
        for i in range(count):
            work.left[i] = work.rest[i]
            for j in range(half):
                work.left[i] -= slope[rows[i], j] * (point[j] - mean[j])
            work.exact[i] = seen[rows[i], 0] - shown[rows[i]]
            bent = max(bent, abs(work.exact[i] - work.left[i]))
        if bent < CLOSE * np.sqrt(variance):
            break
    return point


@compiled
def _linearise(
    work: Work,
    slope: NDArray[np.float64],
    shown: NDArray[np.float64],
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    point: NDArray[np.float64],
    variance: float,
    seen: NDArray[np.float64],
    rows: NDArray[np.int64],
) -> None:
    """Write the innovation, C M and S down, of an observation that is linearised at a point (n,)."""
    count, free = work.rest.shape[0], work.cross.shape[1] - 1
    half = free // 2
    for i in range(count):
        row = rows[i]
        work.rest[i] = seen[row, 0] - shown[row]
        work.cross[i, :free] = 0.0
        for k in range(half):
            factor = slope[row, k]
            work.rest[i] -= factor * (mean[k] - point[k])
            for j in range(free):
                work.cross[i, j] += factor * covariance[k, j]
        work.cross[i, free] = work.rest[i]
    for i in range(count):
        for k in range(i + 1):
            value = variance if i == k else 0.0
            for j in range(half):
                value += work.cross[i, j] * slope[rows[k], j]
            work.total[i, k] = value


@compiled
def _whiten(total: NDArray[np.float64], wanted: NDArray[np.float64]) -> None:
    """Replace S (m, m), of which the lower half is used, by L of L L' = S, and B (m, k) by L^-1 B."""
    count, columns = wanted.shape
    for j in range(count):
        for i in range(j, count):
            value = total[i, j]
            for k in range(j):
                value -= total[i, k] * total[j, k]
            total[i, j] = np.sqrt(value) if i == j else value / total[j, j]
        for k in range(j):
            factor = total[j, k]
            for i in range(columns):
                wanted[j, i] -= factor * wanted[k, i]
        for i in range(columns):
            wanted[j, i] /= total[j, j]


@compiled
def _parallel(covariance: NDArray[np.float64]) -> float:
    """Return the sine below which a link may lean to either side, given how well its direction is known."""
    size = covariance.shape[0]
    widest = 0.0
    if size == PLANE_STATES:
        for i in range(LINKS):
            variance = 0.0
            for j in range(i + 1):
                for k in range(i + 1):
                    variance += covariance[j, k]
            widest = max(widest, variance)
    else:
        for i in range(LINKS):
            widest = max(widest, covariance[i, i])
    return float(min(ALMOST_PARALLEL + PARALLEL_SDS * np.sqrt(widest), MOST_PARALLEL))


@compiled
def _is_known(found: NDArray[np.float64], spreads: NDArray[np.float64], side: int) -> bool:
    """Whether a side is one of those before it, as far as their Gaussians can tell."""
    size = found.shape[1]
    for other in range(side):
        square, along = 0.0, 0.0
        for i in range(size):
            off = found[side, i] - found[other, i]
            square += off * off
            for j in range(size):
                along += off * spreads[other, i, j] * (found[side, j] - found[other, j])
        if square * square <= APART * APART * along or square < 1e-12:
            return True
    return False
