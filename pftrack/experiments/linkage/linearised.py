"""Extended Kalman filters of a chain, one for each side on which its links may lie, in compiled form.

Where a link is almost parallel to the image, a filter that is linearised at its prediction takes one side for granted:
the derivative by that link's angle is small and has the sign of the predicted side. So the same prediction is
linearised at its mirror images as well, and each of them gives a candidate. Constraints cut each candidate; one that
lies far beyond them is refuted, and the others are scored by their correction and by their residual.

In the plane every link has a mirror image that looks the same. In space the chain is flat. The whole chain's mirror
image looks almost the same when its plane is almost parallel to the image; the mirror image of the second or third link
within the plane does when the plane is seen almost edge-on and the link is almost parallel to the image.

Source: Shimada 1997, sections 4.2 to 4.6; the mirror images in space are our own.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import compose, matrix_quaternion, quaternion, quaternion_matrix, vector
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import factorise, multiply, substitute
from pftrack.experiments.linkage import model
from pftrack.filters.kalman import condition_on_innovation
from pftrack.filters.truncation import least_room, log_share, truncate

MOST_POINTS = 8

SCORE_MEMORY = 0.7
"""Share of its score that a hypothesis keeps per frame."""


class Filtering(NamedTuple):
    """Settings of a step of these filters.

    Attributes:
        seen: (m, 3) observation, see `observation`.
        variance: Variance of each coordinate, px^2.
        noise: (p,) standard deviations of the accelerations of the pose.
        rows: (k, n) constraints lo <= A x <= hi.
        low: (k,).
        high: (k,).
        constrained: Whether they are used.
        mirrors: Sine below which a link is almost parallel to the image; negative to have no mirror images.
        rejection: Standard deviations beyond a bound that refute a candidate; used only with mirror images.
        rounds: Number of linearisations of an observation: first at the point, then at the last result.
    """

    seen: Floats
    variance: float
    noise: Floats
    rows: Floats
    low: Floats
    high: Floats
    constrained: bool
    mirrors: float
    rejection: float
    rounds: int


class Candidates(NamedTuple):
    """Candidates after a frame; the first K are the predictions of the K members, without observation.

    Attributes:
        means: (N, n).
        covariances: (N, n, n).
        attitudes: (N, 4).
        scores: (N,); -inf of a candidate that is refuted.
        parents: (N,) index of the member that each comes from.
        log_evidences: (N,) log density of the observation as each had predicted it.
        distances: (N,) of the observation from that, in standard deviations.
        cuts: (N,) bounds that took something off.
        poses: (N, 6) directions and lengths.
    """

    means: Floats
    covariances: Floats
    attitudes: Floats
    scores: Floats
    parents: Ints
    log_evidences: Floats
    distances: Floats
    cuts: Ints
    poses: Floats


@compiled
def predict(mean: Floats, covariance: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Return mean (n,) and covariance (n, n) a frame later: constant velocity, white acceleration (4.3, 4.13, 4.16).

    Args:
        mean: (n,).
        covariance: (n, n).
        noise: (p,) standard deviations of the accelerations.
    """
    count = noise.shape[0]
    size = mean.shape[0]
    following, spread = mean.copy(), covariance.copy()
    for i in range(count):
        following[i] += following[count + i]
        for j in range(size):
            spread[i, j] += spread[count + i, j]
    for i in range(count):
        for j in range(size):
            spread[j, i] += spread[j, count + i]
    for i in range(count):
        variance = noise[i] * noise[i]
        spread[i, i] += 0.25 * variance
        spread[i, count + i] += 0.5 * variance
        spread[count + i, i] += 0.5 * variance
        spread[count + i, count + i] += variance
    return following, spread


@compiled
def linearisation_points(state: Floats, attitude: Floats, limit: float) -> Floats:
    """Return the states (1..8, n) at which a prediction is linearised: itself, and its mirror images.

    Args:
        state: (n,).
        attitude: (4,).
        limit: Sine below which something counts as parallel.
    """
    points = np.empty((MOST_POINTS, state.shape[0]))
    points[0] = state
    count = 1
    if state.shape[0] == model.PLANE_STATES:
        absolute = model.directions(state)
        for link in range(model.LINKS):
            if abs(np.sin(absolute[link])) < limit:
                for k in range(count):
                    points[count + k] = points[k]
                    points[count + k, : model.LINKS] = model.joint_angles(
                        model.mirror(model.directions(points[k]), link)
                    )
                count *= 2
        return points[:count].copy()
    turn = quaternion_matrix(compose(attitude, quaternion(state[: model.LINKS])))
    tilt = np.sqrt(turn[2, 0] * turn[2, 0] + turn[2, 1] * turn[2, 1])
    if abs(turn[2, 2]) < limit:
        # The direction within the plane of the chain that is parallel to the image, and where it is 0 on the way there.
        level = np.arctan2(-turn[2, 0], turn[2, 1])
        absolute = model.directions(model.joints(state))
        for link in range(1, model.LINKS):
            if tilt * abs(np.sin(absolute[link] - level)) < limit:
                for k in range(count):
                    points[count + k] = points[k]
                    other = model.mirror(model.directions(model.joints(points[k])) - level, link)
                    points[count + k, 5] = other[1] - other[0]
                    points[count + k, 6] = other[2] - other[1]
                count *= 2
    elif tilt < limit:
        inverse = np.array([attitude[0], -attitude[1], -attitude[2], -attitude[3]])
        points[1] = state
        points[1, : model.LINKS] = vector(compose(inverse, matrix_quaternion(model.reverse_in_depth(turn))))
        count = 2
    return points[:count].copy()


def candidates(means: Floats, covariances: Floats, attitudes: Floats, scores: Floats, given: Filtering) -> Candidates:
    """Return the candidates after a frame.

    Args:
        means: (K, n) of the members of the frame before.
        covariances: (K, n, n).
        attitudes: (K, 4).
        scores: (K,).
        given: Observation, noise and constraints.
    """
    found, filled = _find_candidates(means, covariances, attitudes, scores, given)
    return Candidates._make(part[:filled] for part in found)


@compiled
def _find_candidates(
    means: Floats, covariances: Floats, attitudes: Floats, scores: Floats, given: Filtering
) -> tuple[Candidates, int]:
    """Return arrays for candidates, and their number."""
    count, size = means.shape
    most = count * (1 + MOST_POINTS)
    found = Candidates(
        np.empty((most, size)),
        np.empty((most, size, size)),
        np.empty((most, 4)),
        np.empty(most),
        np.empty(most, np.int64),
        np.zeros(most),
        np.zeros(most),
        np.zeros(most, np.int64),
        np.empty((most, 2 * model.LINKS)),
    )
    rows = model.observed_rows(given.seen)
    filled = count
    for k in range(count):
        mean, covariance = predict(means[k], covariances[k], given.noise)
        found.means[k], found.covariances[k], found.attitudes[k] = mean, covariance, attitudes[k]
        found.scores[k], found.parents[k] = SCORE_MEMORY * scores[k], k
        if rows.shape[0] == 0:
            continue
        lower, _ = factorise(covariance)
        points = linearisation_points(mean, attitudes[k], given.mirrors)
        for p in range(points.shape[0]):
            _candidate(found, filled, mean, covariance, lower, attitudes[k], points[p], rows, given)
            found.scores[filled] += SCORE_MEMORY * scores[k]
            found.attitudes[filled], found.parents[filled] = attitudes[k], k
            filled += 1
    for n in range(filled):
        attitude = model.recentre(found.means[n], found.covariances[n], found.attitudes[n].copy())
        found.attitudes[n] = attitude
        found.poses[n, : model.LINKS] = model.directions(model.joints(found.means[n]))
        found.poses[n, model.LINKS :] = found.means[n, size - model.LINKS :]
    return found, filled


@compiled
def _candidate(
    found: Candidates,
    place: int,
    mean: Floats,
    covariance: Floats,
    lower: Floats,
    attitude: Floats,
    point: Floats,
    rows: Ints,
    given: Filtering,
) -> None:
    """Condition a prediction, linearised at a point, on the coordinates `rows` that were seen; cut it and score it."""
    count = rows.shape[0]
    spread, seen = given.variance * np.eye(count), given.seen[rows, 0]
    updated, left, log_evidence = point, covariance, 0.0
    for _ in range(given.rounds):
        point = updated
        shown, slope = (
            model.project(point, attitude, given.seen)[rows],
            model.project_slopes(point, attitude, given.seen)[rows],
        )
        innovation = seen - shown - multiply(slope, (mean - point).reshape(mean.shape[0], 1)).reshape(count)
        updated, left, log_evidence, _ = condition_on_innovation(mean, covariance, innovation, slope, spread)
    found.log_evidences[place] = log_evidence + model.log_image_lengths(point, attitude, given.seen)
    # y' S^-1 y by what the update explains of y, since S^-1 = W^-1 (I - C K).
    explained = multiply(slope, (updated - mean).reshape(mean.shape[0], 1)).reshape(count)
    found.distances[place] = np.sqrt(max(np.sum(innovation * (innovation - explained)) / given.variance, 0.0))
    bounds = given.rows, given.low, given.high
    refuted = given.mirrors >= 0.0 and least_room(updated, left, bounds) < -given.rejection
    if given.constrained:
        found.cuts[place] = truncate(updated, left, bounds)
    rest = seen - model.project(updated, attitude, given.seen)[rows]
    moved = whiten(lower, (updated - mean).reshape(mean.shape[0], 1))
    score = -0.5 * (np.sum(moved * moved) + np.sum(rest * rest) / given.variance)
    found.means[place], found.covariances[place] = updated, left
    found.scores[place] = -np.inf if refuted else score


@compiled
def whiten(lower: Floats, differences: Floats) -> Floats:
    """Return L^-1 d of differences (n, m), given the root L (n, n) of a spread; 0 in directions that have no spread."""
    scale = lower.copy()
    for i in range(lower.shape[0]):
        if not lower[i, i] > 0.0:
            scale[i, i] = np.inf
    return substitute(scale, differences)


# The prediction is linearised at itself and at its mirror images (`linearisation_points`), each iterated to the pose of
# greatest posterior density (Gauss and Newton's method; Bell and Cathey 1993). With x the pose found from the
# prediction N(m, M), C the slopes there, S = C M C' + W I, and e the innovation, the evidence of a side is that of
# Laplace's method, (x - m)' M^-1 (x - m) being e' S^-1 e - W |S^-1 e|^2:
#
#     log p(y) = -1/2 ((x - m)' M^-1 (x - m) + |y - h(x)|^2 / W + log |S|) + const.
#
# One side is drawn by this evidence times its Gaussian's probability within the bounds of joints, and represents all of
# them.

ALMOST_PARALLEL, MOST_PARALLEL = 0.35, 0.95
"""Sine below which a link may lean to either side: the first where its direction is known, and at most the second."""
PARALLEL_SDS = 2.0
"""Shift added to the first, in standard deviations of a direction."""
ROUNDS = 4
CLOSE = 0.2
"""Error of linearisation, in standard deviations of the noise, below which it is good enough."""
APART = 1.5
"""Standard deviations between two sides below which they are one."""


class Work(NamedTuple):
    """Results for a linearised observation of m coordinates.

    Attributes:
        rest: (m,) innovation, e.
        left: (m,) what the linearised observation leaves of it at the pose that was found.
        exact: (m,) what the exact one does.
        cross: (m, f + 1) L^-1 of C M and of e.
        total: (m, m) L; only the lower half is used.
    """

    rest: Floats
    left: Floats
    exact: Floats
    cross: Floats
    total: Floats


@compiled
def see(
    mean: Floats,
    covariance: Floats,
    attitude: Floats,
    variance: float,
    bounds: model.Constraints,
    seen: Floats,
    rows: Ints,
    chance: float,
) -> tuple[Floats, Floats, float, float]:
    """Draw a side, given an observation.

    Args:
        mean: (n,) of the prediction, lengths included.
        covariance: (n, n) of the same, with zeros for lengths.
        attitude: (4,) that omega is relative to.
        variance: Variance of an observed coordinate, px^2.
        bounds: On joints.
        seen: (m, 3) observation, see `observation`.
        rows: Rows of it that were seen.
        chance: Uniform number by which a side is drawn.

    Returns:
        Mean (n,) and covariance (n, n) of the side, log p(y) without its power of 2 pi, and the distance of y from the
        nearest side, standard deviations.
    """
    size, count = mean.shape[0], rows.shape[0]
    free = size - model.LINKS  # lengths are known
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
            evidences[side] = -0.5 * square - log_root + model.log_image_lengths(found[side], attitude, seen)
            weights[side] = evidences[side]
            if sides > 1:
                weights[side] += log_share(found[side], spreads[side], (bounds.rows, bounds.low, bounds.high))
    top = weights.max()
    if not top > -np.inf:
        return mean, covariance, -np.inf, nearest
    shares = np.cumsum(np.exp(weights - top))
    drawn = min(np.searchsorted(shares, chance * shares[-1], side="right"), sides - 1)
    # Sides are drawn by their evidence and the bounds; the caller counts the bounds.
    gained = top + np.log(shares[-1]) - weights[drawn] + evidences[drawn]
    return found[drawn].copy(), spreads[drawn].copy(), gained, nearest


@compiled
def _settle(
    work: Work,
    mean: Floats,
    covariance: Floats,
    attitude: Floats,
    point: Floats,
    variance: float,
    seen: Floats,
    rows: Ints,
) -> Floats:
    """Return the pose (n,) of greatest posterior density, from a point on; the work is that of the last round."""
    count, free = work.rest.shape[0], work.cross.shape[1] - 1
    half = free // 2  # velocities are not seen
    for _ in range(ROUNDS):
        slope, shown = model.project_slopes(point, attitude, seen), model.project(point, attitude, seen)
        _linearise(work, slope, shown, mean, covariance, point, variance, seen, rows)
        _whiten(work.total, work.cross)
        point = mean.copy()
        for i in range(count):
            for j in range(free):
                point[j] += work.cross[i, j] * work.cross[i, free]
        shown, bent = model.project(point, attitude, seen), 0.0
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
    slope: Floats,
    shown: Floats,
    mean: Floats,
    covariance: Floats,
    point: Floats,
    variance: float,
    seen: Floats,
    rows: Ints,
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
def _whiten(total: Floats, wanted: Floats) -> None:
    """Replace S (m, m), given by its lower half, by L of L L' = S, and B (m, k) by L^-1 B."""
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
def _parallel(covariance: Floats) -> float:
    """Return the sine below which a link may lean to either side, given the uncertainty of its direction."""
    size = covariance.shape[0]
    widest = 0.0
    if size == model.PLANE_STATES:
        for i in range(model.LINKS):
            variance = 0.0
            for j in range(i + 1):
                for k in range(i + 1):
                    variance += covariance[j, k]
            widest = max(widest, variance)
    else:
        for i in range(model.LINKS):
            widest = max(widest, covariance[i, i])
    return float(min(ALMOST_PARALLEL + PARALLEL_SDS * np.sqrt(widest), MOST_PARALLEL))


@compiled
def _is_known(found: Floats, spreads: Floats, side: int) -> bool:
    """Whether a side equals an earlier one, as far as their Gaussians show."""
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
