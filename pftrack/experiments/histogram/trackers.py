"""Trackers of a window by the histogram of its colours (Kagami 2012, after Pérez et al. 2002).

All carry position and velocity, and the size of the window beside the first one, which stays as it is unless it is to
be followed. Condensation is the lecture's filter (SIR): a time update with constant velocity, weights by the
likelihood, systematic resampling in every frame. The other samplers are those of Bando 2007: they draw parents with
regard to the new picture, always or when they are unsure, by the same likelihood.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import logarithm
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.histogram.model import (
    DIMENSION,
    HISTOGRAM,
    MODEL,
    SERIES,
    SIZE,
    VELOCITY,
    HistogramState,
    counted,
    first_look,
    first_view,
    follow_camera,
    judge,
    measure,
    motion,
    pack,
    with_model,
)
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.experiments.shared.sampling.loop import Loop, Rule
from pftrack.experiments.shared.sampling.samplers import SAMPLERS, advance, fold, scheme
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic
from pftrack.vision.likelihoods.counting import bin_table
from pftrack.vision.likelihoods.histogram import rho_map, roots_of, similarities

PARTICLE_SERIES = (Series("velocities", "different velocities", role="distinct"), *SERIES)
"""Of those with particles as well: where nothing is added to a velocity, resampling can only lose some of them."""


def measure_particles(state: HistogramState) -> Mapping[str, SeriesValue]:
    """Report the same, and how many different velocities the particles have."""
    if state.particles is None:
        return measure(state)
    x, y = state.particles.states[:, VELOCITY].T
    return {"velocities": float(len(np.unique(x + 1j * y))), **measure(state)}


# Greedy search carries one place instead of a cloud and predicts nothing, which is what the lecture sets out from: an
# object that is hidden for a moment, or passes a look-alike, is lost for good.

ROUNDING = 1.0 / 12.0
"""Variance of a place that is known to a pixel, px^2."""


def start(target: Target, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Begin at a known place."""
    del rng
    image = frame.picture
    look = first_look(image, target.position, parameters)
    state = HistogramState(
        _belief_at_rest(target.position[0], target.position[1], 0.0),
        2,
        look=look,
        view=first_view(image, parameters),
        **counted(look, parameters),
    )
    return judge(state, image, parameters)


def step(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream) -> HistogramState:
    """Go to the place within reach whose window is most like the model; the nearest among equals."""
    del rng
    image = frame.picture
    state = follow_camera(with_model(state, parameters), image, parameters)
    reach = np.arange(-parameters.search_reach_px, parameters.search_reach_px + 1.0)
    across, down = (axis.ravel() for axis in np.meshgrid(reach, reach))
    nearest_first = np.argsort(across * across + down * down, kind="stable")
    columns, rows = state.estimate[0] + across[nearest_first], state.estimate[1] + down[nearest_first]
    window = state.window
    found = similarities(
        read_only(image),
        columns,
        rows,
        np.full(len(columns), float(window.reach_across_px)),
        np.full(len(columns), float(window.reach_down_px)),
        bin_table(state.space),
        roots_of(state.model, state.background),
        window.kernel,
        window.parts,
        state.background,
    )
    best = int(found.argmax())
    moved = replace(
        state,
        posterior=_belief_at_rest(columns[best], rows[best], float(state.posterior.mean[SIZE])),
        particles=None,
        observation_count=0,
        log_evidence=0.0,
        resampled=False,
        switched=False,
        alert=None,
    )
    return judge(moved, image, parameters)


def _belief_at_rest(column: float, row: float, size: float) -> Gaussian:
    """Return the belief in a place, at rest."""
    mean = np.array([column, row, 0.0, 0.0, size])
    return Gaussian(mean, np.diag([ROUNDING, ROUNDING, 1.0, 1.0, 0.0]))


GREEDY = Tracker(
    "greedy",
    "Greedy search",
    "Goes to the best place near the last one, and predicts nothing.",
    start,
    step,
    series=SERIES,
    measure=measure,
    model=MODEL,
)

# While a lost target is not found, nothing is known of where it is but what the picture says: the particles are spread
# over all places in proportion to their likelihood. As soon as the best of them is alike enough, the tracker begins
# again there.

STEPS_A_WINDOW = 6
"""So many places are looked at along each side of a window."""


def search(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters, rng: Stream
) -> HistogramState:
    """Look for the target all over a picture, and begin again where it is found."""
    window = state.first_window
    step = max(min(window.size_px) // STEPS_A_WINDOW, 1)
    found = rho_map(image_rgb, window, state.space, state.model, step, state.background)
    rows, columns = np.unravel_index(np.arange(found.size), found.shape)
    places = np.column_stack([columns, rows]) * float(step) + step // 2
    best = int(found.argmax())
    count = parameters.sample_count
    if found.flat[best] >= parameters.found_likeness:
        chosen = np.full(count, best)
        log_evidence = 0.0
    else:
        log_weights, log_sum = normalise(parameters.sharpness * (found.ravel() - 1.0))
        log_evidence = float(log_sum - logarithm(np.array([found.size], np.float64))[0])
        chosen = systematic(rng, log_weights, count)
    states = np.zeros((count, DIMENSION))
    states[:, :2] = places[chosen] + step * (rng.random((2, count)).T - 0.5)
    states[:, 2:4] = parameters.initial_velocity_px * rng.standard_normal((2, count)).T
    particles = ParticleSet(states, normalise(np.zeros(count))[0], np.arange(count))
    begun = replace(
        state,
        posterior=Gaussian(*particles.moments),
        particles=particles,
        observation_count=count,
        log_evidence=log_evidence,
        resampled=True,
        switched=False,
        alert=None,
    )
    if found.flat[best] >= parameters.found_likeness:
        return judge(replace(begun, missed=0, searching=False), image_rgb, parameters)
    return replace(begun, likeness=float(found.flat[best]))


def step_window(
    rule: Rule, state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters, rng: Stream
) -> HistogramState:
    """Take one frame by prediction, by observation, or by what the rule makes of the last posterior."""
    image = frame.picture
    state = follow_camera(with_model(state, parameters), image, parameters)
    if state.searching and parameters.find_again:
        return search(state, image, parameters, rng)
    state = replace(state, particles=MODEL.particles(state, parameters, rng))
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


def _searching(state: HistogramState) -> bool | None:
    return state.searching


_BY_NAME = {
    sampler.name: sampler.tracker(
        MODEL.start,
        partial(step_window, sampler.rule),
        partial(fold_loop, sampler.rule),
        PARTICLE_SERIES,
        measure_particles,
        _searching,
        MODEL,
    )
    for sampler in SAMPLERS
}

TRACKERS: dict[str, Tracker] = {
    **{name: _BY_NAME[name] for name in ("condensation", "apf", "h-spf", "s-spf", "pc-pf")},
    GREEDY.id: GREEDY,
}
"""The trackers by name, in the order in which they are shown."""
