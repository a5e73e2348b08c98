"""The inner loop of the trackers that draw by prediction and by observation, compiled as a whole.

One pass is one frame: choose the samplers by the last posterior, draw parents, move them, weigh them by a likelihood of
the picture, such as the colour of the pixel under them (Bando 2007, ch. 3). It calls the very functions that the
filters are made of, and only spares the interpreter between them. A live step is a loop over one frame; a batch gives
it many, and therefore has the same numbers.
"""

from collections.abc import Callable
from enum import IntEnum
from functools import cache
from types import FunctionType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import inner_product
from pftrack.core.numerics.random import standard_normals
from pftrack.filters.auxiliary import correction, exceeds, hard, soft
from pftrack.filters.dynamics import diffuse, predict
from pftrack.filters.particles import moments, normalise
from pftrack.filters.resampling import parents

LogLikelihood: TypeAlias = Callable[[NDArray[np.uint8], Floats, Any], Floats]

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""


class Rule(IntEnum):
    """How the samplers are chosen."""

    PREDICTION = 0
    OBSERVATION = 1
    HARD = 2
    SOFT = 3
    NOISE = 4


class Scheme(NamedTuple):
    """How particles are drawn and weighed; thresholds in px.

    One in `wide_every` particles gets noise on its position that is `wide_factor` times as large: a mixture of two
    process noises, drawn in strata. Where the posterior is in doubt and all noise is large, there is no such share.
    """

    rule: int
    sample_count: int
    gamma: float
    gamma_min: float
    gamma_max: float
    corrected: bool
    balanced: bool
    resampling: int
    threshold: float
    wide_every: int
    wide_factor: float


class Motion(NamedTuple):
    """x' = A x + d + B u, with the process noise of calm and of alert frames."""

    transition: Floats
    offset: Floats
    noise: Floats
    large_noise: Floats


class Loop(NamedTuple):
    """What comes of L frames, and the particles of the last.

    Attributes:
        coordinates: (d, N).
        log_weights: (N,).
        ancestors: (N,) places of the parents among the particles of the frame before.
        mean: (d,).
        covariance: (d, d).
        estimates: (L, 2) posterior means of the position, px.
        log_evidences: (L,).
        observation_counts: (L,) particles by observation.
        resampled: (L,) whether parents were drawn.
        alert: (L,) whether the observation was trusted more, or the prediction doubted, than in calm times.
    """

    coordinates: Floats
    log_weights: Floats
    ancestors: Ints
    mean: Floats
    covariance: Floats
    estimates: Floats
    log_evidences: Floats
    observation_counts: Ints
    resampled: Bools
    alert: Bools


def _log_likelihood(picture_rgb: NDArray[np.uint8], states: Floats, likelihood: tuple[Any, ...]) -> Floats:
    """Return log p(z | x) (N,); `loop_with` puts a compiled likelihood in this place."""
    raise NotImplementedError


def _loop(
    pictures_rgb: NDArray[np.uint8],
    coordinates: Floats,
    log_weights: Floats,
    sigma: Floats,
    motion: Motion,
    likelihood: tuple[Any, ...],
    scheme: Scheme,
    seed: int,
    first_frame: int,
) -> Loop:
    """Track through frames.

    Args:
        pictures_rgb: (L, height, width, 3), L >= 1.
        coordinates: (d, N) particles of the frame before, of which the first two coordinates are the position in px.
        log_weights: (N,) of them.
        sigma: (2,) posterior standard deviations of the frame before, px.
        motion: p(x_t | x_{t-1}).
        likelihood: Packed parameters of p(z_t | x_t).
        scheme: How to draw.
        seed: Of the run.
        first_frame: Index of the first picture within the run.
    """
    frames = pictures_rgb.shape[0]
    estimates = np.empty((frames, 2))
    log_evidences = np.empty(frames)
    observation_counts = np.empty(frames, np.int64)
    resampled = np.empty(frames, np.bool_)
    alert = np.empty(frames, np.bool_)
    ancestors = np.empty(0, np.int64)
    mean, covariance = np.empty(0), np.empty((0, 0))
    states = coordinates.T
    for t in range(frames):
        picture, place = pictures_rgb[t], (seed, first_frame + t)
        by_observation, alert[t] = _choose(scheme, sigma)
        noise = motion.large_noise if scheme.rule == Rule.NOISE and alert[t] else motion.noise
        centres = predict(states, motion.transition, motion.offset)
        first_stage, log_g, log_mean_g = log_weights, log_weights, 0.0
        if by_observation > 0:
            log_g = _log_likelihood(picture, centres, likelihood)
            first_stage, log_mean_g = normalise(log_weights + log_g)
            if log_mean_g == -np.inf:
                by_observation = 0
        resampled[t] = by_observation > 0 or _must_resample(scheme, log_weights)
        draws = 0
        if resampled[t]:
            ancestors, draws = _parents(scheme, log_weights, first_stage, by_observation, place)
        else:
            ancestors = np.arange(scheme.sample_count)
        normals = standard_normals(*place, TRACK, draws, scheme.sample_count * noise.shape[1])
        normals = normals.reshape(noise.shape[1], scheme.sample_count)
        _widen(normals, scheme, alert[t])
        states = diffuse(centres, ancestors, noise, normals)
        scores = _log_likelihood(picture, states, likelihood)
        if by_observation > 0 and scheme.corrected:
            scores += correction(log_g[ancestors], log_mean_g, scheme.sample_count - by_observation, scheme.balanced)
        if not resampled[t]:
            scores += log_weights
        log_weights, log_evidences[t] = normalise(scores)
        if resampled[t]:
            log_evidences[t] -= np.log(scheme.sample_count)
        observation_counts[t] = by_observation
        # Of the last frame all moments are wanted, of the others those of the position.
        weights = exponentials(log_weights)
        mean, covariance = moments(states if t == frames - 1 else states.T[:2].T, weights)
        sigma = np.empty(2)
        for axis in range(2):
            estimates[t, axis] = mean[axis]
            sigma[axis] = np.sqrt(covariance[axis, axis])
    return Loop(
        states.T,
        log_weights,
        ancestors,
        mean,
        covariance,
        estimates,
        log_evidences,
        observation_counts,
        resampled,
        alert,
    )


@cache
def loop_with(log_likelihood: LogLikelihood) -> Callable[..., Loop]:
    """Return the loop, to be compiled around a likelihood when it runs first.

    A compiled function calls another one as fast as its own lines only if it knows it when it is compiled; and what is
    compiled is kept on disk by the name of the function. So each likelihood has a copy of the loop, of its own name,
    in which the global `_log_likelihood` is that likelihood.

    Args:
        log_likelihood: (picture, states (N, d), packed parameters) -> (N,); compiled, of a module.
    """
    own = FunctionType(_loop.__code__, {**globals(), _log_likelihood.__name__: log_likelihood}, _loop.__name__)
    own.__annotations__ = _loop.__annotations__
    own.__qualname__ = "loop_" + f"{log_likelihood.__module__}_{log_likelihood.__qualname__}".replace(".", "_")
    return compiled(own)


@compiled
def _choose(scheme: Scheme, sigma: Floats) -> tuple[int, bool]:
    """Return how many particles to draw by observation, and whether the tracker is alert."""
    if scheme.rule == Rule.OBSERVATION:
        return scheme.sample_count, True
    if scheme.rule == Rule.HARD:
        by_observation = hard(sigma, scheme.gamma, scheme.sample_count)
        return by_observation, by_observation > 0
    if scheme.rule == Rule.SOFT:
        by_observation = soft(sigma, scheme.gamma_min, scheme.gamma_max, scheme.sample_count)
        return by_observation, by_observation > 0
    return 0, scheme.rule == Rule.NOISE and exceeds(sigma, scheme.gamma)


@compiled
def _widen(normals: Floats, scheme: Scheme, alert: bool) -> None:
    """Make the noise on the position (the first two rows) of some of the particles larger."""
    if scheme.wide_every > 0 and not (scheme.rule == Rule.NOISE and alert):
        for n in range(0, scheme.sample_count, scheme.wide_every):
            for axis in range(2):
                normals[axis, n] *= scheme.wide_factor


@compiled
def _must_resample(scheme: Scheme, log_weights: Floats) -> bool:
    if scheme.threshold >= 1.0 or scheme.sample_count != log_weights.shape[0]:
        return True
    weights = exponentials(log_weights)
    return bool(1.0 / inner_product(weights, weights) < scheme.threshold * scheme.sample_count)


@compiled
def _parents(
    scheme: Scheme,
    log_weights: Floats,
    first_stage: Floats,
    by_observation: int,
    place: tuple[int, int],
) -> tuple[Ints, int]:
    """Return the parents, those by prediction first, and how many draws that took."""
    if by_observation == 0:
        return parents(scheme.resampling, log_weights, scheme.sample_count, *place, TRACK, 0), 1
    if by_observation == scheme.sample_count:
        return parents(scheme.resampling, first_stage, scheme.sample_count, *place, TRACK, 0), 1
    predicted = parents(scheme.resampling, log_weights, scheme.sample_count - by_observation, *place, TRACK, 0)
    observed = parents(scheme.resampling, first_stage, by_observation, *place, TRACK, 1)
    return np.concatenate((predicted, observed)), 2
