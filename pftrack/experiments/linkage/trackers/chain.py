"""A Gaussian of a chain's pose, velocity and lengths, and what a camera sees of it.

The state x of a filter is (pose, change of the pose in a frame, r_1..3). In the plane the pose is theta_1..3. In space
it is (omega, t, theta_2, theta_3): omega is a small rotation beside a reference attitude q, so that the chain is turned
by R(q) R(omega). After each update q takes omega over (`recentre`), so that no angle ever grows large.

Source: Shimada 1997, section 4.1, and appendix A for the attitude.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation_vector import (
    compose,
    matrix_quaternion,
    quaternion,
    quaternion_matrix,
    right_jacobian,
    vector,
)
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import multiply, solve
from pftrack.experiments.linkage.shape import (
    LINKS,
    Constraints,
    directions,
    image_in_plane,
    image_in_space,
    slopes_in_plane,
    slopes_in_space,
)

__all__ = [
    "UPRIGHT",
    "Chain",
    "describe",
    "in_coordinates",
    "observe",
    "pose_size",
    "recentre",
    "reference_attitude",
    "slopes",
]

PLANE_STATES = 9
"""Coordinates of a state in the plane; in space there are 17."""

UPRIGHT: NDArray[np.float64] = np.array([1.0, 0.0, 0.0, 0.0])
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

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    attitude: NDArray[np.float64]

    @property
    def pose(self) -> NDArray[np.float64]:
        """(6,) directions theta*_1..3, rad, and lengths r_1..3, px."""
        return np.concatenate([directions(joints(self.mean)), self.mean[-LINKS:]])

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return 256 + self.mean.nbytes + self.covariance.nbytes + self.attitude.nbytes

    def arrays(self) -> Mapping[str, NDArray[np.float64]]:
        """Return mean, covariance and attitude."""
        return {"means": self.mean, "covariances": self.covariance, "attitudes": self.attitude}


def pose_size(states: int) -> int:
    """Return how many of the coordinates of a state are its pose."""
    return (states - LINKS) // 2


def reference_attitude(reference: NDArray[np.float64] | None) -> NDArray[np.float64]:
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
def joints(state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the joint angles theta_1..3 of a state (n,), rad."""
    if state.shape[0] == PLANE_STATES:
        return state[:LINKS].copy()
    return np.array([0.0, state[5], state[6]])


@compiled
def observe(state: NDArray[np.float64], attitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a camera sees of a state (n,), px: (3,) in the plane, (8,) in space, point by point."""
    lengths = state[state.shape[0] - LINKS :]
    if state.shape[0] == PLANE_STATES:
        return image_in_plane(state[:LINKS], lengths)
    turn = quaternion_matrix(compose(attitude, quaternion(state[:LINKS])))
    return image_in_space(turn, state[3:5], joints(state), lengths).reshape(8)


@compiled
def slopes(state: NDArray[np.float64], attitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives of `observe` by the state, (3, 9) or (8, 17)."""
    size = state.shape[0]
    lengths = state[size - LINKS :]
    if size == PLANE_STATES:
        found = slopes_in_plane(state[:LINKS], lengths)
        whole = np.zeros((LINKS, size))
        whole[:, :LINKS] = found[:, :LINKS]
        whole[:, size - LINKS :] = found[:, LINKS:]
        return whole
    turn = quaternion_matrix(compose(attitude, quaternion(state[:LINKS])))
    found = slopes_in_space(turn, right_jacobian(state[:LINKS]), joints(state), lengths)
    whole = np.zeros((8, size))
    whole[:, :5] = found[:, :5]
    whole[:, 5:7] = found[:, 6:8]
    whole[:, size - LINKS :] = found[:, 8:]
    return whole


@compiled
def recentre(
    mean: NDArray[np.float64], covariance: NDArray[np.float64], attitude: NDArray[np.float64]
) -> NDArray[np.float64]:
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
    mean: NDArray[np.float64],
    covariance: NDArray[np.float64],
    attitude: NDArray[np.float64],
    reference: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
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
