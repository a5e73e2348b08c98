"""Trackers by colour histograms: the samplers of Bando 2007 with the likelihood of Pérez et al. 2002.

All carry position and velocity, and the size of the window beside the first one, which stays as it is unless it is to
be followed. Condensation is the lecture's filter (SIR): a time update with constant velocity, weights by the
likelihood, systematic resampling in every frame. The others draw parents with regard to the new picture, always or when
they are unsure, by the same likelihood.
"""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Stream
from pftrack.experiments.histogram.trackers.camera import first_view, follow_camera
from pftrack.experiments.histogram.trackers.greedy import GREEDY
from pftrack.experiments.histogram.trackers.inspection import LIKELIHOOD
from pftrack.experiments.histogram.trackers.likelihood import HISTOGRAM, pack
from pftrack.experiments.histogram.trackers.model import counted, first_look, judge, with_model
from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.reports import PARTICLE_SERIES, measure_particles
from pftrack.experiments.histogram.trackers.search import search
from pftrack.experiments.histogram.trackers.state import DIMENSION, SIZE, HistogramState
from pftrack.experiments.shared.sampling.common import particles_of, picture_of
from pftrack.experiments.shared.sampling.loop import Loop, Motion, Rule
from pftrack.experiments.shared.sampling.samplers import SAMPLERS, advance, fold, scheme
from pftrack.filters.particles import ParticleSet, normalise

__all__ = ["TRACKERS", "motion", "start"]


def start(target: Target, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Begin at a known place: particles around it, weighed by the first picture."""
    image = picture_of(frame)
    look = first_look(image, target.position, parameters)
    normals = rng.standard_normal((4, parameters.sample_count))
    coordinates = np.zeros((DIMENSION, parameters.sample_count))
    coordinates[:2] = target.position[:, None] + parameters.process_noise_px * normals[:2]
    coordinates[2:4] = parameters.initial_velocity_px * normals[2:]
    state = HistogramState(
        Gaussian(np.zeros(DIMENSION), np.eye(DIMENSION)),
        2,
        look=look,
        view=first_view(image, parameters),
        **counted(look, parameters),
    )
    known = pack(state, parameters.sharpness)
    log_weights, log_sum = normalise(HISTOGRAM.log_likelihood(read_only(image), coordinates.T, known))
    particles = ParticleSet(coordinates.T, log_weights, np.arange(parameters.sample_count))
    log_evidence = log_sum - normalise(np.zeros(len(log_weights)))[1]
    begun = replace(state, posterior=Gaussian(*particles.moments), particles=particles, log_evidence=log_evidence)
    return judge(begun, image, parameters)


def step(
    rule: Rule, state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream
) -> HistogramState:
    """Take one frame by prediction, by observation, or by what the rule makes of the last posterior."""
    image = picture_of(frame)
    state = follow_camera(with_model(state, parameters), image, parameters)
    if state.searching and parameters.find_again:
        return search(state, image, parameters, rng)
    state = replace(state, particles=particles_of(state, parameters, rng))
    result = _loop(rule, state, image[None], parameters, rng.seed, rng.frame)
    return judge(advance(state, result), image, parameters)


def fold_loop(
    rule: Rule,
    state: HistogramState,
    pictures_rgb: NDArray[np.uint8],
    parameters: HistogramTrackerParameters,
    seed: int,
    first_frame: int,
) -> Fold | None:
    """Take many frames at once, unless something is to be decided or learned between them."""
    if parameters.follow_size or parameters.follow_camera or parameters.find_again or parameters.renewal_rate > 0.0:
        return None
    result = _loop(rule, state, pictures_rgb, parameters, seed, first_frame)
    last = judge(advance(state, result), pictures_rgb[-1], parameters)
    boxes = np.tile(last.box_px, (len(pictures_rgb), 1))
    return Fold(last, result.estimates, {**fold(state, result).series, "box": boxes})


def _loop(
    rule: Rule,
    state: HistogramState,
    pictures_rgb: NDArray[np.uint8],
    parameters: HistogramTrackerParameters,
    seed: int,
    first_frame: int,
) -> Loop:
    particles = state.particles
    if particles is None:
        raise ValueError("the loop needs particles to begin with")
    result: Loop = HISTOGRAM.loop(
        read_only(pictures_rgb),
        np.ascontiguousarray(particles.states.T),
        particles.log_weights,
        state.sigma,
        motion(parameters),
        pack(state, parameters.sharpness),
        scheme(rule, parameters, *_wide(parameters)),
        seed,
        first_frame,
    )
    return result


def _wide(parameters: HistogramTrackerParameters) -> tuple[int, float]:
    """Return which of how many particles moves further, 0 for none, and how many times as far."""
    every = round(1.0 / parameters.wide_share) if parameters.wide_share > 0.0 else 0
    return every, parameters.wide_noise_px / parameters.process_noise_px


@lru_cache(maxsize=64)
def motion(parameters: HistogramTrackerParameters) -> Motion:
    """Return x' = x + r v + s_p n, v' = r v + s_v n, and a random walk of the logarithm of the size."""
    transition = np.eye(DIMENSION)
    for axis in range(2):
        transition[axis, 2 + axis] = transition[2 + axis, 2 + axis] = parameters.velocity_retention

    def noise(of_position: float) -> NDArray[np.float64]:
        """Return B, without a column for a size that stays as it is."""
        of_velocity = parameters.velocity_noise_px
        deviations = np.array([of_position, of_position, of_velocity, of_velocity, parameters.size_noise])
        return np.ascontiguousarray(np.diag(deviations)[:, : DIMENSION if parameters.follow_size else SIZE])

    small, large = noise(parameters.process_noise_px), noise(parameters.large_process_noise_px)
    return Motion(transition, np.zeros(DIMENSION), small, large)


def _searching(state: HistogramState) -> bool | None:
    return state.searching


_BY_NAME = {
    sampler.name: sampler.tracker(
        start,
        partial(step, sampler.rule),
        partial(fold_loop, sampler.rule),
        PARTICLE_SERIES,
        measure_particles,
        _searching,
        LIKELIHOOD,
    )
    for sampler in SAMPLERS
}

TRACKERS: dict[str, Tracker] = {
    **{name: _BY_NAME[name] for name in ("condensation", "apf", "h-spf", "s-spf", "pc-pf")},
    GREEDY.id: GREEDY,
}
"""The trackers by name, in the order in which they are shown."""
