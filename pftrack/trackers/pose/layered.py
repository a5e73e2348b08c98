"""Tracking features in two layers, with a sampling distribution that adapts: PF-ASD.

One frame (document 1, ch. 4, fig. 4.4): predict the upper layer; draw each feature's particles from both predictions;
weigh them by their likelihood; adapt the mixing ratios by what survived; give the features' means back to the upper
layer, which estimates the pose. The ratios of the next frame are judged by the upper *prediction* of this one, before
it has seen the result.

With the ratios fixed at 1 all particles come from above (`alpha-1`), at 0 all from below (`alpha-0`); nothing else
differs. The upper layer and the likelihood are arguments, so that points of a prism and templates of a face are tracked
by the same step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pftrack.filters import adaptive
from pftrack.filters.adaptive import Draw, Features
from pftrack.filters.layers import Projection, UpperLayer
from pftrack.gaussian import Gaussian
from pftrack.learning import mixture_em
from pftrack.learning.mixture_em import Mixture
from pftrack.random import Generator

__all__ = ["FeatureLikelihood", "Layered", "Proposed", "Settings", "begin", "conclude", "propose", "step"]

S = TypeVar("S")

FeatureLikelihood: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""From positions (F, N, 2) px to log likelihoods (F, N), up to a constant for each feature."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to track.

    Attributes:
        sample_count: N, particles per feature.
        noise_sd_px: b_f, process noise of the features' own dynamics, px per frame.
        sd_floor_px: Smallest standard deviation with which a feature's mean is given to the upper layer.
        learning: How the ratios are adapted, or None to keep them as they are.
    """

    sample_count: int = 50
    noise_sd_px: float = 5.0
    sd_floor_px: float = 0.5
    learning: mixture_em.Settings | None = mixture_em.Settings()  # noqa: RUF009 - it is frozen


@dataclass(frozen=True, slots=True)
class Layered(Generic[S]):
    """The state after a frame, immutable.

    Attributes:
        features: The lower layer, particles of F features.
        upper: The upper layer's belief.
        mixture: The ratios by which the next frame's particles will be drawn, and what they were learned from.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad.
        projection: The upper layer's prediction of this frame; None at the beginning.
    """

    features: Features
    upper: S
    mixture: Mixture
    pose: Gaussian
    projection: Projection | None = None


@dataclass(frozen=True, slots=True)
class Proposed(Generic[S]):
    """A frame whose particles have been drawn and wait for their likelihood.

    Attributes:
        drawn: The particles.
        upper: The upper layer's predicted belief.
        projection: Where it expects the features.
    """

    drawn: Draw
    upper: S
    projection: Projection


def begin(
    layer: UpperLayer[S],
    belief: S,
    positions: NDArray[np.float64],
    settings: Settings,
    rng: Generator,
    *,
    ratio: float = 0.5,
    spread_px: float = 1.0,
) -> Layered[S]:
    """Begin at known positions.

    Args:
        layer: The upper layer.
        belief: Its initial belief.
        positions: (F, 2) px of the features.
        settings: How to track.
        rng: The frame's generator.
        ratio: alpha of all features; with `settings.learning` None it stays.
        spread_px: Standard deviation of the particles around the positions.
    """
    features = adaptive.begin(positions, spread_px, settings.sample_count, rng)
    return Layered(features, belief, mixture_em.begin(len(positions), ratio), layer.pose(belief))


def step(
    state: Layered[S],
    layer: UpperLayer[S],
    log_likelihood: FeatureLikelihood,
    settings: Settings,
    rng: Generator,
) -> Layered[S]:
    """Advance by one observation, given the likelihood of positions in it."""
    proposed = propose(state, layer, settings, rng)
    return conclude(state, proposed, layer, log_likelihood(proposed.drawn.positions), settings, rng)


def propose(state: Layered[S], layer: UpperLayer[S], settings: Settings, rng: Generator) -> Proposed[S]:
    """Predict the upper layer and draw the features' particles: the half of a step before the observation."""
    upper = layer.predict(state.upper)
    projection = layer.project(upper)
    drawn = adaptive.draw(
        state.features, projection, state.mixture.ratios, settings.noise_sd_px, settings.sample_count, rng
    )
    return Proposed(drawn, upper, projection)


def conclude(
    state: Layered[S],
    proposed: Proposed[S],
    layer: UpperLayer[S],
    log_likelihoods: NDArray[np.float64],
    settings: Settings,
    rng: Generator,
) -> Layered[S]:
    """Weigh, adapt the ratios, and update the upper layer and the pose: the half after the observation.

    Args:
        state: Of the last frame.
        proposed: What `propose` made of it.
        layer: The upper layer.
        log_likelihoods: (F, N) of the particles drawn, up to a constant for each feature.
        settings: How to track.
        rng: The frame's generator, after `propose` has drawn from it.
    """
    features = adaptive.weigh(proposed.drawn, log_likelihoods, rng)
    mixture = state.mixture
    if settings.learning is not None:
        projection = proposed.projection
        mixture = mixture_em.adapt(
            mixture,
            adaptive.surviving(features),
            (projection.positions, projection.variances),
            adaptive.propagated(state.features),
            settings.noise_sd_px,
            settings.learning,
        )
    variances = np.maximum(features.variances, settings.sd_floor_px**2)
    upper = layer.update(proposed.upper, features.means, variances, rng)
    return Layered(features, upper, mixture, layer.pose(upper), proposed.projection)
