"""The trackers of the loop by name: the rules by which they choose, what they weigh by, and what they report.

They need little of frames and of the states that other methods have left. A family of trackers reuses the loop with a
`Likelihood` of its own, any compiled likelihood of pictures with its parameters packed for compiled code:

    class Brightness(NamedTuple):
        level: float

    @compiled
    def log_likelihood(image_rgb, states, brightness): ...

    LIKELIHOOD = Likelihood(log_likelihood, lambda parameters: Brightness(...))
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.model import Model, nothing
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sampling.loop import LogLikelihood, Loop, Rule, Scheme, loop_with
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import RESAMPLERS


def size_of(image_rgb: NDArray[np.uint8]) -> tuple[int, int]:
    """Return width and height of a picture, px."""
    height, width, _ = image_rgb.shape
    return width, height


def crop(image_rgb: NDArray[np.uint8], middle: Floats, reach: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the part of a picture within a reach of a place, clipped to it; empty if that is outside.

    Args:
        image_rgb: (height, width, 3).
        middle: (2,) px; it is rounded to a pixel.
        reach: Columns and rows to either side.
    """
    height, width, _ = image_rgb.shape
    if not np.isfinite(middle).all() or np.abs(middle).max() > 2 * (height + width):
        return image_rgb[:0, :0]
    column, row = (int(np.floor(value + 0.5)) for value in middle)
    (across, down) = reach
    left, right = max(column - across, 0), max(column + across + 1, 0)
    top, bottom = max(row - down, 0), max(row + down + 1, 0)
    return image_rgb[top:bottom, left:right].copy()


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
        model: Model | None = None,
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
            model=model,
            sampling="prior" if self.rule in {Rule.PREDICTION, Rule.NOISE} else "other",
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
        samplers=reports.SAMPLERS.components,
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


def _measure_loop(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles, and from which sampler they came."""
    if state.particles is None:
        return {}
    predicted = len(state.particles) - state.observation_count
    return {
        **reports.cloud(state.particles, resampled=state.resampled),
        "samples": (float(predicted), float(state.observation_count)),
    }


def _measure_switching(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the same, and whether another sampler or another noise was used than in the frame before."""
    return {**_measure_loop(state), "switched": float(state.switched)}


def _measure_both(
    first: Callable[[Any], Mapping[str, SeriesValue]],
    second: Callable[[Any], Mapping[str, SeriesValue]],
    state: PointState,
) -> Mapping[str, SeriesValue]:
    return {**first(state), **second(state)}


@dataclass(frozen=True)
class Likelihood:
    """p(z | x) of a picture.

    Attributes:
        log_likelihood: (picture, states (N, d), packed parameters) -> (N,); compiled.
        packed: What the family knows of its target, such as the parameters -> a named tuple of what the function needs.
        loop: The loop that weighs by it.
    """

    log_likelihood: LogLikelihood
    packed: Callable[[Any], tuple[Any, ...]]
    loop: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Build the loop; it is compiled when it runs first."""
        object.__setattr__(self, "loop", loop_with(self.log_likelihood))
