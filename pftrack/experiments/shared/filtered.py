"""A model joined with a filter is a tracker: the particle filter and the Kalman filter of a family's model.

    TRACKERS = filtered(Signal(), Bootstrap("condensation", "Condensation", "..."), Kalman("kalman", "...", "..."))

`PointModel` is the model of one point or signal, whose states are `PointState`: reports, the start of a run, and
continuation from particles are the same for all. Where a model is linear, the particle filter also carries the exact
answer.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, Generic, TypeVar

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Cloud, Component, Part, Residual
from pftrack.core.model.model import FilterModel, LinearStep, State, Values
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Gaussian, Generator, Purpose, Stream
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.reports import PointState
from pftrack.filters import bootstrap, kalman
from pftrack.filters.dynamics import Sampled
from pftrack.filters.kalman import Innovation, NormalisedInnovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import RESAMPLERS, Resampler


@dataclass(frozen=True, slots=True)
class Update:
    """Results of a filter's step.

    Attributes:
        particles: The posterior.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether the particles were resampled.
        repeatable: Whether each repetition of the step, as far as one was tried, gave the same numbers.
        moments: Mean (d,) and covariance (d, d) of the particles, where the filter has computed them.
        observation_count: Number of particles from the observation sampler; they are the last ones.
        samplers: Names of what draws by prediction and by observation, where there is a choice.
        switched: Whether another sampler, or another process noise, was used than in the frame before.
        alert: Whether the filter doubts the prediction more than in calm times; None where it never does.
    """

    particles: ParticleSet
    log_evidence: float
    resampled: bool
    repeatable: bool = True
    moments: tuple[Floats, Floats] | None = None
    observation_count: int = 0
    samplers: tuple[str, ...] = ()
    switched: bool = False
    alert: bool | None = None

    @property
    def posterior(self) -> Gaussian:
        """Mean and covariance of the particles."""
        return Gaussian(*(self.moments or self.particles.moments))


class PointModel(FilterModel):
    """The belief in one point or signal; the first coordinates of its state are the estimate.

    Attributes:
        instants: Number of frames whose places a state begins with, the newest first: all are moved together, so a
            target moved by the user keeps its velocity.
    """

    instants: int = 1

    @override
    def start(self, target: Target, frame: Frame, parameters: Values, rng: Stream) -> PointState:
        """Begin with particles as the model draws them, and what is known of the place; see `prior`."""
        states = self.begin(target, parameters, rng, self.count(parameters))
        known = self.prior(target, parameters)
        reference = known if self.scales else None
        return PointState(known, len(target.position), ParticleSet.uniform(states), reference=reference)

    def prior(self, target: Target, parameters: Values) -> Gaussian:
        """Return p(x_0) as mean and covariance (d,), (d, d); a model that defines `start` may do without."""
        del target, parameters
        raise TypeError(f"the model {type(self).__name__} must define prior or start")

    def begin(self, target: Target, parameters: Values, rng: Generator, count: int) -> Floats:
        """Return states (count, d) of frame 0, drawn from p(x_0)."""
        return self.prior(target, parameters).sample(rng, count)

    def particles(self, state: State, parameters: Values, rng: Stream) -> ParticleSet:
        """Return the particles, drawn from the posterior if a filter without particles was at work before."""
        if isinstance(state.particles, ParticleSet):
            return state.particles
        fresh = Stream(rng.seed, rng.frame, Purpose.START)
        return ParticleSet.uniform(state.posterior.sample(fresh, self.count(parameters)))

    def with_particles(self, known: State, parameters: Values, rng: Stream) -> State:
        """Return the state with its particles; see `particles`."""
        particles = self.particles(known, parameters, rng)
        return known if known.particles is particles else replace(known, particles=particles)

    def believe(self, known: State, update: Update, frame: Frame, parameters: Values) -> PointState:
        """Return the posterior of the particles, and the exact one where known."""
        prior = known.reference or known.posterior
        linear = self.linear(frame, parameters, known) if self.scales and frame.index else None
        exact = condition(kalman.predict(prior, linear.dynamics), linear)[0] if linear else prior
        return PointState(
            update.posterior,
            known.tracked,
            update.particles,
            update.observation_count,
            update.log_evidence,
            update.resampled,
            update.switched,
            update.alert,
            learner=known.learner,
            reference=exact if self.scales else None,
            repeatable=update.repeatable,
            samplers=update.samplers,
        )

    @override
    def count(self, parameters: Values) -> int:
        return int(parameters.sample_count)

    @override
    def moved(self, state: PointState, particle: int | None, place: Floats) -> PointState:
        particles, tracked = state.particles, state.tracked
        before = state.estimate if particle is None or particles is None else particles.states[particle, :tracked]
        shift = np.zeros(len(state.posterior.mean))
        shift[: self.instants * tracked] = np.tile(place - before, self.instants)
        if particles is not None:
            particles = particles.shifted(shift, particle)
        if particle is None or particles is None:
            posterior = replace(state.posterior, mean=state.posterior.mean + shift)
        else:
            posterior = Gaussian(*particles.moments)
        return replace(state, particles=particles, posterior=posterior)

    def learn(self, state: PointState, frame: Frame, parameters: Values) -> PointState:
        """Return the state of an exact filter with what its estimate teaches, where something is learned."""
        del frame, parameters
        return state

    @override
    def cloud(self, state: State) -> Cloud | None:
        particles = state.particles
        if particles is None:
            return None
        counts = (len(particles) - state.observation_count, state.observation_count) if state.samplers else ()
        arrays = particles.states, particles.log_weights, particles.ancestors
        return Cloud(*arrays, counts, state.samplers, state.resampled)

    @property
    def series(self) -> tuple[Series, ...]:
        """The particles, and the exact answer where it is known."""
        return (*reports.CLOUD, reports.EXACT) if self.scales else reports.CLOUD

    def measure(self, state: State) -> Mapping[str, SeriesValue]:
        """Report the particles, and the exact answer."""
        if state.particles is None or (self.scales and state.reference is None):
            return {}
        values = reports.cloud(state.particles, resampled=state.resampled)
        exact = state.reference if self.scales else None
        return values if exact is None else {**values, "exact": tuple(exact.mean[: state.tracked].tolist())}

    def update_parts(self, before: PointState, state: PointState, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return the innovation of a linear model; nothing where the measurement is missing."""
        if not (self.scales and frame.index) or state.particles is not None:
            return ()
        known = self.prepare(before, frame, parameters)
        linear = self.linear(frame, parameters, known)
        if linear is None or linear.measurement is None:
            return ()
        predicted = kalman.predict(known.reference or known.posterior, linear.dynamics)
        innovation = kalman.innovate(predicted, linear.measurement, linear.observation, linear.covariance)
        return innovation_parts(self.components(parameters)[: state.tracked], linear.measurement, innovation)


def condition(predicted: Gaussian, linear: LinearStep) -> tuple[Gaussian, float]:
    """Return p(x_t | z_{1:t}) and log p(z_t | z_{1:t-1}); the prediction and 0 without a measurement."""
    if linear.measurement is None:
        return predicted, 0.0
    return kalman.update(predicted, linear.measurement, linear.observation, linear.covariance)


M = TypeVar("M", bound=PointModel)
M_contra = TypeVar("M_contra", bound=PointModel, contravariant=True)


@dataclass(frozen=True)
class Filter(ABC, Generic[M_contra]):
    """A way of computing the posterior of a model.

    Attributes:
        id: Name of the tracker.
        title: On the screen; empty where `experiment.yaml` gives it.
        description: One sentence on the method; empty where `experiment.yaml` gives it.
    """

    id: str
    title: str = ""
    description: str = ""

    def join(self, model: M_contra) -> Tracker:
        """Return the tracker of a model; by default one that begins and reports as the model defines."""
        return Tracker(
            self.id,
            model.start,
            partial(self.step, model),
            self.title,
            self.description,
            series=model.series,
            measure=model.measure,
            model=model,
        )

    @abstractmethod
    def step(self, model: M_contra, state: Any, frame: Frame, parameters: Values, rng: Stream) -> PointState:  # noqa: ANN401
        """Return the state of a frame, given that of the frame before."""


class Bootstrap(Filter[PointModel]):
    """The bootstrap filter: samples from the dynamics, and weighs by the likelihood (Bando 2007, ch. 2 section 3)."""

    @override
    def join(self, model: PointModel) -> Tracker:
        return replace(super().join(model), sampling="prior")

    @override
    def step(self, model: PointModel, state: PointState, frame: Frame, parameters: Values, rng: Stream) -> PointState:
        known = model.with_particles(model.prepare(state, frame, parameters), parameters, rng)
        posterior = bootstrap.step(
            known.particles,
            Sampled(lambda states, generator: model.propagate(states, frame, parameters, generator, known)),
            lambda states: model.log_likelihood(states, frame, parameters, known),
            rng,
            count=model.count(parameters),
            resample=resampler(parameters),
            threshold=resample_below(parameters),
        )
        update = Update(posterior.particles, posterior.log_evidence, posterior.resampled)
        return model.believe(known, update, frame, parameters)


def resampler(parameters: Values) -> Resampler:
    """Return the resampler that the parameters name; the systematic one if they name none."""
    return RESAMPLERS[getattr(parameters, "resampling", "systematic")]


def resample_below(parameters: Values) -> float:
    """Return the share of N below which the effective sample size calls for resampling (default 1)."""
    return float(getattr(parameters, "resampling_threshold", 1.0))


class Kalman(Filter[PointModel]):
    """The Kalman filter of a linear model, which computes the posterior exactly."""

    @override
    def join(self, model: PointModel) -> Tracker:
        return replace(
            super().join(model),
            start=partial(_start_exact, model),
            series=reports.NIS,
            measure=lambda state: measure_innovation(state.innovation),
            sampling="exact",
        )

    @override
    def step(self, model: PointModel, state: PointState, frame: Frame, parameters: Values, rng: Stream) -> PointState:
        known = model.prepare(state, frame, parameters)
        linear = model.linear(frame, parameters, known)
        if linear is None:
            raise ValueError(
                f"a Kalman filter needs a linear model; that of the {model.title} is not linear in this frame"
            )
        predicted = kalman.predict(known.reference or known.posterior, linear.dynamics)
        posterior, log_evidence = condition(predicted, linear)
        found = linear.measurement
        innovation = None if found is None else kalman.innovate(predicted, found, linear.observation, linear.covariance)
        following = PointState(
            posterior,
            known.tracked,
            log_evidence=log_evidence,
            learner=known.learner,
            innovation=innovation.normalised if innovation else None,
        )
        return model.learn(following, frame, parameters)


def _start_exact(model: PointModel, target: Target, frame: Frame, parameters: Values, rng: Stream) -> PointState:
    del frame, rng
    return PointState(model.prior(target, parameters), len(target.position))


def filtered(model: M, *filters: Filter[M]) -> dict[str, Tracker]:
    """Return the trackers of a model by name, one for each filter."""
    return {tracker.id: tracker for tracker in (each.join(model) for each in filters)}


# The normalised innovation squared (NIS) tells whether a Kalman filter is consistent, without the truth: on average it
# should equal the number of measured values, and exceed its limit in one frame of twenty. If it is larger, the filter
# is overconfident; if smaller, underconfident (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).

LIMIT_DIGITS = 6


def measure_innovation(innovation: NormalisedInnovation | None) -> Mapping[str, SeriesValue]:
    """Return the values of `reports.NIS`; none where nothing was measured."""
    if innovation is None:
        return {}
    squared, freedom = innovation
    return {"nis": squared, "nis_freedom": float(freedom), "nis_limit": _limit(freedom)}


def innovation_parts(measured: Sequence[Component], measurement: Floats, innovation: Innovation) -> tuple[Part, ...]:
    """Return the innovation of each value, the gain, and the normalised innovation squared with its limit of 95 %.

    Args:
        measured: The m coordinates of a state that are measured.
        measurement: (m,).
        innovation: Innovation of the measurement; value i belongs to the state's coordinate i.
    """
    deviations = np.sqrt(innovation.covariance.diagonal())
    parts: list[Part] = []
    for axis, one in enumerate(measured):
        found, expected = float(measurement[axis]), float(measurement[axis] - innovation.values[axis])
        parts.append(Residual(f"innovation, {one.name}", found, expected, float(deviations[axis]), one.unit))
    parts += [Amount(f"gain, {one.name}", float(innovation.gain[axis, axis])) for axis, one in enumerate(measured)]
    squared, freedom = innovation.normalised
    return (*parts, Amount("normalised innovation squared", squared, limit=_limit(freedom)))


@lru_cache(maxsize=64)
def _limit(freedom: int) -> float:
    # Rounded, since the last digits of a quantile hang on the library that computes it.
    return round(chi_square_limit(freedom), LIMIT_DIGITS)
