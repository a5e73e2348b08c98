"""Trackers that draw particles by prediction, by observation, or by both (Bando 2007, ch. 3), for any likelihood.

A family provides a `LoopModel`: any compiled likelihood of pictures, its parameters packed for compiled code, and its
motion. A `Sampler` is a filter that joins it.

    class Brightness(NamedTuple):
        level: float

    @compiled
    def log_likelihood(image_rgb, states, brightness): ...

    class Lamp(LoopModel):
        def pack(self, known, parameters): return Brightness(parameters.level)
        def motion(self, known, parameters, size): ...

    TRACKERS = filtered(Lamp(log_likelihood), CONDENSATION, AUXILIARY)

The families: `pftrack.experiments.ball` weighs the colour under a particle, `pftrack.experiments.histogram` the colours
of a window. Their parameters are in `reports`.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cache, lru_cache, partial
from types import FunctionType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.model import Values
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Fold, Tracker
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import inner_product
from pftrack.core.numerics.random import Stream, standard_normals
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import Filter, PointModel, Update
from pftrack.experiments.shared.reports import PointState
from pftrack.filters.auxiliary import correction, exceeds, hard, soft
from pftrack.filters.dynamics import diffuse, predict
from pftrack.filters.particles import ParticleSet, moments, normalise
from pftrack.filters.resampling import RESAMPLERS, parents

# The inner loop of the trackers that draw by prediction and by observation, compiled as a whole.
#
# One pass is one frame: choose the samplers by the last posterior, draw parents, move them, weigh them by a likelihood
# of the picture, such as the colour of the pixel under them (Bando 2007, ch. 3). It calls the very functions that the
# filters are made of, and only spares the interpreter between them. A live step is a loop over one frame; a batch gives
# it many, and therefore has the same numbers.

LogLikelihood: TypeAlias = Callable[[NDArray[np.uint8], Floats, Any], Floats]

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""


class Rule(IntEnum):
    """The rule that chooses the samplers."""

    PREDICTION = 0
    OBSERVATION = 1
    HARD = 2
    SOFT = 3
    NOISE = 4


class Scheme(NamedTuple):
    """Settings of drawing and weighing; thresholds in px.

    One in `wide_every` particles gets noise on its position that is `wide_factor` times as large: a mixture of two
    process noises, drawn in strata. Where the posterior is uncertain and all noise is large, no such share exists.
    """

    rule: int
    sample_count: int
    gamma: float
    gamma_min: float
    gamma_max: float
    corrected: bool
    balanced: bool
    resampling: int
    threshold: float
    wide_every: int
    wide_factor: float


class Motion(NamedTuple):
    """x' = A x + d + B u, with the process noise of calm and of alert frames."""

    transition: Floats
    offset: Floats
    noise: Floats
    large_noise: Floats


class Loop(NamedTuple):
    """Results of L frames, and the particles of the last.

    Attributes:
        coordinates: (d, N).
        log_weights: (N,).
        ancestors: (N,) places of the parents among the particles of the frame before.
        mean: (d,).
        covariance: (d, d).
        estimates: (L, 2) posterior means of the position, px.
        log_evidences: (L,).
        observation_counts: (L,) particles by observation.
        resampled: (L,) whether parents were drawn.
        alert: (L,) whether the observation was trusted more, or the prediction doubted, than in calm times.
    """

    coordinates: Floats
    log_weights: Floats
    ancestors: Ints
    mean: Floats
    covariance: Floats
    estimates: Floats
    log_evidences: Floats
    observation_counts: Ints
    resampled: Bools
    alert: Bools


def _log_likelihood(picture_rgb: NDArray[np.uint8], states: Floats, likelihood: tuple[Any, ...]) -> Floats:
    """Return log p(z | x) = 0 (N,), which leaves the prediction; `loop_with` replaces it by a compiled likelihood."""
    del picture_rgb, likelihood
    return np.zeros(states.shape[0])


def _loop(
    pictures_rgb: NDArray[np.uint8],
    coordinates: Floats,
    log_weights: Floats,
    sigma: Floats,
    motion: Motion,
    likelihood: tuple[Any, ...],
    scheme: Scheme,
    seed: int,
    first_frame: int,
) -> Loop:
    """Track through frames.

    Args:
        pictures_rgb: (L, height, width, 3), L >= 1.
        coordinates: (d, N) particles of the frame before; the first two coordinates are the position in px.
        log_weights: (N,) of them.
        sigma: (2,) posterior standard deviations of the frame before, px.
        motion: p(x_t | x_{t-1}).
        likelihood: Packed parameters of p(z_t | x_t).
        scheme: Settings of drawing.
        seed: Seed of the run.
        first_frame: Index of the first picture within the run.
    """
    frames = pictures_rgb.shape[0]
    estimates = np.empty((frames, 2))
    log_evidences = np.empty(frames)
    observation_counts = np.empty(frames, np.int64)
    resampled = np.empty(frames, np.bool_)
    alert = np.empty(frames, np.bool_)
    ancestors = np.empty(0, np.int64)
    mean, covariance = np.empty(0), np.empty((0, 0))
    states = coordinates.T
    for t in range(frames):
        picture, place = pictures_rgb[t], (seed, first_frame + t)
        by_observation, alert[t] = _choose(scheme, sigma)
        noise = motion.large_noise if scheme.rule == Rule.NOISE and alert[t] else motion.noise
        centres = predict(states, motion.transition, motion.offset)
        first_stage, log_g, log_mean_g = log_weights, log_weights, 0.0
        if by_observation > 0:
            log_g = _log_likelihood(picture, centres, likelihood)
            first_stage, log_mean_g = normalise(log_weights + log_g)
            if log_mean_g == -np.inf:
                by_observation = 0
        resampled[t] = by_observation > 0 or _must_resample(scheme, log_weights)
        draws = 0
        if resampled[t]:
            ancestors, draws = _parents(scheme, log_weights, first_stage, by_observation, place)
        else:
            ancestors = np.arange(scheme.sample_count)
        normals = standard_normals(*place, TRACK, draws, scheme.sample_count * noise.shape[1])
        normals = normals.reshape(noise.shape[1], scheme.sample_count)
        _widen(normals, scheme, alert[t])
        states = diffuse(centres, ancestors, noise, normals)
        scores = _log_likelihood(picture, states, likelihood)
        if by_observation > 0 and scheme.corrected:
            scores += correction(log_g[ancestors], log_mean_g, scheme.sample_count - by_observation, scheme.balanced)
        if not resampled[t]:
            scores += log_weights
        log_weights, log_evidences[t] = normalise(scores)
        if resampled[t]:
            log_evidences[t] -= np.log(scheme.sample_count)
        observation_counts[t] = by_observation
        # All moments are needed for the last frame, those of the position for the others.
        weights = exponentials(log_weights)
        mean, covariance = moments(states if t == frames - 1 else states.T[:2].T, weights)
        sigma = np.empty(2)
        for axis in range(2):
            estimates[t, axis] = mean[axis]
            sigma[axis] = np.sqrt(covariance[axis, axis])
    return Loop(
        states.T,
        log_weights,
        ancestors,
        mean,
        covariance,
        estimates,
        log_evidences,
        observation_counts,
        resampled,
        alert,
    )


@cache
def loop_with(log_likelihood: LogLikelihood) -> Callable[..., Loop]:
    """Return the loop, to be compiled around a likelihood when it runs first.

    A compiled function calls another one at full speed only if the callee is known at compile time; and compiled code
    is cached on disk by the name of the function. So each likelihood has a copy of the loop with its own name, in which
    the global `_log_likelihood` is that likelihood.

    Args:
        log_likelihood: (picture, states (N, d), packed parameters) -> (N,); compiled, of a module.
    """
    own = FunctionType(_loop.__code__, {**globals(), _log_likelihood.__name__: log_likelihood}, _loop.__name__)
    own.__annotations__ = _loop.__annotations__
    own.__qualname__ = "loop_" + f"{log_likelihood.__module__}_{log_likelihood.__qualname__}".replace(".", "_")
    return compiled(own)


@compiled
def _choose(scheme: Scheme, sigma: Floats) -> tuple[int, bool]:
    """Return the number of particles to draw by observation, and whether the tracker is alert."""
    if scheme.rule == Rule.OBSERVATION:
        return scheme.sample_count, True
    if scheme.rule == Rule.HARD:
        by_observation = hard(sigma, scheme.gamma, scheme.sample_count)
        return by_observation, by_observation > 0
    if scheme.rule == Rule.SOFT:
        by_observation = soft(sigma, scheme.gamma_min, scheme.gamma_max, scheme.sample_count)
        return by_observation, by_observation > 0
    return 0, scheme.rule == Rule.NOISE and exceeds(sigma, scheme.gamma)


@compiled
def _widen(normals: Floats, scheme: Scheme, alert: bool) -> None:
    """Make the noise on the position (the first two rows) of some of the particles larger."""
    if scheme.wide_every > 0 and not (scheme.rule == Rule.NOISE and alert):
        for n in range(0, scheme.sample_count, scheme.wide_every):
            for axis in range(2):
                normals[axis, n] *= scheme.wide_factor


@compiled
def _must_resample(scheme: Scheme, log_weights: Floats) -> bool:
    if scheme.threshold >= 1.0 or scheme.sample_count != log_weights.shape[0]:
        return True
    weights = exponentials(log_weights)
    return bool(1.0 / inner_product(weights, weights) < scheme.threshold * scheme.sample_count)


@compiled
def _parents(
    scheme: Scheme,
    log_weights: Floats,
    first_stage: Floats,
    by_observation: int,
    place: tuple[int, int],
) -> tuple[Ints, int]:
    """Return the parents, those by prediction first, and the number of draws used."""
    if by_observation == 0:
        return parents(scheme.resampling, log_weights, scheme.sample_count, *place, TRACK, 0), 1
    if by_observation == scheme.sample_count:
        return parents(scheme.resampling, first_stage, scheme.sample_count, *place, TRACK, 0), 1
    predicted = parents(scheme.resampling, log_weights, scheme.sample_count - by_observation, *place, TRACK, 0)
    observed = parents(scheme.resampling, first_stage, by_observation, *place, TRACK, 1)
    return np.concatenate((predicted, observed)), 2


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

    movable = True

    def __init__(self, kernel: LogLikelihood) -> None:
        """Build the loop around a compiled likelihood, (picture, states (N, d), packed parameters) -> (N,)."""
        self.kernel, self.loop = kernel, loop_with(kernel)

    @abstractmethod
    def pack(self, known: Any, parameters: Values) -> tuple[Any, ...]:  # noqa: ANN401 - each family's own state
        """Return what the likelihood needs of the state before and the parameters."""

    @abstractmethod
    def motion(self, known: Any, parameters: Values, size: tuple[int, int]) -> Motion:  # noqa: ANN401
        """Return how states move in a picture of some width and height, px."""

    def wide(self, parameters: Values) -> tuple[int, float]:
        """Return the period of particles that move further, 0 for none, and their factor."""
        del parameters
        return 0, 1.0

    @abstractmethod
    def pauses(self, parameters: Values) -> bool:
        """Return whether a decision or learning happens between frames, so frames cannot be computed together."""

    def search(self, known: Any, frame: Frame, parameters: Values, rng: Stream) -> PointState | None:  # noqa: ANN401
        """Return the state of a frame in which a lost target is searched; None while it is followed."""
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
        """Track through pictures (L, height, width, 3) by a rule; see `_loop`.

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
        rule: The rule that chooses the samplers.
        parameters: A model with `SamplingParameters` and `SwitchingParameters`.
        wide_every: One of so many particles moves further than the others; 0 if none does.
        wide_factor: Factor of their step.
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
        rule: Its rule that chooses the samplers.
    """

    rule: Rule = field(kw_only=True)

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
        known = model.with_particles(known, parameters, rng)
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
    alert = bool(result.alert[-1])
    earlier = bool(result.alert[-2]) if len(result.alert) > 1 else known.alert
    update = Update(
        particles,
        float(result.log_evidences[-1]),
        bool(result.resampled[-1]),
        moments=(result.mean, result.covariance),
        observation_count=int(result.observation_counts[-1]),
        samplers=reports.SAMPLERS.components,
        switched=earlier is not None and alert != earlier,
        alert=alert,
    )
    return model.believe(known, update, frame, parameters)


HARD = Sampler("h-spf", rule=Rule.HARD)
SOFT = Sampler("s-spf", rule=Rule.SOFT)
CONDENSATION = Sampler("condensation", rule=Rule.PREDICTION)
AUXILIARY = Sampler("apf", rule=Rule.OBSERVATION)
NOISE_CONTROL = Sampler("pc-pf", rule=Rule.NOISE)
