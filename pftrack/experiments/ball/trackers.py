"""Trackers of a ball by its colour: the filters of Bando 2007, ch. 3, with the likelihood of its section 2.2.

All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in how the posterior of the
next frame is sampled. Those that draw by prediction or by observation share one compiled loop
(`pftrack.experiments.shared.sampling`), and differ in the rule by which it chooses. Whether the dynamics are learned
and the path smoothed is the same for all.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.model import Model
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.ball import model
from pftrack.experiments.ball.model import (
    CHROMATICITY,
    KALMAN,
    MODEL,
    TRACKED,
    UNSCENTED,
    colour_model,
    learn_motion,
    lineage_of,
    noise,
    start,
    with_learner,
)
from pftrack.experiments.ball.parameters import GUIDANCE, BallTrackerParameters, LoopParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sampling.loop import Loop, Motion, Rule
from pftrack.experiments.shared.sampling.samplers import (
    SAMPLERS,
    Likelihood,
    advance,
    fold,
    scheme,
    size_of,
)
from pftrack.filters import bootstrap
from pftrack.filters.learning.guidance import GuidedDynamics
from pftrack.filters.resampling import RESAMPLERS
from pftrack.vision.likelihoods import chromaticity

# The guided tracker is Condensation but for the diffusion: in place of one process noise for both axes, accelerations
# are drawn from the learned covariance, in the frame of the picture or in that of the ball's last motion. A ball has no
# heading, so what Mitsugami et al. learn of a fish's shape is missing here, and what is left is the spread of its
# accelerations.


def step_guided(state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream) -> PointState:
    """Draw every particle by the learned diffusion."""
    image, model = frame.picture, colour_model(parameters)
    particles = MODEL.particles(state, parameters, rng)
    diffusion = GUIDANCE.parse(parameters.learned).diffusion(
        parameters.guided_frame, scale=parameters.diffusion_scale, correlated=parameters.correlated_changes
    )
    places, before = particles.states[:, :TRACKED], particles.states[:, TRACKED:]
    posterior = bootstrap.step(
        replace(particles, states=np.hstack([places, places - before])),
        GuidedDynamics(diffusion, GUIDANCE.chart, parameters.guided_frame),
        lambda states: chromaticity.log_likelihood(image, states, model, parameters.background_level),
        rng,
        count=parameters.sample_count,
        resample=RESAMPLERS[parameters.resampling],
    )
    drawn = posterior.particles
    states = np.asfortranarray(np.hstack([drawn.states[:, :TRACKED], places[drawn.ancestors]]))
    drawn = replace(drawn, states=states)
    return PointState(
        Gaussian(*drawn.moments),
        TRACKED,
        drawn,
        log_evidence=posterior.log_evidence,
        resampled=posterior.resampled,
        alert=False,
        lineage=lineage_of(state, particles, drawn, parameters),
    )


GUIDED = Tracker(
    "guided",
    "Guided diffusion",
    "Draws every particle by prediction, with accelerations as they were learned from recorded runs.",
    start,
    step_guided,
    series=reports.CLOUD,
    measure=MODEL.measure,
    model=MODEL,
    sampling="prior",
)


def step_loop(
    likelihood: Likelihood,
    rule: Rule,
    state: PointState,
    frame: Frame,
    parameters: LoopParameters,
    rng: Stream,
) -> PointState:
    """Take one frame by prediction, by observation, or by what the rule makes of the last posterior."""
    image = frame.picture
    size = size_of(image)
    state = with_learner(state, size, parameters)
    particles = MODEL.particles(state, parameters, rng)
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
    dynamics = model.dynamics_of(state, parameters, size)
    return Motion(dynamics.transition, dynamics.offset, dynamics.noise, noise(parameters.large_process_noise_px))


def loop_trackers(likelihood: Likelihood, belief: Model | None = None) -> tuple[Tracker, ...]:
    """Return the trackers that share the loop, weighing by a likelihood; their parameters are `LoopParameters`.

    Args:
        likelihood: Compiled into the loop.
        belief: The model that it belongs to.
    """
    return tuple(
        sampler.tracker(
            start,
            partial(step_loop, likelihood, sampler.rule),
            partial(fold_loop, likelihood, sampler.rule),
            model=belief,
        )
        for sampler in SAMPLERS
    )


_BY_NAME = {tracker.id: tracker for tracker in (*loop_trackers(CHROMATICITY, MODEL), UNSCENTED, KALMAN, GUIDED)}

TRACKERS: dict[str, Tracker] = {
    name: _BY_NAME[name] for name in ("h-spf", "s-spf", "condensation", "apf", "upf", "pc-pf", "kalman", "guided")
}
"""The trackers of a ball, by name, in the order in which they are shown."""
