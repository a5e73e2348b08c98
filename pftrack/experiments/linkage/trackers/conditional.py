"""A chain whose lengths and noises are given, filtered frame by frame: one Gaussian of pose and velocity, compiled.

Given the lengths, what is seen determines the pose but for the side on which a link leans. One of these sides is drawn
in each frame (`sides`), so that one Gaussian is enough, and the evidence is unbiased (a particle filter of one
particle; Andrieu, Doucet and Holenstein 2010).

A bound on joints is a probability: what the Gaussian has within it. The chain moves little from frame to frame, so that
a Gaussian which has been within a bound in one frame says hardly anything new about it in the next. Of all frames the
least probability is therefore the one that counts, and nothing is cut off.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.shape import Constraints
from pftrack.experiments.linkage.trackers.chain import recentre
from pftrack.experiments.linkage.trackers.linearised import predict
from pftrack.experiments.linkage.trackers.observation import observed_rows
from pftrack.experiments.linkage.trackers.sides import see
from pftrack.filters.truncation import log_share

__all__ = ["Chains", "Given", "advance", "filter_again"]


class Chains(NamedTuple):
    """N chains, each with lengths of its own.

    Attributes:
        means: (N, n) of pose, velocity and lengths.
        covariances: (N, n, n), with zeros for lengths.
        attitudes: (N, 4).
        evidences: (N,) log p(y_1..t) of each, bounds included.
        shares: (N,) logarithm of the least probability of the bounds so far.
    """

    means: NDArray[np.float64]
    covariances: NDArray[np.float64]
    attitudes: NDArray[np.float64]
    evidences: NDArray[np.float64]
    shares: NDArray[np.float64]


class Given(NamedTuple):
    """What is known of N chains.

    Attributes:
        noises: (N, p) standard deviations of the accelerations of the pose.
        variances: (N,) of an observed coordinate, px^2.
        rows: (k, n) constraints lo <= A x <= hi.
        low: (k,).
        high: (k,).
    """

    noises: NDArray[np.float64]
    variances: NDArray[np.float64]
    rows: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@compiled
def advance(
    chains: Chains, given: Given, seen: NDArray[np.float64], chances: NDArray[np.float64]
) -> tuple[Chains, NDArray[np.float64]]:
    """Take a frame.

    Args:
        chains: Of the frame before.
        given: Noises and bounds.
        seen: (m, 3) observation, see `observation`.
        chances: (N,) uniform numbers by which sides are drawn.

    Returns:
        The chains, and how far the observation was from what each predicted, (N,) standard deviations.
    """
    following = _copy(chains)
    distances = np.zeros(chains.evidences.shape[0])
    rows = observed_rows(seen)
    for n in range(distances.shape[0]):
        distances[n] = _step(following, n, given, n, seen, rows, chances[n])
    return following, distances


@compiled
def filter_again(begun: Chains, given: Given, history: NDArray[np.float64], chances: NDArray[np.float64]) -> Chains:
    """Take all frames from the first on.

    Args:
        begun: Before the first of them.
        given: Noises and bounds.
        history: (T, m, 3) observations.
        chances: (T, N) uniform numbers.
    """
    following = _copy(begun)
    for t in range(history.shape[0]):
        rows = observed_rows(history[t])
        for n in range(begun.evidences.shape[0]):
            _step(following, n, given, n, history[t], rows, chances[t, n])
    return following


@compiled
def _copy(chains: Chains) -> Chains:
    return Chains(
        chains.means.copy(),
        chains.covariances.copy(),
        chains.attitudes.copy(),
        chains.evidences.copy(),
        chains.shares.copy(),
    )


@compiled
def _step(
    chains: Chains,
    n: int,
    given: Given,
    which: int,
    seen: NDArray[np.float64],
    rows: NDArray[np.int64],
    chance: float,
) -> float:
    """Take a frame with one chain, in place, and return how far what was seen was from what was predicted."""
    bounds = Constraints(given.rows, given.low, given.high)
    mean, covariance = predict(chains.means[n], chains.covariances[n], given.noises[which])
    attitude, distance = chains.attitudes[n].copy(), 0.0
    if rows.shape[0] > 0:
        mean, covariance, gained, distance = see(
            mean, covariance, attitude, given.variances[which], bounds, seen, rows, chance
        )
        chains.evidences[n] += gained
    share = log_share(mean, covariance, given.rows, given.low, given.high)
    if share < chains.shares[n]:
        chains.evidences[n] += share - chains.shares[n]
        chains.shares[n] = share
    chains.attitudes[n] = recentre(mean, covariance, attitude)
    chains.means[n] = mean
    chains.covariances[n] = covariance
    return distance
