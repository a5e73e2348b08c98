"""A particle filter of a chain, with the bounds that the Kalman filters have.

What is seen is exact to a pixel or so and determines half of the coordinates, so that particles drawn from the motion
alone would almost all miss it. Each is therefore drawn from its own motion *and* the observation, which is linearised
at a point of its own, and its weight corrects exactly for what the linearisation has left out (Doucet, Godsill and
Andrieu 2000, section II.D). With x ~ N(m, G G'), h linearised at u with the slope C, and y = h(x) + v, v ~ N(0, W):

    x = m + G e,  e = e' + (C G)' S^-1 (y - h(u) - C (m - u) - C G e' - v'),  S = C G (C G)' + W,

with e' and v' drawn, is a draw of the linearised posterior, and its weight is
p(y | x) / p_lin(y | x) N(y; h(u) + C (m - u), S). A bound is a factor of 0 or 1: a particle beyond one has no weight.

Lengths never change, so that particles that are only chosen among soon have all the same ones. Liu and West (2001):
particles are drawn towards their mean and stirred by a kernel, so that mean and covariance stay as they are.

A belief that is no set of particles, at the start or after another tracker, is drawn from as the Gaussians that it is,
each particle linearised at a draw of its own. Such a belief may be so wide that hardly any particle is left by what is
seen. The observation is then taken in portions, each as one of a larger variance whose precisions sum to that of the
whole, with a stir after each (Musso, Oudjane and Le Gland 2001).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.geometry.linkage import LINKS
from pftrack.geometry.rotation_vector import compose, quaternion, vector
from pftrack.numerics.compiled import compiled
from pftrack.numerics.matrices import factorise, multiply, substitute
from pftrack.trackers.linkage.chain import PLANE_STATES, observe, slopes

__all__ = ["forbid", "in_reference", "move", "propose"]


@compiled
def move(states: NDArray[np.float64], mean: NDArray[np.float64], keeping: float, moving: bool) -> NDArray[np.float64]:
    """Return particles (N, n) drawn towards their mean and then, without noise, a frame later.

    Args:
        states: (N, n); in space with omega relative to the reference attitude.
        mean: (n,) of them.
        keeping: How much of its distance from the mean each keeps, 0..1.
        moving: Whether a frame passes.
    """
    count, size = states.shape
    half = (size - LINKS) // 2
    following = np.empty((count, size))
    for n in range(count):
        for i in range(size):
            following[n, i] = mean[i] + keeping * (states[n, i] - mean[i])
        if not moving:
            continue
        omega = following[n, :LINKS].copy()
        for i in range(half):
            following[n, i] += following[n, half + i]
        if size != PLANE_STATES:
            turn = following[n, half : half + LINKS]
            following[n, :LINKS] = vector(compose(quaternion(omega), quaternion(turn)))
    return following


@compiled
def propose(
    centres: NDArray[np.float64],
    points: NDArray[np.float64],
    root: NDArray[np.float64],
    attitude: NDArray[np.float64],
    seen: NDArray[np.float64],
    variance: float,
    normals: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Draw particles from their motion and an observation.

    Args:
        centres: (N, n), m of each.
        points: (N, n), where the observation of each is linearised.
        root: (n, n), G, lower triangular.
        attitude: (4,) reference attitude.
        seen: (m,) observation, px, NaN where a coordinate was not seen.
        variance: Of each coordinate, px^2.
        normals: (N, n + m) numbers N(0, 1).

    Returns:
        Particles (N, n), logarithms of their weights (N,), and how far the observation was from what each predicted,
        (N,) standard deviations.
    """
    count, size = centres.shape
    rows = np.flatnonzero(~np.isnan(seen))
    drawn = centres.copy()
    log_weights, distances = np.zeros(count), np.zeros(count)
    for n in range(count):
        steps = normals[n, :size].copy()
        if rows.shape[0] > 0:
            slope = slopes(points[n], attitude)[rows]
            rest = seen[rows] - observe(points[n], attitude)[rows]
            for i in range(rows.shape[0]):
                for j in range(size):
                    rest[i] -= slope[i, j] * (centres[n, j] - points[n, j])
            reached = multiply(slope, root)
            log_weights[n], distances[n] = _condition(steps, reached, rest, variance, normals[n, size:])
        for i in range(size):
            for j in range(i + 1):
                drawn[n, i] += root[i, j] * steps[j]
        if rows.shape[0] > 0:
            exact = seen[rows] - observe(drawn[n], attitude)[rows]
            for i in range(rows.shape[0]):
                linear = rest[i]
                for j in range(size):
                    linear -= reached[i, j] * steps[j]
                log_weights[n] += 0.5 * (linear * linear - exact[i] * exact[i]) / variance
    return drawn, log_weights, distances


@compiled
def _condition(
    steps: NDArray[np.float64],
    reached: NDArray[np.float64],
    rest: NDArray[np.float64],
    variance: float,
    normals: NDArray[np.float64],
) -> tuple[float, float]:
    """Turn a draw (n,) of N(0, I) into one of its posterior given C e + v = rest, in place.

    Args:
        steps: (n,), e' before and e after.
        reached: C, (m, n).
        rest: (m,).
        variance: Of v.
        normals: (m,) or more, N(0, 1), of which v' is made.

    Returns:
        log N(rest; 0, S) without its power of 2 pi, and the distance of the rest from 0 in standard deviations.
    """
    count, size = reached.shape
    deviation = np.sqrt(variance)
    lower, _ = factorise(multiply(reached, reached.T.copy()) + variance * np.eye(count))
    both = np.empty((count, 2))
    for i in range(count):
        both[i, 0] = rest[i]
        both[i, 1] = rest[i] - deviation * normals[i]
        for j in range(size):
            both[i, 1] -= reached[i, j] * steps[j]
    whitened = substitute(lower, both)
    log_density, square = 0.0, 0.0
    # e = e' + C' L^-T L^-1 (...), with S = L L'.
    for i in range(count - 1, -1, -1):
        square += whitened[i, 0] * whitened[i, 0]
        log_density -= np.log(lower[i, i])
        for k in range(i + 1, count):
            whitened[i, 1] -= lower[k, i] * whitened[k, 1]
        whitened[i, 1] /= lower[i, i]
        for j in range(size):
            steps[j] += reached[i, j] * whitened[i, 1]
    return log_density - 0.5 * square, np.sqrt(square)


@compiled
def forbid(
    log_weights: NDArray[np.float64],
    states: NDArray[np.float64],
    rows: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> int:
    """Take all weight off particles (N, n) that break lo <= A x <= hi, in place, and return how many do."""
    count, size = states.shape
    broken = 0
    for n in range(count):
        allowed = True
        for k in range(rows.shape[0]):
            value = 0.0
            for j in range(size):
                value += rows[k, j] * states[n, j]
            allowed = allowed and low[k] <= value <= high[k]
        if not allowed:
            log_weights[n] = -np.inf
            broken += 1
    return broken


@compiled
def in_reference(
    states: NDArray[np.float64], attitude: NDArray[np.float64], reference: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return particles (N, n) with omega relative to the reference attitude (4,) instead of another one (4,)."""
    following = states.copy()
    if states.shape[1] != PLANE_STATES:
        inverse = np.array([reference[0], -reference[1], -reference[2], -reference[3]])
        between = compose(inverse, attitude)
        for n in range(states.shape[0]):
            following[n, :LINKS] = vector(compose(between, quaternion(states[n, :LINKS])))
    return following
