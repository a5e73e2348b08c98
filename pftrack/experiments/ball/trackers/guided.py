"""A tracker of a ball whose particles move as the ball did in recorded runs (`pftrack.filters.learning`).

It is Condensation but for the diffusion: in place of one process noise for both axes, accelerations are drawn from the
learned covariance, in the frame of the picture or in that of the ball's last motion. A ball has no heading, so what
Mitsugami et al. learn of a fish's shape is missing here, and what is left is the spread of its accelerations.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from pftrack.core.model.frame import Frame
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Stream
from pftrack.experiments.ball.trackers.common import lineage_of, start
from pftrack.experiments.ball.trackers.learned import GUIDANCE
from pftrack.experiments.ball.trackers.likelihood import LIKELIHOOD, colour_model
from pftrack.experiments.ball.trackers.motion import TRACKED
from pftrack.experiments.ball.trackers.parameters import BallTrackerParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import cloud_of, particles_of, picture_of
from pftrack.experiments.shared.sampling.samplers import measure_particles
from pftrack.filters import bootstrap
from pftrack.filters.learning.guided import GuidedDynamics
from pftrack.filters.resampling import RESAMPLERS
from pftrack.vision.likelihoods import chromaticity

__all__ = ["GUIDED"]


def step_guided(state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream) -> PointState:
    """Draw every particle by the learned diffusion."""
    image, model = picture_of(frame), colour_model(parameters)
    particles = particles_of(state, parameters, rng)
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
    measure=measure_particles,
    evidence="relative",  # all particles are drawn by prediction, so it is their mean likelihood
    likelihood=LIKELIHOOD,
    cloud=partial(cloud_of, ()),
)
