"""The trackers of the loop by name: the rules by which they choose, how they go on, and what they report."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, TypeVar

import numpy as np

from pftrack.core.model.likelihood import ObservationLikelihood
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.tracker import Fold, Tracker, nothing
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import cloud_of
from pftrack.experiments.shared.sampling.loop import Loop, Rule, Scheme
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import RESAMPLERS

__all__ = ["SAMPLERS", "Sampler", "advance", "fold", "measure_particles", "scheme"]

State = TypeVar("State", bound=PointState)


@dataclass(frozen=True, slots=True)
class Sampler:
    """A member of the family.

    Attributes:
        name: Of the tracker.
        title: On the screen.
        description: One sentence on how it works.
        rule: By which it chooses how particles are drawn.
    """

    name: str
    title: str
    description: str
    rule: Rule

    def tracker(
        self,
        start: Callable[..., Any],
        step: Callable[..., Any],
        fold: Callable[..., Fold | None],
        series: tuple[Series, ...] = (),
        measure: Callable[[Any], Mapping[str, SeriesValue]] = nothing,
        searching: Callable[[Any], bool | None] | None = None,
        likelihood: ObservationLikelihood | None = None,
    ) -> Tracker:
        """Return the tracker, given how it begins and goes on, what it weighs by, and what it reports beside."""
        switches = self.rule in {Rule.HARD, Rule.SOFT, Rule.NOISE}
        own = _measure_switching if switches else _measure_loop
        alert = (reports.ALERT,) if switches else ()
        return Tracker(
            self.name,
            self.title,
            self.description,
            start,
            step,
            fold,
            series=(*reports.CLOUD, reports.SAMPLERS, *alert, *series),
            measure=partial(_measure_both, own, measure),
            searching=searching,
            likelihood=likelihood,
            # Particles that are drawn by prediction alone have the mean likelihood as their evidence.
            evidence="relative" if likelihood and self.rule in {Rule.PREDICTION, Rule.NOISE} else "",
            cloud=partial(cloud_of, reports.SAMPLERS.components),
        )


SAMPLERS = (
    Sampler(
        "h-spf",
        "Hard switching (h-SPF)",
        "Draws by prediction while it is sure and wholly by observation when it is not.",
        Rule.HARD,
    ),
    Sampler(
        "s-spf",
        "Soft switching (s-SPF)",
        "Draws a share of the particles by observation that grows with its uncertainty.",
        Rule.SOFT,
    ),
    Sampler(
        "condensation",
        "Condensation",
        "Draws every particle by prediction: the bootstrap filter.",
        Rule.PREDICTION,
    ),
    Sampler(
        "apf",
        "Auxiliary (APF)",
        "Draws every parent with regard to the new picture.",
        Rule.OBSERVATION,
    ),
    Sampler(
        "pc-pf",
        "Process-noise control (PC-PF)",
        "Draws by prediction, with more process noise when it is unsure.",
        Rule.NOISE,
    ),
)
"""All members, in the order in which they are shown."""


@lru_cache(maxsize=64)
def scheme(rule: Rule, parameters: Any, wide_every: int = 0, wide_factor: float = 1.0) -> Scheme:  # noqa: ANN401
    """Return how particles are drawn and weighed by a rule.

    Args:
        rule: How the samplers are chosen.
        parameters: A model with those of `sampling.parameters`.
        wide_every: One of so many particles moves further than the others; 0 if none does.
        wide_factor: How many times as far.
    """
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
        wide_every,
        float(wide_factor),
    )


def advance(before: State, result: Loop) -> State:
    """Return the state of the last frame of a loop."""
    alert = bool(result.alert[-1])
    earlier = bool(result.alert[-2]) if len(result.alert) > 1 else before.alert
    return replace(
        before,
        posterior=Gaussian(result.mean, result.covariance),
        particles=ParticleSet(result.coordinates.T, result.log_weights, result.ancestors),
        observation_count=int(result.observation_counts[-1]),
        log_evidence=float(result.log_evidences[-1]),
        resampled=bool(result.resampled[-1]),
        switched=earlier is not None and alert != earlier,
        alert=alert,
    )


def fold(before: PointState, result: Loop) -> Fold:
    """Return what comes of all frames of a loop."""
    observed = result.observation_counts
    # The first step of all has no earlier one to differ from.
    earlier = result.alert[0] if before.alert is None else before.alert
    switched = result.alert != np.append(earlier, result.alert[:-1])
    return Fold(
        advance(before, result),
        result.estimates,
        {
            "samples": np.column_stack([len(result.log_weights) - observed, observed]).astype(np.float64),
            "switched": switched.astype(np.float64),
        },
    )


def measure_particles(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles."""
    return {} if state.particles is None else reports.cloud(state.particles, resampled=state.resampled)


def _measure_loop(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles, and from which sampler they came."""
    if state.particles is None:
        return {}
    predicted = len(state.particles) - state.observation_count
    return {**measure_particles(state), "samples": (float(predicted), float(state.observation_count))}


def _measure_switching(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the same, and whether another sampler or another noise was used than in the frame before."""
    return {**_measure_loop(state), "switched": float(state.switched)}


def _measure_both(
    first: Callable[[Any], Mapping[str, SeriesValue]],
    second: Callable[[Any], Mapping[str, SeriesValue]],
    state: PointState,
) -> Mapping[str, SeriesValue]:
    return {**first(state), **second(state)}
