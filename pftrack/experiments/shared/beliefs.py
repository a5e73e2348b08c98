"""The tracker of recorded beliefs, the interface of filters in files, and what updates of a Kalman filter tell.

A step of the tracker of recorded beliefs looks at its frame alone, but for the paths by which the particles came, which
their ancestors tell. Weights are made to sum to one, mean and covariance come from the particles where they were not
recorded, and effective sample size and different parents are counted as of any particle filter.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Cloud, ObservationLikelihood, Part, Residual
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.core.model.source import Belief, Beliefs, Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Generator, Stream
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.experiments.shared.reports import CLOUD
from pftrack.filters.fixed_lag import Lineage, begin_lineage, extend_lineage
from pftrack.filters.kalman import Innovation, NormalisedInnovation
from pftrack.filters.particles import ParticleSet, normalise

PATH_FRAMES = 30
"""So far back the ancestors of particles are followed."""

BOX = Series("box", "believed box", "px", "vector", role="extent", components=("width", "height"))
SCORE = Series("score", "score of the box")
ACROSS, DOWN = Series("across", "first component"), Series("down", "second component")
ACROSS_SD, DOWN_SD = Series("across_sd", "deviation of the first"), Series("down_sd", "deviation of the second")
TARGETS = Series("targets", "targets in the frame")


@dataclass(frozen=True, eq=False)
class BeliefState:
    """What was recorded of a frame, immutable.

    Attributes:
        beliefs: Of all targets.
        particles: Of the selected one, with weights that sum to one; None without.
        estimate: (tracked,) the chosen components of its mean, or the middle of its box.
        covariance: (tracked, tracked) of these; None where it is not known.
        paths: Where the particles' ancestors were in the frames before; None without ancestors.
    """

    beliefs: Beliefs
    particles: ParticleSet | None
    estimate: Floats
    covariance: Floats | None
    paths: Lineage | None = None

    @property
    def sigma(self) -> Floats:
        """(tracked,) standard deviations; NaN where they are not known."""
        if self.covariance is None:
            return np.full(len(self.estimate), np.nan)
        return np.asarray(np.sqrt(np.maximum(self.covariance.diagonal(), 0.0)))

    @property
    def log_evidence(self) -> float:
        """Nothing is known of it: 0."""
        return 0.0

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        held = [self.beliefs.selected, *self.beliefs.others]
        paths = 0 if self.paths is None else self.paths.paths.nbytes
        return 4096 + paths + sum(3 * one.particles.nbytes for one in held if one.particles is not None)

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles; empty without."""
        if self.particles is None:
            return {}
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}


def place_of(belief: Belief, components: tuple[int, ...]) -> Floats:
    """Return the chosen components of what is believed in the mean, (tracked,); NaN where nothing is."""
    mean = belief.mean
    if mean is None and belief.particles is not None:
        mean = _set_of(belief).mean
    if mean is not None and max(components) < len(mean):
        return mean[list(components)]
    if belief.centre is not None:
        return belief.centre[list(components)] if max(components) < 2 else belief.centre
    return np.full(len(components), np.nan)


def _set_of(belief: Belief) -> ParticleSet:
    states = belief.particles
    if states is None:
        raise ValueError("a set of particles needs particles, got a belief without")
    weights = np.zeros(len(states)) if belief.log_weights is None else belief.log_weights
    ancestors = np.arange(len(states)) if belief.ancestors is None else np.maximum(belief.ancestors, 0)
    return ParticleSet(states, normalise(weights)[0], ancestors)


def step(state: BeliefState | None, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of the frame."""
    del parameters, rng
    beliefs = frame.beliefs
    if beliefs is None:
        raise ValueError("a recorded tracker needs a recording of beliefs, got pictures or measurements")
    selected, components = beliefs.selected, beliefs.components
    particles = None if selected.particles is None else _set_of(selected)
    estimate = particles.mean[list(components)] if particles is not None else place_of(selected, components)
    if selected.mean is not None:
        estimate = selected.mean[list(components)]
    chosen = np.ix_(components, components)
    covariance = None if particles is None else particles.covariance[chosen]
    if selected.covariance is not None:
        covariance = selected.covariance[chosen]
    return BeliefState(beliefs, particles, estimate, covariance, _paths(state, beliefs, particles))


def _paths(before: BeliefState | None, beliefs: Beliefs, particles: ParticleSet | None) -> Lineage | None:
    """Return the pasts of the particles, as far as every frame since has said their ancestors."""
    if not beliefs.present:
        return None if before is None else before.paths
    if particles is None or beliefs.selected.ancestors is None:
        return None
    tracked = len(beliefs.components)
    places = ParticleSet(particles.states[:, list(beliefs.components)], particles.log_weights, particles.ancestors)
    known = None if before is None else before.paths
    if known is None or particles.ancestors.max() >= known.paths.shape[1]:
        return begin_lineage(places, tracked)
    return extend_lineage(known, places, PATH_FRAMES)


def start(target: Target, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of frame 0."""
    del target
    return step(None, frame, parameters, rng)


def measure(state: BeliefState) -> Mapping[str, SeriesValue]:
    """Report what there is: the components that are looked at, the particles, the box, and how many targets."""
    beliefs, belief = state.beliefs, state.beliefs.selected
    sigma = state.sigma
    found: dict[str, SeriesValue] = {
        ACROSS.name: float(state.estimate[0]),
        TARGETS.name: float(len(beliefs.others) + beliefs.present),
    }
    if len(state.estimate) > 1:
        found[DOWN.name] = float(state.estimate[1])
    if state.covariance is not None:
        found[ACROSS_SD.name] = float(sigma[0])
        if len(sigma) > 1:
            found[DOWN_SD.name] = float(sigma[1])
    if state.particles is not None:
        found |= {"ess": state.particles.effective_sample_size, "particles": float(len(state.particles))}
        if belief.ancestors is not None:
            found["unique_ancestors"] = float(state.particles.unique_ancestors)
            found["resampled"] = float(not np.array_equal(belief.ancestors, np.arange(len(belief.ancestors))))
    if belief.box is not None:
        found[BOX.name] = tuple(belief.box[2:].tolist())
        if np.isfinite(belief.score):
            found[SCORE.name] = belief.score
    return found


def _cloud(state: BeliefState) -> Cloud | None:
    """Return the particles as they were recorded; their parents only where these were."""
    particles = state.particles
    if particles is None:
        return None
    ancestors = particles.ancestors if state.beliefs.selected.ancestors is not None else None
    return Cloud(particles.states, particles.log_weights, ancestors)


def _is_absent(state: BeliefState) -> bool:
    return not state.beliefs.present


TRACKERS: dict[str, Tracker] = {
    "recorded": Tracker(
        "recorded",
        "As recorded",
        "Takes over what was recorded: whatever filter, tracker or person has said it.",
        start,
        step,
        series=(*CLOUD, BOX, SCORE, ACROSS, DOWN, ACROSS_SD, DOWN_SD, TARGETS),
        measure=measure,
        searching=_is_absent,
        cloud=_cloud,
        reads=(),
        replays=True,
    )
}
"""The one tracker of recorded beliefs."""


@dataclass(frozen=True, slots=True)
class Update:
    """What a step of a filter came to.

    Attributes:
        particles: The posterior.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether parents were drawn.
        repeatable: Whether it came to the same whenever it was computed again, as far as that was tried.
    """

    particles: ParticleSet
    log_evidence: float
    resampled: bool
    repeatable: bool = True


class Begin(Protocol):
    """Begin to track."""

    def __call__(self, target: Target, frame: Frame, parameters: Any, rng: Stream) -> Any:  # noqa: ANN401
        """Return the state of frame 0, with particles."""


def _sample_count(parameters: Any) -> int:  # noqa: ANN401 - the experiment's own model
    return int(parameters.sample_count)


def _resample_below(parameters: Any) -> float:  # noqa: ANN401
    return float(getattr(parameters, "resampling_threshold", 1.0))


@dataclass(frozen=True)
class FilterInterface:
    """The states of an experiment as arrays, for filters that come from a file.

    Attributes:
        likelihood: What stands in for a file's own likelihood; it names the coordinates of a state, and brings a state
            up to the frame before particles take it.
        observed: What the functions find in a frame, as a sentence.
        example: Address of the module whose text is a file to begin with; nothing imports it.
        reads: Name of the tracker whose parameters those functions read that stand in for what a file leaves out.
        start: Begin; the state has particles (N, d).
        particles: (state, parameters, rng) -> its particles, drawn from its belief if it has none.
        propagate: (state, states (N, d), frame, parameters, rng) -> states (N, d), drawn from p(x_t | x_{t-1}).
        believe: (state before, update, frame, parameters) -> the state of the frame.
        series: What it reports of its states beside particles.
        measure: (state) -> the values of these series, particles' included.
        count: (parameters) -> how many particles there are to be.
        resample_below: (parameters) -> below which share of N the effective sample size calls for resampling.
        see: (state, frame) -> the frame as the functions of a file see it; as it is, without its truth, if None.
        project: (state, states (N, d)) -> where each sees the F points of a solid, (F, N, 2) px; None without such.
    """

    likelihood: ObservationLikelihood
    observed: str
    example: str
    reads: str
    start: Begin
    particles: Callable[[Any, Any, Any], ParticleSet]
    propagate: Callable[[Any, Floats, Frame, Any, Generator], Floats]
    believe: Callable[[Any, Update, Frame, Any], Any]
    series: tuple[Series, ...]
    measure: Callable[[Any], Mapping[str, SeriesValue]]
    count: Callable[[Any], int] = _sample_count
    resample_below: Callable[[Any], float] = _resample_below
    see: Callable[[Any, Frame], Frame] | None = None
    project: Callable[[Any, Floats], Floats] | None = None


# The normalised innovation squared (NIS) tells whether a Kalman filter is consistent, without the truth: on average it
# should be as large as numbers are measured, and above its limit in one frame of twenty. Larger, the filter is too sure
# of itself; smaller, it could be surer (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).

NIS = (
    Series(
        "nis",
        "normalised innovation squared",
        role="nis",
        reductions=(Reduction("mean_nis", "mean normalised innovation squared", "mean"),),
    ),
    Series(
        "nis_freedom",
        "numbers measured",
        role="nis_freedom",
        reductions=(Reduction("mean_nis_freedom", "mean numbers measured in a frame", "mean"),),
    ),
    Series("nis_limit", "limit of 95 %", role="nis_limit"),
)
"""Of every tracker that predicts its measurement as a Gaussian; a frame without a measurement has none of them."""

LIMIT_DIGITS = 6


def measure_innovation(innovation: NormalisedInnovation | None) -> Mapping[str, SeriesValue]:
    """Return the values of `NIS`; none where nothing was measured."""
    if innovation is None:
        return {}
    squared, freedom = innovation
    return {"nis": squared, "nis_freedom": float(freedom), "nis_limit": _limit(freedom)}


def innovation_parts(
    names: tuple[str, ...], unit: str, measurement: Floats, innovation: Innovation
) -> tuple[Part, ...]:
    """Return the innovation of each value, the gain, and the normalised innovation squared with its limit of 95 %.

    Args:
        names: Of the m values of the measurement.
        unit: Of all of them.
        measurement: (m,).
        innovation: Of it; value i is that of the state's coordinate i.
    """
    deviations = np.sqrt(innovation.covariance.diagonal())
    parts: list[Part] = []
    for axis, name in enumerate(names):
        found, expected = float(measurement[axis]), float(measurement[axis] - innovation.values[axis])
        parts.append(Residual(f"innovation, {name}", found, expected, float(deviations[axis]), unit))
    parts += [Amount(f"gain, {name}", float(innovation.gain[axis, axis])) for axis, name in enumerate(names)]
    squared, freedom = innovation.normalised
    return (*parts, Amount("normalised innovation squared", squared, limit=_limit(freedom)))


@lru_cache(maxsize=64)
def _limit(freedom: int) -> float:
    # Rounded, since the last digits of a quantile hang on the library that computes it.
    return round(chi_square_limit(freedom), LIMIT_DIGITS)
