"""Trackers of a ball by its colour: the filters of Bando 2007, ch. 3, with the likelihood of its section 2.2.

All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in how the posterior of the
next frame is sampled. Those that draw by prediction or by observation share one compiled loop, `loop`, and differ
in the rule by which it chooses. Whether the dynamics are learned and the path smoothed is the same for all.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.likelihood import ObservationLikelihood
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Stream
from pftrack.experiments.ball.trackers import motion
from pftrack.experiments.ball.trackers.centroid import KALMAN, UNSCENTED
from pftrack.experiments.ball.trackers.common import lineage_of, start
from pftrack.experiments.ball.trackers.guided import GUIDED
from pftrack.experiments.ball.trackers.likelihood import CHROMATICITY, LIKELIHOOD
from pftrack.experiments.ball.trackers.motion import learn_motion, noise, with_learner
from pftrack.experiments.ball.trackers.parameters import LoopParameters
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import particles_of, picture_of, size_of
from pftrack.experiments.shared.sampling.likelihood import Likelihood
from pftrack.experiments.shared.sampling.loop import Loop, Motion, Rule
from pftrack.experiments.shared.sampling.samplers import SAMPLERS, advance, fold, scheme

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
    tracked = advance(state, result)
    lineage = lineage_of(state, particles, tracked.particles, parameters)
    return learn_motion(replace(tracked, learner=state.learner, lineage=lineage), parameters, size)


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
    return fold(state, result)


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
        scheme(rule, parameters),
        seed,
        first_frame,
    )
    return result


def _motion(state: PointState, parameters: LoopParameters, size: tuple[int, int]) -> Motion:
    dynamics = motion.dynamics(state, parameters, size)
    return Motion(dynamics.transition, dynamics.offset, dynamics.noise, noise(parameters.large_process_noise_px))


def loop_trackers(likelihood: Likelihood, asked: ObservationLikelihood | None = None) -> tuple[Tracker, ...]:
    """Return the trackers that share the loop, weighing by a likelihood; their parameters are `LoopParameters`.

    Args:
        likelihood: Compiled into the loop.
        asked: The same, to be asked at any state.
    """
    return tuple(
        sampler.tracker(
            start,
            partial(step_loop, likelihood, sampler.rule),
            partial(fold_loop, likelihood, sampler.rule),
            likelihood=asked,
        )
        for sampler in SAMPLERS
    )


_BY_NAME = {tracker.id: tracker for tracker in (*loop_trackers(CHROMATICITY, LIKELIHOOD), UNSCENTED, KALMAN, GUIDED)}

TRACKERS: dict[str, Tracker] = {
    name: _BY_NAME[name] for name in ("h-spf", "s-spf", "condensation", "apf", "upf", "pc-pf", "kalman", "guided")
}
"""The trackers of a ball, by name, in the order in which they are shown."""
