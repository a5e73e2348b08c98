"""Chains of three rigid links before an orthographic camera: what the camera sees of them, and what joints allow.

The pose is told by the angles theta_i of each link relative to the one before it. Their sums theta*_i =
theta_1 + ... + theta_i are the links' *directions*; 0 is parallel to the image. Lengths r_i are in px.

In the plane the image has one coordinate and the root is at 0. In space the chain lies in a plane of its own, which a
rotation turns, and the root t is seen as well; turning about the normal of that plane and theta_1 are the same motion,
so theta_1 is 0 there.

Since depth is not seen, the mirror image of a link, nearer than its joint instead of farther, looks the same as long as
the others keep their directions. Links that are almost parallel to the image are where one turns into the other.

Source: Shimada 1997, section 4.1, eqs. 4.5 to 4.8, and section 5.5, eqs. 5.35 to 5.46.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled

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
    """Return directions (3,) of which one is mirrored in depth, to the angle nearest to it, and the others are kept."""
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
    """What joints and lengths may be (tables 4.1 and 5.1); infinite where there is no bound.

    Attributes:
        joint_low: Of theta_1..3, rad.
        joint_high: Of the same.
        joint_difference: Greatest |theta_1 - theta_2| and |theta_2 - theta_3|, rad.
        length_low: Of r_1..3, px.
        length_high: Of the same.
        length_difference: Greatest |r_1 - r_2| and |r_2 - r_3|, px.
    """

    joint_low: Three
    joint_high: Three
    joint_difference: tuple[float, float]
    length_low: Three
    length_high: Three
    length_difference: tuple[float, float]

    def constraints(self, *, in_space: bool) -> Constraints:
        """Return the bounds as inequalities; in space none has theta_1, which is no coordinate there."""
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
