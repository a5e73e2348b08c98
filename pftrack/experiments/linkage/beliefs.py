"""What is believed of a chain, in one form that is drawn: places of hypotheses, weights, and how far they extend."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.linkage.scene.truth import LinkageTarget, attitude, places
from pftrack.experiments.linkage.sets.regions import CENTRE
from pftrack.experiments.linkage.shape import LINKS, joint_angles
from pftrack.experiments.linkage.trackers.chain import Chain, describe, pose_size, reference_attitude
from pftrack.experiments.linkage.trackers.regions import Region
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet

__all__ = ["ShownHypothesis", "chain_of", "list_hypotheses", "particles", "turn_of"]

SIGMAS = 2.0
"""How many standard deviations a Gaussian is taken to extend."""

MOST_PARTICLES = 100
"""More would hide what they are drawn around."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownHypothesis:
    """One hypothesis.

    Attributes:
        position: (6,) or (11,), an estimate.
        middle: (6,) of the ellipsoid, directions, rad, and lengths, px.
        weight: Its probability.
        low: (6,) of the box of directions, rad, and lengths, px, that it extends to.
        high: (6,) of the same.
        shape: (6, 6) of the ellipsoid, {x: x' shape^-1 x <= 1} from its middle; None where there is none.
    """

    position: NDArray[np.float64]
    middle: NDArray[np.float64]
    weight: float
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    shape: NDArray[np.float64] | None


def list_hypotheses(state: LinkageState) -> list[ShownHypothesis]:
    """Return the hypotheses of a state in its order; none of particles."""
    if not isinstance(state.belief, Beam):
        return []
    pairs = zip(state.belief.members, state.belief.weights.tolist(), strict=True)
    found = []
    for member, weight in pairs:
        if isinstance(member, Chain):
            found.append(_gaussian(member, weight, state))
        elif isinstance(member, Region):
            found.append(_region(member, weight, state))
    return found


def particles(state: LinkageState) -> NDArray[np.float64]:
    """Return the estimates (m, 6) or (m, 11) of some particles, drawn by weight at equal steps; none of hypotheses."""
    size = len(state.mean)
    if not isinstance(state.belief, ParticleSet):
        return np.empty((0, size))
    shares = np.cumsum(state.belief.weights)
    steps = (np.arange(MOST_PARTICLES) + 0.5) / MOST_PARTICLES * shares[-1]
    states = state.belief.states[np.unique(np.searchsorted(shares, steps))]
    if not state.in_space:
        return np.hstack([states[:, :LINKS], states[:, -LINKS:]])
    # The first angle is part of the attitude.
    first = np.zeros((len(states), 1))
    return np.hstack([states[:, :5], first, states[:, 5:7], states[:, -LINKS:]])


def _gaussian(member: Chain, weight: float, state: LinkageState) -> ShownHypothesis:
    reference = reference_attitude(state.reference)
    position = describe(member.mean, member.covariance, member.attitude, reference)[0]
    size = len(member.mean)
    rows = np.zeros((2 * LINKS, size))
    # In space the first of the chain's own angles is none, and two stand behind the root.
    first, count = (0, LINKS) if not state.in_space else (pose_size(size) - 2, 2)
    for link in range(LINKS):
        rows[link, first : first + max(link + 1 - (LINKS - count), 0)] = 1.0
        rows[LINKS + link, size - LINKS + link] = 1.0
    shape = SIGMAS**2 * rows @ member.covariance @ rows.T
    half = np.sqrt(np.maximum(np.diagonal(shape), 0.0))
    return ShownHypothesis(position, member.pose, weight, member.pose - half, member.pose + half, shape)


def _region(member: Region, weight: float, state: LinkageState) -> ShownHypothesis:
    position = state.mean.copy()
    position[-2 * LINKS : -LINKS], position[-LINKS:] = joint_angles(member.pose[:LINKS]), member.pose[LINKS:]
    if state.in_space:
        position[:LINKS] = member.array[CENTRE, :LINKS] / member.scale
    shape = member.shape if member.has_ellipsoid else None
    return ShownHypothesis(position, member.pose, weight, member.low, member.high, shape)


def chain_of(position: NDArray[np.float64], state: LinkageState) -> NDArray[np.float64]:
    """Return where root, joints and tip of an estimate are, (4, 3): column and row from the origin, and depth, px."""
    theta, r = position[-2 * LINKS : -LINKS], position[-LINKS:]
    if not state.in_space:
        return places(LinkageTarget(position, theta=theta, r=r))
    omega, t = position[:3], position[3:5]
    return places(LinkageTarget(position, theta=theta, r=r, omega=omega, t=t, reference=state.reference))


def turn_of(position: NDArray[np.float64], state: LinkageState) -> NDArray[np.float64]:
    """Return how the plane of a chain lies, (3, 3): its first two directions and its normal, as columns."""
    if state.reference is None:
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    return np.asarray(state.reference @ attitude(position[:3]))
