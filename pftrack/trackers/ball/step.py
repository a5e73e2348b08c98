"""Trackers of a ball by its colour: the filters of document 1, ch. 3, with the likelihood of its section 2.2.

All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in how the posterior of the
next frame is sampled. Those that draw by prediction or by observation share one compiled loop, `loop`, and differ
in the rule by which it chooses. Whether the dynamics are learned and the path smoothed is the same for all.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from pftrack.compiled import read_only
from pftrack.frame import Frame
from pftrack.gaussian import Gaussian
from pftrack.particles import ParticleSet
from pftrack.random import Stream
from pftrack.resampling import RESAMPLERS
from pftrack.series import SeriesValue
from pftrack.trackers import reports
from pftrack.trackers.ball import motion
from pftrack.trackers.ball.centroid import KALMAN, UNSCENTED
from pftrack.trackers.ball.common import lineage_of, measure_particles, particles_of, picture_of, size_of, start
from pftrack.trackers.ball.likelihood import CHROMATICITY, Likelihood
from pftrack.trackers.ball.loop import Loop, Motion, Rule, Scheme
from pftrack.trackers.ball.motion import TRACKED, learned, noise, with_learner
from pftrack.trackers.ball.parameters import LoopParameters
from pftrack.trackers.point_state import PointState
from pftrack.trackers.tracker import Fold, Tracker

__all__ = ["TRACKERS", "fold_loop", "loop_trackers", "step_loop"]


def step_loop(
    likelihood: Likelihood,
    rule: Rule,
    state: PointState,
    frame: Frame,
    parameters: LoopParameters,
    rng: Stream,
) -> PointState:
    """Take one frame by prediction, by observation, or by what the rule makes of the last posterior."""
    image = picture_of(frame)
    size = size_of(image)
    state = with_learner(state, size, parameters)
    particles = particles_of(state, parameters, rng)
    begun = replace(state, particles=particles)
    result = _loop(likelihood, rule, begun, image[None], parameters, rng.seed, rng.frame)
    tracked = _last(result, state)
    lineage = lineage_of(state, particles, tracked.particles, parameters)
    return learned(replace(tracked, learner=state.learner, lineage=lineage), parameters, size)


def fold_loop(
    likelihood: Likelihood,
    rule: Rule,
    state: PointState,
    pictures_rgb: NDArray[np.uint8],
    parameters: LoopParameters,
    seed: int,
    first_frame: int,
) -> Fold | None:
    """Take many frames at once, unless the dynamics are to be learned between them."""
    if parameters.learn_dynamics:
        return None
    result = _loop(likelihood, rule, state, pictures_rgb, parameters, seed, first_frame)
    observed = result.observation_counts
    # The first step of all has no earlier one to differ from.
    before = result.alert[0] if state.alert is None else state.alert
    switched = result.alert != np.append(before, result.alert[:-1])
    return Fold(
        _last(result, state),
        result.estimates,
        {
            "samples": np.column_stack([parameters.sample_count - observed, observed]).astype(np.float64),
            "switched": switched.astype(np.float64),
        },
    )


def measure_loop(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles, and from which sampler they came."""
    if state.particles is None:
        return {}
    predicted = len(state.particles) - state.observation_count
    return {**measure_particles(state), "samples": (float(predicted), float(state.observation_count))}


def measure_switching(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the same, and whether another sampler or another noise was used than in the frame before."""
    return {**measure_loop(state), "switched": float(state.switched)}


def _loop(
    likelihood: Likelihood,
    rule: Rule,
    state: PointState,
    pictures_rgb: NDArray[np.uint8],
    parameters: LoopParameters,
    seed: int,
    first_frame: int,
) -> Loop:
    particles = state.particles
    if particles is None:
        raise ValueError("the loop needs particles to begin with")
    result: Loop = likelihood.loop(
        read_only(pictures_rgb),
        np.ascontiguousarray(particles.states.T),
        particles.log_weights,
        state.sigma,
        _motion(state, parameters, size_of(pictures_rgb[0])),
        likelihood.packed(parameters),
        _scheme(rule, parameters),
        seed,
        first_frame,
    )
    return result


def _last(result: Loop, before: PointState) -> PointState:
    """Return the state of the last frame of a loop."""
    alert = bool(result.alert[-1])
    earlier = bool(result.alert[-2]) if len(result.alert) > 1 else before.alert
    return PointState(
        Gaussian(result.mean, result.covariance),
        TRACKED,
        ParticleSet(result.coordinates.T, result.log_weights, result.ancestors),
        int(result.observation_counts[-1]),
        float(result.log_evidences[-1]),
        bool(result.resampled[-1]),
        switched=earlier is not None and alert != earlier,
        alert=alert,
    )


@lru_cache(maxsize=64)
def _scheme(rule: Rule, parameters: LoopParameters) -> Scheme:
    return Scheme(
        rule.value,
        parameters.sample_count,
        # A default may be written as a whole number; compiled code would be compiled once more for that.
        float(parameters.gamma_px),
        float(parameters.gamma_min_px),
        float(parameters.gamma_max_px),
        parameters.apf_weights != "sharpened",
        parameters.apf_weights == "balanced",
        list(RESAMPLERS).index(parameters.resampling),
        float(parameters.resampling_threshold),
    )


def _motion(state: PointState, parameters: LoopParameters, size: tuple[int, int]) -> Motion:
    dynamics = motion.dynamics(state, parameters, size)
    return Motion(dynamics.transition, dynamics.offset, dynamics.noise, noise(parameters.large_process_noise_px))


def loop_trackers(likelihood: Likelihood) -> tuple[Tracker, ...]:
    """Return the trackers that share the loop, weighing by a likelihood; their parameters are `LoopParameters`."""
    return tuple(
        _loop_tracker(likelihood, *declared)
        for declared in (
            (
                "h-spf",
                "Hard switching (h-SPF)",
                "Draws by prediction while it is sure and wholly by observation when it is not.",
                Rule.HARD,
            ),
            (
                "s-spf",
                "Soft switching (s-SPF)",
                "Draws a share of the particles by observation that grows with its uncertainty.",
                Rule.SOFT,
            ),
            (
                "condensation",
                "Condensation",
                "Draws every particle by prediction: the bootstrap filter.",
                Rule.PREDICTION,
            ),
            (
                "apf",
                "Auxiliary (APF)",
                "Draws every parent with regard to the new picture.",
                Rule.OBSERVATION,
            ),
            (
                "pc-pf",
                "Process-noise control (PC-PF)",
                "Draws by prediction, with more process noise when it is unsure.",
                Rule.NOISE,
            ),
        )
    )


def _loop_tracker(likelihood: Likelihood, name: str, title: str, description: str, rule: Rule) -> Tracker:
    alert = (reports.ALERT,) if rule in {Rule.HARD, Rule.SOFT, Rule.NOISE} else ()
    return Tracker(
        name,
        title,
        description,
        start,
        partial(step_loop, likelihood, rule),
        partial(fold_loop, likelihood, rule),
        series=(*reports.CLOUD, reports.SAMPLERS, *alert),
        measure=measure_switching if alert else measure_loop,
    )


_BY_NAME = {tracker.id: tracker for tracker in (*loop_trackers(CHROMATICITY), UNSCENTED, KALMAN)}

TRACKERS: dict[str, Tracker] = {
    name: _BY_NAME[name] for name in ("h-spf", "s-spf", "condensation", "apf", "upf", "pc-pf", "kalman")
}
"""The trackers of a ball, by name, in the order in which they are shown."""
