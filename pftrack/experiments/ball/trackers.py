"""Trackers of a ball by its colour: the filters of Bando 2007, ch. 3, with the likelihood of its section 2.2.

All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in how the posterior of the
next frame is sampled. Those that draw by prediction or by observation share one compiled loop
(`pftrack.experiments.shared.sampling`), and differ in the rule by which it chooses. Whether the dynamics are learned
and the path smoothed is the same for all.
"""

from dataclasses import dataclass, replace

from typing_extensions import override

from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Stream
from pftrack.experiments.ball.model import CENTROID, COLOURED, GUIDED, Centroid, dynamics_of
from pftrack.experiments.ball.parameters import BallTrackerParameters
from pftrack.experiments.shared.filtered import Bootstrap, Filter, Kalman, PointModel, Update, filtered, resampler
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sampling.samplers import AUXILIARY, CONDENSATION, HARD, NOISE_CONTROL, SOFT, size_of
from pftrack.filters import unscented_particle


@dataclass(frozen=True)
class Unscented(Filter[PointModel]):
    """The unscented particle filter: its proposal looks at what a linear model measures (Bando 2007, ch. 3 section 4).

    Attributes:
        measured: The linear model.
    """

    measured: Centroid

    @override
    def step(
        self, model: PointModel, state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream
    ) -> PointState:
        known: PointState = model.prepare(state, frame, parameters)
        particles = model.particles(known, parameters, rng)
        known = replace(known, particles=particles)
        linear = self.measured.linear(frame, parameters, known)
        posterior = unscented_particle.step(
            particles,
            dynamics_of(known, parameters, size_of(frame.picture)),
            lambda states: model.log_likelihood(states, frame, parameters, known),
            rng,
            measurement=linear.measurement,
            observe=lambda positions: positions,
            noise_covariance=linear.covariance,
            recursive=parameters.recursive_covariance,
            count=model.count(parameters),
            resample=resampler(parameters),
        )
        update = Update(posterior.particles, posterior.log_evidence, posterior.resampled)
        return model.believe(known, update, frame, parameters)


TRACKERS: dict[str, Tracker] = {
    **filtered(
        COLOURED,
        HARD,
        SOFT,
        CONDENSATION,
        AUXILIARY,
        Unscented(
            "upf",
            "Unscented (UPF)",
            "Draws every particle towards the colour centroid of the whole picture.",
            CENTROID,
        ),
        NOISE_CONTROL,
    ),
    **filtered(
        CENTROID,
        Kalman("kalman", "Kalman filter", "Follows the colour centroid of the whole picture with one Gaussian."),
    ),
    **filtered(
        GUIDED,
        Bootstrap(
            "guided",
            "Guided diffusion",
            "Draws every particle by prediction, with accelerations as they were learned from recorded runs.",
        ),
    ),
}
"""The trackers of a ball, by name, in the order in which they are shown."""
