"""A chain of three rigid links before an orthographic camera: its shape, its image, and a Gaussian over its state.

The pose is given by the angles theta_i of each link relative to the one before it. Their sums theta*_i = theta_1 + ...
+ theta_i are the links' *directions*; 0 is parallel to the image. Lengths r_i are in px.

In the plane the image has one coordinate and the root is at 0. In space the chain lies in a plane that a rotation
turns, and the root t is seen as well; a turn about the normal of that plane is the same motion as theta_1, so theta_1
is 0 there.

Since depth is not seen, the mirror image of a link, nearer than its joint instead of farther, looks the same as long as
the others keep their directions. Links that are almost parallel to the image are where one turns into the other.

Source: Shimada 1997, section 4.1, eqs. 4.5 to 4.11, section 5.5, eqs. 5.35 to 5.46, and appendix A for the attitude.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import compose, matrix_quaternion, quaternion, quaternion_matrix, right_jacobian, vector
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve
from pftrack.experiments.linkage.scene import LinkMeasurements

LINKS = 3


@compiled
def directions(theta: Floats) -> Floats:
    """Return the directions theta*, (3,), of joint angles (3,), rad."""
    return np.array([theta[0], theta[0] + theta[1], theta[0] + theta[1] + theta[2]])


@compiled
def joint_angles(absolute: Floats) -> Floats:
    """Return the joint angles theta, (3,), of directions (3,), rad."""
    return np.array([absolute[0], absolute[1] - absolute[0], absolute[2] - absolute[1]])


@compiled
def mirror(absolute: Floats, link: int) -> Floats:
    """Return directions (3,) with one mirrored in depth, to the angle nearest to it; the others are kept."""
    following = absolute.copy()
    following[link] = 2.0 * np.pi * np.floor(absolute[link] / np.pi + 0.5) - absolute[link]
    return following


@compiled
def image_in_plane(theta: Floats, r: Floats) -> Floats:
    """Return y_i = sum_{j <= i} r_j cos theta*_j, (3,) px: joint 2, joint 3 and the tip as seen from the root."""
    absolute = directions(theta)
    seen = np.empty(LINKS)
    reached = 0.0
    for i in range(LINKS):
        reached += r[i] * np.cos(absolute[i])
        seen[i] = reached
    return seen


@compiled
def slopes_in_plane(theta: Floats, r: Floats) -> Floats:
    """Return the derivatives (3, 9) of `image_in_plane` by theta_1..3, px/rad, by their change, 0, and by r_1..3."""
    absolute = directions(theta)
    slopes = np.zeros((LINKS, 3 * LINKS))
    for i in range(LINKS):
        for k in range(i + 1):
            for j in range(k, i + 1):
                slopes[i, k] -= r[j] * np.sin(absolute[j])
            slopes[i, 2 * LINKS + k] = np.cos(absolute[k])
    return slopes


@compiled
def image_in_space(turn: Floats, t: Floats, theta: Floats, r: Floats) -> Floats:
    """Return where root, joints and tip are seen, (4, 2) px (eqs. 4.5 to 4.8).

    Args:
        turn: (3, 3) rotation of the plane of the chain.
        t: (2,) px, where the root is seen.
        theta: (3,) rad.
        r: (3,) px.
    """
    absolute = directions(theta)
    seen = np.empty((LINKS + 1, 2))
    x, y = 0.0, 0.0
    for i in range(LINKS + 1):
        for k in range(2):
            seen[i, k] = t[k] + turn[k, 0] * x + turn[k, 1] * y
        if i < LINKS:
            x += r[i] * np.cos(absolute[i])
            y += r[i] * np.sin(absolute[i])
    return seen


@compiled
def slopes_in_space(turn: Floats, jacobian: Floats, theta: Floats, r: Floats) -> Floats:
    """Return the derivatives (8, 17) of `image_in_space`, row by row.

    They are by omega, t and theta_2..3, by their change in a frame, 0, and by r_1..3.

    Args:
        turn: (3, 3) rotation of the plane of the chain, by R(omega) on its right side.
        jacobian: (3, 3) right Jacobian of omega; the identity if omega is 0.
        theta: (3,) rad.
        r: (3,) px.
    """
    absolute = directions(theta)
    slopes = np.zeros((2 * (LINKS + 1), 14 + LINKS))
    x, y = 0.0, 0.0
    for i in range(LINKS + 1):
        for k in range(2):
            row = 2 * i + k
            slopes[row, 3 + k] = 1.0
            # -R [x]x J_r of the point (x, y, 0).
            first, second, third = -turn[k, 2] * y, turn[k, 2] * x, turn[k, 0] * y - turn[k, 1] * x
            for m in range(3):
                slopes[row, m] = -(first * jacobian[0, m] + second * jacobian[1, m] + third * jacobian[2, m])
            for j in range(i):
                along, across = np.cos(absolute[j]), np.sin(absolute[j])
                slopes[row, 14 + j] = turn[k, 0] * along + turn[k, 1] * across
                for joint in range(1, j + 1):
                    slopes[row, 4 + joint] += r[j] * (turn[k, 1] * along - turn[k, 0] * across)
        if i < LINKS:
            x += r[i] * np.cos(absolute[i])
            y += r[i] * np.sin(absolute[i])
    return slopes


@compiled
def reverse_in_depth(turn: Floats) -> Floats:
    """Return the rotation (3, 3) of the plane of a chain that is mirrored in depth as a whole: it is seen the same."""
    other = turn.copy()
    for i in range(3):
        for j in range(3):
            if (i == 2) != (j == 2):
                other[i, j] = -turn[i, j]
    return other


class Constraints(NamedTuple):
    """lo <= A (theta_1..3, r_1..3) <= hi.

    Attributes:
        rows: (m, 6), A.
        low: (m,) rad or px; may be -inf.
        high: (m,) rad or px; may be inf.
    """

    rows: Floats
    low: Floats
    high: Floats

    def of(self, *, lengths: bool) -> "Constraints":
        """Return those on lengths, which are the last of the coordinates, or those on joints alone."""
        chosen = np.any(self.rows[:, -LINKS:] != 0.0, axis=1) == lengths
        return Constraints(self.rows[chosen], self.low[chosen], self.high[chosen])


Three = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of joints and lengths (tables 4.1 and 5.1); infinite for unbounded values.

    Attributes:
        joint_low: Lower bounds of theta_1..3, rad.
        joint_high: Upper bounds of the same.
        joint_difference: Greatest |theta_1 - theta_2| and |theta_2 - theta_3|, rad.
        length_low: Lower bounds of r_1..3, px.
        length_high: Upper bounds of the same.
        length_difference: Greatest |r_1 - r_2| and |r_2 - r_3|, px.
    """

    joint_low: Three
    joint_high: Three
    joint_difference: tuple[float, float]
    length_low: Three
    length_high: Three
    length_difference: tuple[float, float]

    def constraints(self, *, in_space: bool) -> Constraints:
        """Return the bounds as inequalities; in space they omit theta_1, which is not a coordinate there."""
        rows = [*np.eye(2 * LINKS)]
        low = [*self.joint_low, *self.length_low]
        high = [*self.joint_high, *self.length_high]
        for at, widest in ((0, self.joint_difference), (LINKS, self.length_difference)):
            for k in range(LINKS - 1):
                row = np.zeros(2 * LINKS)
                row[at + k], row[at + k + 1] = 1.0, -1.0
                rows.append(row)
                low.append(-widest[k])
                high.append(widest[k])
        kept = [
            k
            for k, row in enumerate(rows)
            if (np.isfinite(low[k]) or np.isfinite(high[k])) and not (in_space and row[0] != 0.0)
        ]
        return Constraints(np.array(rows)[kept], np.array(low)[kept], np.array(high)[kept])


# The state x of a filter is (pose, change of the pose in a frame, r_1..3). In the plane the pose is theta_1..3. In
# space it is (omega, t, theta_2, theta_3): omega is a small rotation relative to a reference attitude q, so the chain
# is turned by R(q) R(omega). After each update q absorbs omega (`recentre`), so angles stay small.
#
# What is seen in a frame are numbers that are each a component of a point's image, along a direction: measured points,
# or links that are seen as lines.

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

    def arrays(self) -> Mapping[str, Floats]:
        """Return mean, covariance and attitude."""
        return {"means": self.mean, "covariances": self.covariance, "attitudes": self.attitude}


def pose_size(states: int) -> int:
    """Return the number of a state's coordinates that belong to its pose."""
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
    """Return the values of a Gaussian shown to users.

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
    # The place of theta_1 among the coordinates; in space it is not a coordinate.
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
