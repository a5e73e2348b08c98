"""A Gaussian of a chain's pose, velocity and lengths, and what a camera sees of it.

The state x of a filter is (pose, change of the pose in a frame, r_1..3). In the plane the pose is theta_1..3. In space
it is (omega, t, theta_2, theta_3): omega is a small rotation beside a reference attitude q, so that the chain is turned
by R(q) R(omega). After each update q takes omega over (`recentre`), so that no angle ever grows large.

What is seen in a frame are numbers that are each a component of a point's image, along a direction: measured points, or
links that are seen as lines.

Source: Shimada 1997, section 4.1, eqs. 4.9 to 4.11, and appendix A for the attitude.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry.rotation import (
    compose,
    matrix_quaternion,
    quaternion,
    quaternion_matrix,
    right_jacobian,
    vector,
)
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve
from pftrack.experiments.linkage.scene import LinkMeasurements
from pftrack.experiments.linkage.shape import (
    LINKS,
    Constraints,
    directions,
    image_in_plane,
    image_in_space,
    slopes_in_plane,
    slopes_in_space,
)

PLANE_STATES = 9
"""Coordinates of a state in the plane; in space there are 17."""

UPRIGHT: Floats = np.array([1.0, 0.0, 0.0, 0.0])
"""The attitude that turns nothing."""
UPRIGHT.flags.writeable = False


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A Gaussian of a chain.

    Attributes:
        mean: (n,), n = 9 in the plane and 17 in space; rad, px, and both a frame.
        covariance: (n, n).
        attitude: (4,) quaternion of the reference attitude; the one that turns nothing, in the plane.
    """

    mean: Floats
    covariance: Floats
    attitude: Floats

    @property
    def pose(self) -> Floats:
        """(6,) directions theta*_1..3, rad, and lengths r_1..3, px."""
        return np.concatenate([directions(joints(self.mean)), self.mean[-LINKS:]])

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return 256 + self.mean.nbytes + self.covariance.nbytes + self.attitude.nbytes

    def arrays(self) -> Mapping[str, Floats]:
        """Return mean, covariance and attitude."""
        return {"means": self.mean, "covariances": self.covariance, "attitudes": self.attitude}


def pose_size(states: int) -> int:
    """Return how many of the coordinates of a state are its pose."""
    return (states - LINKS) // 2


def reference_attitude(reference: Floats | None) -> Floats:
    """Return the quaternion (4,) of a reference attitude (3, 3), or the one that turns nothing."""
    return UPRIGHT.copy() if reference is None else matrix_quaternion(np.array(reference, np.float64, order="C"))


def in_coordinates(constraints: Constraints, states: int) -> Constraints:
    """Return constraints on (theta_1..3, r_1..3) as such on the n coordinates of a state."""
    rows = np.zeros((len(constraints.rows), states))
    rows[:, -LINKS:] = constraints.rows[:, LINKS:]
    if states == PLANE_STATES:
        rows[:, :LINKS] = constraints.rows[:, :LINKS]
    else:
        rows[:, 5:7] = constraints.rows[:, 1:LINKS]
    return Constraints(rows, constraints.low, constraints.high)


@compiled
def joints(state: Floats) -> Floats:
    """Return the joint angles theta_1..3 of a state (n,), rad."""
    if state.shape[0] == PLANE_STATES:
        return state[:LINKS].copy()
    return np.array([0.0, state[5], state[6]])


@compiled
def observe(state: Floats, attitude: Floats) -> Floats:
    """Return what a camera sees of a state (n,), px: (3,) in the plane, (8,) in space, point by point."""
    lengths = state[state.shape[0] - LINKS :]
    if state.shape[0] == PLANE_STATES:
        return image_in_plane(state[:LINKS], lengths)
    turn = quaternion_matrix(compose(attitude, quaternion(state[:LINKS])))
    return image_in_space(turn, state[3:5], joints(state), lengths).reshape(8)


@compiled
def slopes(state: Floats, attitude: Floats) -> Floats:
    """Return the derivatives of `observe` by the state, (3, 9) or (8, 17)."""
    size = state.shape[0]
    lengths = state[size - LINKS :]
    if size == PLANE_STATES:
        return slopes_in_plane(state[:LINKS], lengths)
    turn = quaternion_matrix(compose(attitude, quaternion(state[:LINKS])))
    return slopes_in_space(turn, right_jacobian(state[:LINKS]), joints(state), lengths)


@compiled
def recentre(mean: Floats, covariance: Floats, attitude: Floats) -> Floats:
    """Let the attitude take the rotation of a mean in space over, and return it; mean and covariance change in place.

    A small turn du beside the new attitude is J_r dw beside the old one, so the block of omega becomes J_r V J_r'.
    """
    size = mean.shape[0]
    if size == PLANE_STATES:
        return attitude
    jacobian = right_jacobian(mean[:LINKS])
    following = compose(attitude, quaternion(mean[:LINKS]))
    rows = multiply(jacobian, covariance[:LINKS].copy())
    for i in range(LINKS):
        mean[i] = 0.0
        for j in range(size):
            covariance[i, j] = rows[i, j]
    columns = multiply(covariance[:, :LINKS].copy(), jacobian.T.copy())
    for i in range(size):
        for j in range(LINKS):
            covariance[i, j] = columns[i, j]
    return following


@compiled
def describe(
    mean: Floats,
    covariance: Floats,
    attitude: Floats,
    reference: Floats,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what a person is told of a Gaussian.

    Args:
        mean: (n,).
        covariance: (n, n).
        attitude: (4,).
        reference: (4,) attitude that omega is told relative to.

    Returns:
        The estimate (d,), its standard deviations (d,), and the directions (3,) with theirs (3,).
    """
    size = mean.shape[0]
    plane = size == PLANE_STATES
    # Where theta_1 would be among the coordinates; in space it is none.
    first = 0 if plane else 4
    count = 2 * LINKS if plane else 5 + 2 * LINKS
    estimate, deviations = np.zeros(count), np.zeros(count)
    theta = joints(mean)
    for i in range(LINKS):
        estimate[count - 2 * LINKS + i] = theta[i]
        estimate[count - LINKS + i] = mean[size - LINKS + i]
        deviations[count - LINKS + i] = np.sqrt(max(covariance[size - LINKS + i, size - LINKS + i], 0.0))
        if plane or i > 0:
            deviations[count - 2 * LINKS + i] = np.sqrt(max(covariance[first + i, first + i], 0.0))
    absolute_deviations = np.zeros(LINKS)
    for i in range(LINKS):
        variance = 0.0
        for j in range(0 if plane else 1, i + 1):
            for k in range(0 if plane else 1, i + 1):
                variance += covariance[first + j, first + k]
        absolute_deviations[i] = np.sqrt(max(variance, 0.0))
    if not plane:
        inverse = np.array([reference[0], -reference[1], -reference[2], -reference[3]])
        omega = vector(compose(inverse, compose(attitude, quaternion(mean[:LINKS]))))
        # du = J_r(omega) d omega: what is known of the small turn, told of omega.
        turns, _ = solve(right_jacobian(omega), right_jacobian(mean[:LINKS]))
        spread = multiply(multiply(turns, covariance[:LINKS, :LINKS].copy()), turns.T.copy())
        for i in range(LINKS):
            estimate[i] = omega[i]
            deviations[i] = np.sqrt(max(spread[i, i], 0.0))
        for i in range(2):
            estimate[LINKS + i] = mean[LINKS + i]
            deviations[LINKS + i] = np.sqrt(max(covariance[LINKS + i, LINKS + i], 0.0))
    return estimate, deviations, directions(theta), absolute_deviations


# A measured point is two of the numbers that are seen, along the axes of the image. A link that is seen as a line is
# two as well: the places of its beginning and of its end along the line's unit normal n, and both are the line's
# offset from the origin,
#
#     n . L X_{i-1} = rho + error,  n . L X_i = rho + error.
#
# So the filter's innovation is the distance of either end from the line that was seen. Shimada 1997, eqs. 4.9 to 4.11,
# observes (m, rho) with m = L X_i - L X_{i-1} instead. The length of m is not seen, and its direction turns about where
# a link points at the camera; the distances are linear in the image, know no such pose, and have the errors of the ends
# for their noise.
#
# Of a line's two numbers, direction and offset, the density is that of the distances times the length that the link has
# in the image, by which the distances of its ends depend on the direction. Without this factor a short link would fit
# every line the better, since its ends are always near it (`log_image_lengths`).
#
# An observation is an array (m, 3): the number, NaN where it was not seen, and the direction along which it is
# measured. m is 3 in the plane, 8 in space, and 14 in space with lines: then six rows follow, two for each link.

POINT_ROWS = 2 * (LINKS + 1)
"""Coordinates of points in space; rows beyond them are of lines."""


def read_observation(frame: Frame, origin_px: Floats, *, in_space: bool) -> Floats:
    """Return what was seen, (3, 3) in the plane, (8, 3) or (14, 3) in space, px from the origin.

    Raises:
        ValueError: The frame has no measured points, or another number of them.
    """
    measured = frame.measurements
    points = None if measured is None else measured.points_px
    expected = LINKS + 1 if in_space else LINKS
    if points is None or points.shape != (expected, 2):
        got = "none" if points is None else f"{len(points)}"
        raise ValueError(f"a tracker of a chain needs {expected} measured points, got {got}")
    placed = points - origin_px
    values = placed.ravel() if in_space else placed[:, 0]
    axes = np.tile(np.eye(2), (LINKS + 1, 1)) if in_space else np.tile([1.0, 0.0], (LINKS, 1))
    if in_space and isinstance(measured, LinkMeasurements):
        offsets = measured.offsets_px - (measured.normals * origin_px).sum(axis=1)
        values, axes = np.append(values, offsets.repeat(2)), np.vstack([axes, measured.normals.repeat(2, axis=0)])
    return np.column_stack([np.where(np.isfinite(values), values, np.nan), axes])


@compiled
def observed_rows(seen: Floats) -> Ints:
    """Return the rows (k,) of an observation (m, 3) that were seen."""
    return np.flatnonzero(~np.isnan(seen[:, 0]))


@compiled
def project(state: Floats, attitude: Floats, seen: Floats) -> Floats:
    """Return what a state (n,) shows of what was seen (m, 3), (m,) px."""
    image = observe(state, attitude)
    if seen.shape[0] <= POINT_ROWS:
        return image
    shown = np.empty(seen.shape[0])
    shown[:POINT_ROWS] = image
    for row in range(POINT_ROWS, seen.shape[0]):
        at = 2 * _point(row)
        shown[row] = seen[row, 1] * image[at] + seen[row, 2] * image[at + 1]
    return shown


@compiled
def project_slopes(state: Floats, attitude: Floats, seen: Floats) -> Floats:
    """Return the derivatives of `project` by the state, (m, n)."""
    image = slopes(state, attitude)
    if seen.shape[0] <= POINT_ROWS:
        return image
    found = np.empty((seen.shape[0], state.shape[0]))
    found[:POINT_ROWS] = image
    for row in range(POINT_ROWS, seen.shape[0]):
        at = 2 * _point(row)
        for j in range(state.shape[0]):
            found[row, j] = seen[row, 1] * image[at, j] + seen[row, 2] * image[at + 1, j]
    return found


@compiled
def project_all(states: Floats, attitude: Floats, seen: Floats) -> Floats:
    """Return what each of several states (N, n) shows of what was seen (m, 3), (N, m) px."""
    shown = np.empty((states.shape[0], seen.shape[0]))
    for n in range(states.shape[0]):
        shown[n] = project(states[n], attitude, seen)
    return shown


@compiled
def log_image_lengths(state: Floats, attitude: Floats, seen: Floats) -> float:
    """Return the sum of the logarithms of the lengths, px, that links have in the image that are seen as lines."""
    total = 0.0
    if seen.shape[0] > POINT_ROWS:
        image = observe(state, attitude)
        for link in range(LINKS):
            if not np.isnan(seen[POINT_ROWS + 2 * link, 0]):
                across, down = image[2 * link + 2] - image[2 * link], image[2 * link + 3] - image[2 * link + 1]
                # A link that points at the camera shows no line.
                total += 0.5 * np.log(max(across * across + down * down, 1.0))
    return total


@compiled
def _point(row: int) -> int:
    """Return the point of a row of a line: of either end of its link."""
    return (row - POINT_ROWS) // 2 + (row - POINT_ROWS) % 2


# Hard bounds of errors say where the image of each link lies in space, whatever was seen of it. A measured point lies
# in a square, and a link that is seen as a line has both ends in the strip along it. So each point of the chain lies in
# a polygon: a joint, where the strips of its two links cross. The difference of a link's ends lies within the
# difference of the extents of their polygons, along the line and across it. Across it that is twice the bound of the
# errors; along it, it is known where both ends are: where another line or a point tells of each of them.

FAR_PX = 1e6
"""Half the side of the square that stands for the plane."""

SLACK_PX = 1e-6
"""By how much strips are widened, so that rounding loses nothing."""

Strip: TypeAlias = tuple[Floats, float, float]
"""(n, low, high) of low <= n . p <= high, with n (2,) a unit vector."""


def intersect(strips: list[Strip]) -> Floats:
    """Return the corners (k, 2) of all that is in every strip and in the square; none if nothing is."""
    corners = FAR_PX * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for normal, low, high in strips:
        corners = _clip(corners, normal, high + SLACK_PX)
        corners = _clip(corners, -normal, SLACK_PX - low)
    return corners


def extent(corners: Floats, direction: Floats) -> tuple[float, float]:
    """Return the least and the greatest of direction . p over a polygon; infinite both where it has no end on a side.

    Args:
        corners: (k, 2), at least one.
        direction: (2,) unit vector.
    """
    along = (corners * direction).sum(axis=1)
    low, high = float(along.min()), float(along.max())
    return (low, high) if max(-low, high) < 0.5 * FAR_PX else (-np.inf, np.inf)


def _clip(corners: Floats, normal: Floats, limit: float) -> Floats:
    """Return the corners of the part of a convex polygon in which n . p <= limit (Sutherland and Hodgman 1974)."""
    beyond = (corners * normal).sum(axis=1) - limit
    kept: list[Floats] = []
    for k in range(len(corners)):
        one, other = beyond[k - 1], beyond[k]
        if (one > 0.0) != (other > 0.0):
            kept.append(corners[k - 1] + one / (one - other) * (corners[k] - corners[k - 1]))
        if other <= 0.0:
            kept.append(corners[k])
    return np.array(kept).reshape(-1, 2)


AXES = np.eye(2)

Extents: TypeAlias = tuple[Floats, Floats]
"""Middles (4, 2) and half extents (4, 2) of where points are, along the axes of the image; infinite halves are none."""


class LinkImage(NamedTuple):
    """The end of a link less its beginning, in the image.

    Attributes:
        turn: (3, 3) rotation about the line of sight that makes the two directions along which it is bounded the axes.
        middle: (2,) along these, px.
        bound: (2,) of the distance from that, px; infinite where nothing is known, -infinite where nothing is possible.
    """

    turn: Floats
    middle: Floats
    bound: Floats


def link_images(seen: Floats, bound: float) -> list[LinkImage | None]:
    """Return what is known of each link's image, None where it is nothing.

    Args:
        seen: (8, 3) or (14, 3) observation, see `observation`.
        bound: Of the error of a measured coordinate, and of an end from its line, px.
    """
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        shown, both = points[1:] - points[:-1], np.full(2, 2.0 * bound)
        return [None if np.isnan(one).any() else LinkImage(np.eye(3), one, both) for one in shown]
    polygons = places_of(seen, bound)
    return [_link_image(polygons[link], polygons[link + 1], seen, link) for link in range(LINKS)]


def places_of(seen: Floats, bound: float) -> list[Floats]:
    """Return the corners (k, 2) of where each of the four points can be, px from the origin."""
    strips: list[list[Strip]] = [[] for _ in range(LINKS + 1)]
    for row, (value, *direction) in enumerate(seen):
        if not np.isnan(value):
            past = row - POINT_ROWS
            point = row // 2 if past < 0 else past // 2 + past % 2
            strips[point].append((np.array(direction), float(value) - bound, float(value) + bound))
    return [intersect(one) for one in strips]


def _link_image(beginning: Floats, end: Floats, seen: Floats, link: int) -> LinkImage | None:
    turn, row = np.eye(3), POINT_ROWS + 2 * link
    if not np.isnan(seen[row, 0]):
        across, down = seen[row, 1:]
        turn[:2, :2] = [[across, down], [-down, across]]
    if not (len(beginning) and len(end)):
        # Strips that do not meet contradict each other: no link is between what is nowhere.
        return LinkImage(turn, np.zeros(2), np.full(2, -np.inf))
    middle, half = np.zeros(2), np.full(2, np.inf)
    for axis in range(2):
        (first, last), (low, high) = extent(beginning, turn[axis, :2]), extent(end, turn[axis, :2])
        if np.isfinite([first, last, low, high]).all():
            middle[axis], half[axis] = 0.5 * (low - last + high - first), 0.5 * (high - first - low + last)
    return LinkImage(turn, middle, half) if np.isfinite(half).any() else None


def bound_places(seen: Floats, bound: float) -> Extents:
    """Return how far each point of the chain extends, given what was seen of it."""
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        return points, np.where(np.isnan(points), np.inf, bound)
    middles, halves = np.zeros((LINKS + 1, 2)), np.full((LINKS + 1, 2), np.inf)
    for point, corners in enumerate(places_of(seen, bound)):
        for axis in range(2 if len(corners) else 0):
            low, high = extent(corners, AXES[axis])
            if np.isfinite(high):
                middles[point, axis], halves[point, axis] = 0.5 * (low + high), 0.5 * (high - low)
    return middles, halves
