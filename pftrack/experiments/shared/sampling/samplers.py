"""The trackers of the loop by name: the rules by which they choose, the model that they weigh by, what they report.

A family brings a `LoopModel`: any compiled likelihood of pictures, its parameters packed for compiled code, and how
its states move. A `Sampler` is a filter that joins it.

    class Brightness(NamedTuple):
        level: float

    @compiled
    def log_likelihood(image_rgb, states, brightness): ...

    class Lamp(LoopModel):
        def pack(self, known, parameters): return Brightness(parameters.level)
        def motion(self, known, parameters, size): ...

    TRACKERS = filtered(Lamp(log_likelihood), CONDENSATION, AUXILIARY)
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.model import Values
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Stream
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import Filter, PointModel, Update
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sampling.loop import LogLikelihood, Loop, Motion, Rule, Scheme, loop_with
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


class LoopModel(PointModel):
    """The belief in a point of a picture, which the compiled loop can follow."""

    def __init__(self, kernel: LogLikelihood) -> None:
        """Build the loop around a compiled likelihood, (picture, states (N, d), packed parameters) -> (N,)."""
        self.kernel, self.loop = kernel, loop_with(kernel)

    def pack(self, known: Any, parameters: Values) -> tuple[Any, ...]:  # noqa: ANN401 - each family's own state
        """Return what the likelihood needs of the state before and the parameters."""
        raise NotImplementedError

    def motion(self, known: Any, parameters: Values, size: tuple[int, int]) -> Motion:  # noqa: ANN401
        """Return how states move in a picture of some width and height, px."""
        raise NotImplementedError

    def wide(self, parameters: Values) -> tuple[int, float]:
        """Return which of how many particles moves further, 0 for none, and how many times as far."""
        del parameters
        return 0, 1.0

    def pauses(self, parameters: Values) -> bool:
        """Return whether something is decided or learned between frames, so that they cannot be taken at once."""
        raise NotImplementedError

    def search(self, known: Any, frame: Frame, parameters: Values, rng: Stream) -> PointState | None:  # noqa: ANN401
        """Return the state of a frame in which a lost target is looked for; None while it is followed."""
        del known, frame, parameters, rng
        return None

    def fold_series(self, last: Any, count: int) -> Mapping[str, Floats]:  # noqa: ANN401
        """Return the model's own series over `count` frames that were taken at once, given the last state."""
        del last, count
        return {}

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: Any) -> Floats:
        packed = self.pack(known, parameters)
        return self.kernel(read_only(frame.picture), np.ascontiguousarray(states.T).T, packed)

    def follow(
        self,
        rule: Rule,
        known: PointState,
        pictures_rgb: NDArray[np.uint8],
        parameters: Values,
        seed: int,
        first_frame: int,
    ) -> Loop:
        """Track through pictures (L, height, width, 3) by a rule; see `sampling.loop`.

        Raises:
            ValueError: The state has no particles.
        """
        particles = known.particles
        if particles is None:
            raise ValueError("the loop needs particles to begin with")
        return self.loop(
            read_only(pictures_rgb),
            np.ascontiguousarray(particles.states.T),
            particles.log_weights,
            known.sigma,
            self.motion(known, parameters, size_of(pictures_rgb[0])),
            self.pack(known, parameters),
            scheme(rule, parameters, *self.wide(parameters)),
            seed,
            first_frame,
        )


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


@dataclass(frozen=True)
class Sampler(Filter[LoopModel]):
    """A filter that draws by prediction, by observation, or by both.

    Attributes:
        rule: By which it chooses how particles are drawn.
    """

    rule: Rule

    @property
    def switches(self) -> bool:
        """Whether it changes the sampler, or the process noise, from frame to frame."""
        return self.rule in {Rule.HARD, Rule.SOFT, Rule.NOISE}

    @override
    def join(self, model: LoopModel) -> Tracker:
        return replace(
            super().join(model),
            fold=partial(self._fold, model),
            series=(*model.series, reports.SAMPLERS, *([reports.ALERT] if self.switches else [])),
            measure=partial(self._measure, model),
            sampling="prior" if self.rule in {Rule.PREDICTION, Rule.NOISE} else "other",
        )

    @override
    def step(self, model: LoopModel, state: PointState, frame: Frame, parameters: Values, rng: Stream) -> PointState:
        known: PointState = model.prepare(state, frame, parameters)
        found = model.search(known, frame, parameters, rng)
        if found is not None:
            return found
        known = replace(known, particles=model.particles(known, parameters, rng))
        result = model.follow(self.rule, known, frame.picture[None], parameters, rng.seed, rng.frame)
        return _advance(model, known, result, frame, parameters)

    def _fold(
        self,
        model: LoopModel,
        state: PointState,
        pictures_rgb: NDArray[np.uint8],
        parameters: Values,
        seed: int,
        first_frame: int,
    ) -> Fold | None:
        if model.pauses(parameters):
            return None
        known: PointState = model.prepare(state, Frame(first_frame, 0.0, image_rgb=pictures_rgb[0]), parameters)
        result = model.follow(self.rule, known, pictures_rgb, parameters, seed, first_frame)
        frame = Frame(first_frame + len(pictures_rgb) - 1, 0.0, image_rgb=pictures_rgb[-1])
        # The particles before are parents of the first frame's, not of the last one's.
        last = _advance(model, replace(known, particles=None), result, frame, parameters)
        observed = result.observation_counts
        # The first step of all has no earlier one to differ from.
        earlier = result.alert[0] if state.alert is None else state.alert
        switched = result.alert != np.append(earlier, result.alert[:-1])
        series = {
            "samples": np.column_stack([len(result.log_weights) - observed, observed]).astype(np.float64),
            "switched": switched.astype(np.float64),
        }
        return Fold(last, result.estimates, {**series, **model.fold_series(last, len(pictures_rgb))})

    def _measure(self, model: LoopModel, state: PointState) -> Mapping[str, SeriesValue]:
        if state.particles is None:
            return model.measure(state)
        predicted = len(state.particles) - state.observation_count
        samples = {"samples": (float(predicted), float(state.observation_count))}
        return {**model.measure(state), **samples, **({"switched": float(state.switched)} if self.switches else {})}


def _advance(model: LoopModel, known: PointState, result: Loop, frame: Frame, parameters: Values) -> PointState:
    """Return the state of the last frame of a loop."""
    particles = ParticleSet(result.coordinates.T, result.log_weights, result.ancestors)
    moments = result.mean, result.covariance
    update = Update(particles, float(result.log_evidences[-1]), bool(result.resampled[-1]), moments=moments)
    alert = bool(result.alert[-1])
    earlier = bool(result.alert[-2]) if len(result.alert) > 1 else known.alert
    return replace(
        model.believe(known, update, frame, parameters),
        observation_count=int(result.observation_counts[-1]),
        samplers=reports.SAMPLERS.components,
        switched=earlier is not None and alert != earlier,
        alert=alert,
    )


HARD = Sampler(
    "h-spf",
    "Hard switching (h-SPF)",
    "Draws by prediction while it is sure and wholly by observation when it is not.",
    Rule.HARD,
)
SOFT = Sampler(
    "s-spf",
    "Soft switching (s-SPF)",
    "Draws a share of the particles by observation that grows with its uncertainty.",
    Rule.SOFT,
)
CONDENSATION = Sampler(
    "condensation",
    "Condensation",
    "Draws every particle by prediction: the bootstrap filter.",
    Rule.PREDICTION,
)
AUXILIARY = Sampler(
    "apf",
    "Auxiliary (APF)",
    "Draws every parent with regard to the new picture.",
    Rule.OBSERVATION,
)
NOISE_CONTROL = Sampler(
    "pc-pf",
    "Process-noise control (PC-PF)",
    "Draws by prediction, with more process noise when it is unsure.",
    Rule.NOISE,
)
