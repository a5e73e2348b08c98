"""How one tracker takes over what another believed.

A Gaussian is made of particles by their moments, and of any other belief by its box, as if everything in it were
equally probable: the centre, and a twelfth of the squared width as the variance. A belief that has no velocities gets
those of the first frame, zero with their variances.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.chain import Chain, recentre, reference_attitude
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet

__all__ = ["box", "chains", "from_moments", "gaussian"]

ROOT_RATE_VARIANCE_PX2 = 1.0
"""Of the root's velocity in the first frame, (px/frame)^2."""

LEAST_WIDTH = 1e-3
"""Of a box, rad or px: a narrower one is taken as that wide, so that its Gaussian has an inverse."""


def chains(state: LinkageState, parameters: LinkageTrackerParameters) -> Beam[Chain]:
    """Return the Gaussians of a state: its own, or one made of what it believes in."""
    if isinstance(state.belief, ParticleSet):
        mean, covariance = state.belief.moments
        return Beam.of(from_moments(mean, covariance, reference_attitude(state.reference)))
    own = tuple(member for member in state.belief.members if isinstance(member, Chain))
    if len(own) == len(state.belief.members):
        return Beam(own, state.belief.log_weights, state.belief.parents)
    return Beam.of(box(state.low, state.high, state.reference, parameters))


def box(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    reference: NDArray[np.float64] | None,
    parameters: LinkageTrackerParameters,
) -> Chain:
    """Return the Gaussian of a box (d,) of estimates, of which the centre does not move yet."""
    width = np.maximum(high - low, LEAST_WIDTH)
    return gaussian(0.5 * (low + high), width * width / 12.0, reference, parameters)


def gaussian(
    mean: NDArray[np.float64],
    variances: NDArray[np.float64],
    reference: NDArray[np.float64] | None,
    parameters: LinkageTrackerParameters,
) -> Chain:
    """Return a Gaussian that does not move yet, given mean and variances (d,) of an estimate."""
    rate = parameters.start_rate_variance_rad2
    if reference is None:
        state = np.concatenate([mean[:LINKS], np.zeros(LINKS), mean[LINKS:]])
        spread = np.concatenate([variances[:LINKS], np.full(LINKS, rate), variances[LINKS:]])
        return Chain(state, np.diag(spread), reference_attitude(None))
    kept = [0, 1, 2, 3, 4, 6, 7]
    rates = np.array([rate, rate, rate, ROOT_RATE_VARIANCE_PX2, ROOT_RATE_VARIANCE_PX2, rate, rate])
    state = np.concatenate([mean[kept], np.zeros(len(kept)), mean[-LINKS:]])
    spread = np.concatenate([variances[kept], rates, variances[-LINKS:]])
    return from_moments(state, np.diag(spread), reference_attitude(reference))


def from_moments(mean: NDArray[np.float64], covariance: NDArray[np.float64], reference: NDArray[np.float64]) -> Chain:
    """Return the Gaussian of moments (n,) and (n, n) in which omega is relative to the reference, a quaternion (4,).

    In space its own attitude takes omega over.
    """
    state, spread = contiguous_copy(mean), contiguous_copy(covariance)
    attitude = recentre(state, spread, contiguous_copy(reference))
    return Chain(state, spread, attitude)
