"""The belief in a ball: its likelihood, its motion, and the start of a run (Bando 2007, ch. 3).

Particles are weighed by the colour of the pixel under them. All trackers share a second-order model of the position:
constant velocity in Bando 2007, with damping or with a known swing on request, or as estimated from the path by online
EM. One tracker instead draws accelerations learned from recorded runs, and two measure the colour centroid of the whole
picture (section 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Component, Part, Patches, Residual
from pftrack.core.model.model import Evidence, LinearChain, LinearStep, NoiseScale, State, Values
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.random import Gaussian, Generator, Stream
from pftrack.experiments.shared.filtered import Bootstrap, Filter, Kalman, PointModel, Update, filtered, resampler
from pftrack.experiments.shared.reports import (
    LEARNED_MOTION,
    SAMPLING,
    PointState,
    Resampling,
    SamplingParameters,
    SwitchingParameters,
    correlated_changes,
    diffusion_scale,
    large_process_noise,
    learned_motion,
    loss_share,
    particle_count,
    resampling_threshold,
    velocity_retention,
)
from pftrack.experiments.shared.sampling import (
    AUXILIARY,
    CONDENSATION,
    HARD,
    NOISE_CONTROL,
    SOFT,
    LoopModel,
    Motion,
    crop,
    size_of,
)
from pftrack.filters import unscented_particle
from pftrack.filters.dynamics import Lineage, LinearDynamics, augment, autoregression, begin_lineage, extend_lineage
from pftrack.filters.learning import online_em
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance, GuidedDynamics
from pftrack.filters.particles import ParticleSet
from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.chromaticity import ColourModel, log_kernel

# The parameters that all trackers of a ball share; each class names those that read its fields.
#
# They are declared in parts, so another family of trackers takes the parts that it shares: one that follows something
# other than a colour, through the same loop, takes `LoopParameters`. A model has the fields of its last base first.

# `learned.json` was learned from ten runs of the scene without a pillar, `pftrack learn ball` with the options
#
#     --tracker h-spf --frames 120 --set occlusion_width_px=0 --set image_noise_sd=10
#     --set sample_count=3000 --set process_noise_px=8

GUIDANCE = Guidance("ball", Chart(place=("u", "v")), Path(__file__).with_name("learned.json").read_text("utf-8"))

PARTICLE = ("condensation", "apf", "upf", "pc-pf", "h-spf", "s-spf", "guided")
MEASURING = ("kalman", "upf")
MODELLED = ("h-spf", "s-spf", "condensation", "apf", "upf", "pc-pf", "kalman")
"""Trackers that use the motion model below rather than motion learned from recorded runs."""
GUIDED_TRACKERS = ("guided",)

MODEL = "Motion model"
COLOUR = "Colour model"
SCORING = "Scoring"


class DrawingParameters(SamplingParameters, group=SAMPLING, trackers=PARTICLE):
    """How particles are drawn, which one of the centroid's trackers has as well."""

    sample_count: int = particle_count(800)
    resampling: Resampling = parameter("systematic", "Resampling", role="resampling")
    """How parents are drawn."""
    resampling_threshold: float = resampling_threshold(trackers=("condensation", "pc-pf", "h-spf", "s-spf", "guided"))


class MotionParameters(Parameters, group=MODEL, trackers=MODELLED):
    """How the target is expected to move."""

    process_noise_px: float = parameter(
        3, "Process noise", unit="px", within=(0.01, 200, 0.1), useful=(0.1, 20), role="noise"
    )
    """Standard deviation of what the motion model leaves out, each frame and axis."""
    large_process_noise_px: float = large_process_noise()
    velocity_retention: float = velocity_retention()
    assumed_period_frames: float = parameter(0, "Assumed period", unit="frames", within=(0, 10_000, 1), useful=(0, 120))
    """Period of the swing about the middle of the picture that the motion model assumes; 0 assumes none, which is
    Bando's rough model."""
    initial_sd_px: float = parameter(
        1, "Initial spread", unit="px", within=(0, 200, 0.5), useful=(0, 20), live=False, trackers=()
    )
    """Standard deviation of the particles around the start."""


class LearningParameters(Parameters, group="Learning", trackers=MODELLED):
    """How the motion is learned, and the path looked back at."""

    learn_dynamics: bool = parameter(False, "Learn the motion")
    """Estimate the motion model while tracking, by online EM."""
    forgetting: float = parameter(0.99, "Forgetting", within=(0.5, 1, 0.005), role="memory")
    """Factor by which learned statistics fade each frame; the memory is about 1 / (1 - factor) frames."""
    warm_up_frames: int = parameter(15, "Warm-up", unit="frames", within=(1, 1000, 1), useful=(1, 100))
    """Frames to watch before the learned model is used."""
    learning_ridge: float = parameter(1e-4, "Ridge", within=(0, 1, 1e-4), useful=(0, 0.01))
    """Pull of the learned model towards the initial one."""
    largest_spectral_radius: float = parameter(1.02, "Stability guard", within=(0.5, 2, 0.01))
    """A learned model whose spectral radius is larger is refused."""
    smoothing_lag_frames: int = parameter(
        0, "Smoothing lag", unit="frames", within=(0, 60, 1), group=SAMPLING, trackers=PARTICLE, role="smoothing"
    )
    """Frames to look back: the path is drawn as it appears given what was seen since; 0 draws none."""


class ColourParameters(Parameters, group=COLOUR):
    """What the target looks like."""

    measurement_noise_px: float = parameter(
        20,
        "Measurement noise",
        unit="px",
        within=(0.1, 1000, 1),
        useful=(1, 60),
        group=MODEL,
        trackers=MEASURING,
        role="noise",
    )
    """Standard deviation attributed to the colour centroid as a measurement of the position."""
    recursive_covariance: bool = parameter(False, "Recursive covariance", group=SAMPLING, trackers=("upf",))
    """Whether the covariance of each particle's unscented filter is handed down from frame to frame, as Bando has it,
    or begins anew with the process noise, which holds the ball longer."""
    background_level: float = parameter(0.1, "Background level rho", within=(0, 1, 0.01), role="sharpness")
    """Likelihood of any pixel that is not of the target's colour, relative to one that is."""
    colour_model: Literal["redness", "chromaticity"] = parameter("redness", "Colour model")
    """Compare the share of red alone, as Bando does, or the shares of red and green."""
    target_red_share: float = parameter(2 / 3, "Share of red", within=(0, 1, 0.005))
    """Mean of R / (R + G + B) on the target."""
    target_green_share: float = parameter(1 / 6, "Share of green", within=(0, 1, 0.005))
    """Mean of G / (R + G + B) on the target."""
    red_spread: float = parameter(
        0.05, "Spread of red", within=(0.001, 1, 0.005), useful=(0.005, 0.3), role="sharpness"
    )
    """Standard deviation of the share of red."""
    green_spread: float = parameter(
        0.05, "Spread of green", within=(0.001, 1, 0.005), useful=(0.005, 0.3), role="sharpness"
    )
    """Standard deviation of the share of green."""


class ScoringParameters(Parameters, group=SCORING):
    """What counts as success."""

    lost_radii: float = parameter(3, "Success region", unit="radii", within=(0.1, 20, 0.1), useful=(0.5, 10))
    """The target counts as lost when the estimate is further away than this many target radii."""
    lost_share: float = loss_share(0.25)


class LoopParameters(LearningParameters, MotionParameters, SwitchingParameters, DrawingParameters):
    """Parameters of all trackers of the loop, independent of the likelihood."""


class GuidedParameters(Parameters, group=LEARNED_MOTION, trackers=GUIDED_TRACKERS):
    """How the motion was learned from recorded runs."""

    learned: str = learned_motion()
    guided_frame: Literal["fixed", "motion"] = parameter("fixed", "Frame of the diffusion")
    """Whether accelerations are drawn along the axes of the picture, or along and across the ball's last motion."""
    diffusion_scale: float = diffusion_scale()
    correlated_changes: bool = correlated_changes()

    @field_validator("learned")
    @classmethod
    def _fits(cls, text: str) -> str:
        GUIDANCE.parse(text)
        return text


class BallTrackerParameters(GuidedParameters, ColourParameters, LoopParameters):
    """Everything that can be turned on the trackers of a ball."""


COMPONENTS = (Component("u", "px"), Component("v", "px"), Component("u before", "px"), Component("v before", "px"))

TRACKED = 2
"""The position: the first coordinates of the state."""

SHOWN_PX = 5
"""Pixels on either side of the weighed one that are shown with it."""


class Colour(NamedTuple):
    """The target's appearance, in the form of `chromaticity.log_kernel`."""

    mean: tuple[float, float]
    precision: tuple[float, float]
    background_level: float


def colour_model(parameters: ColourParameters) -> ColourModel:
    """Return the colour that the parameters describe."""
    green = parameters.green_spread if parameters.colour_model == "chromaticity" else np.inf
    return ColourModel((parameters.target_red_share, parameters.target_green_share), (parameters.red_spread, green))


@compiled
def _log_likelihood(image_rgb: NDArray[np.uint8], states: Floats, colour: Colour) -> Floats:
    return log_kernel(image_rgb, states, colour.mean, colour.precision, colour.background_level)


@lru_cache(maxsize=64)
def _pack(parameters: ColourParameters) -> Colour:
    model = colour_model(parameters)
    return Colour(model.mean, model.precision, parameters.background_level)


class Coloured(LoopModel):
    """A point of a known colour that keeps its velocity, by the pixel under it (Bando 2007, ch. 3 section 2.2)."""

    title = "colour of the pixel"
    evidence: Evidence = "relative"
    most_places = 19_200
    instants = 2
    observed = "frame.image_rgb is the picture, (height, width, 3), 0 to 255; u counts its columns, v its rows"
    example = "pftrack.experiments.ball.example_filter"
    reads = "condensation"

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return COMPONENTS

    @override
    def start(self, target: Target, frame: Frame, parameters: LoopParameters, rng: Stream) -> PointState:
        """Begin at a known position: all particles around it, at rest; the estimate is the position itself."""
        deviations = parameters.initial_sd_px * rng.standard_normal((TRACKED, parameters.sample_count)).T
        positions = target.position + deviations
        particles = ParticleSet.uniform(np.hstack([positions, positions]))
        begun = PointState(self.prior(target, parameters), TRACKED, particles)
        return self.prepare(begun, frame, parameters)

    @override
    def prior(self, target: Target, parameters: LoopParameters) -> Gaussian:
        """Return the known position, at rest."""
        return augment(Gaussian(target.position, parameters.initial_sd_px**2 * np.eye(TRACKED)), 1)

    @override
    def prepare(self, state: PointState, frame: Frame, parameters: LoopParameters) -> PointState:
        return with_learner(state, size_of(frame.picture), parameters)

    @override
    def propagate(
        self, states: Floats, frame: Frame, parameters: LoopParameters, rng: Generator, known: PointState
    ) -> Floats:
        dynamics = dynamics_of(known, parameters, size_of(frame.picture))
        return dynamics.diffuse(rng, dynamics.predict(states), np.arange(len(states)))

    @override
    def motion(self, known: PointState, parameters: LoopParameters, size: tuple[int, int]) -> Motion:
        dynamics = dynamics_of(known, parameters, size)
        return Motion(dynamics.transition, dynamics.offset, dynamics.noise, noise(parameters.large_process_noise_px))

    @override
    def pauses(self, parameters: LoopParameters) -> bool:
        return parameters.learn_dynamics

    @override
    def pack(self, known: State, parameters: ColourParameters) -> Colour:
        return _pack(parameters)

    @override
    def parts(self, one: Floats, frame: Frame, parameters: ColourParameters, known: State) -> tuple[Part, ...]:
        """Return the colour of the pixel and of the target, in the compared shares."""
        image, model = frame.picture, colour_model(parameters)
        around = crop(image, one[:2], (SHOWN_PX, SHOWN_PX))
        shares = np.full(2, np.nan)
        pixel = crop(image, one[:2], (0, 0)).reshape(-1).astype(np.float64)
        if pixel.sum() > 0.0:
            shares = pixel[:2] / pixel.sum()
        residuals = tuple(
            Residual(f"share of {name}", float(found), expected, spread)
            for name, found, expected, spread in zip(("red", "green"), shares, model.mean, model.spread, strict=True)
            if np.isfinite(spread)
        )
        red, green = model.mean
        blue = max(1.0 - red - green, 0.0)
        brightest = max(red, green, blue)
        colour = np.rint(255.0 * np.array([[[red, green, blue]]]) / brightest).astype(np.uint8)
        background = Amount("background level rho", parameters.background_level)
        return (*residuals, background, Patches("colour expected, and found around the pixel", colour, around))

    @override
    def believe(self, known: PointState, update: Update, frame: Frame, parameters: LoopParameters) -> PointState:
        believed = super().believe(known, update, frame, parameters)
        lineage = lineage_of(known, update.particles, parameters)
        return self.learn(replace(believed, lineage=lineage) if lineage else believed, frame, parameters)

    @override
    def learn(self, state: PointState, frame: Frame, parameters: LoopParameters) -> PointState:
        if state.learner is None:
            return state
        settings = online_em.Settings(
            parameters.forgetting,
            parameters.warm_up_frames,
            parameters.learning_ridge,
            parameters.largest_spectral_radius,
        )
        initial = initial_dynamics(parameters, size_of(frame.picture))
        return replace(state, learner=online_em.learn(state.learner, initial, state.estimate, state.sigma, settings))


@lru_cache(maxsize=64)
def noise(process_noise_px: float) -> Floats:
    """Return B of the state (x_t, x_{t-1}): (4, 2), px."""
    return process_noise_px * np.eye(2 * TRACKED, TRACKED)


@lru_cache(maxsize=64)
def initial_dynamics(parameters: LoopParameters, size: tuple[int, int]) -> LinearDynamics:
    """Return x_{t+1} = x_t + retention (x_t - x_{t-1}) + noise, or the swing of the assumed period about the middle."""
    one, retention = np.eye(TRACKED), parameters.velocity_retention
    spread = parameters.process_noise_px * one
    if parameters.assumed_period_frames == 0:
        return autoregression((1 + retention) * one, -retention * one, np.zeros(TRACKED), spread)
    turn = 2 * np.cos(2 * np.pi / parameters.assumed_period_frames)
    return autoregression(turn * one, -one, (2 - turn) * np.array(size) / 2, spread)


def dynamics_of(state: PointState, parameters: LoopParameters, size: tuple[int, int]) -> LinearDynamics:
    """Return the model in force: what was learned, or the initial one.

    Args:
        state: State of the frame before.
        parameters: In force.
        size: Width and height of the picture, px.
    """
    if state.learner is not None:
        return online_em.dynamics(state.learner, parameters.process_noise_px * np.eye(TRACKED))
    return initial_dynamics(parameters, size)


def with_learner(state: PointState, size: tuple[int, int], parameters: LoopParameters) -> PointState:
    """Begin learning from the initial model and the estimate when it is switched on; end it when it is switched off."""
    if parameters.learn_dynamics == (state.learner is not None):
        return state
    if not parameters.learn_dynamics:
        return replace(state, learner=None)
    initial = initial_dynamics(parameters, size)
    return replace(state, learner=online_em.begin(initial, state.estimate, float(state.sigma.max()), size))


def lineage_of(state: PointState, particles: ParticleSet, parameters: LoopParameters) -> Lineage | None:
    """Return the particles' pasts, extended by a frame; None if the path is not smoothed.

    Args:
        state: State of the frame before.
        particles: Particles of this frame.
        parameters: In force.
    """
    if parameters.smoothing_lag_frames == 0 or state.particles is None:
        return None
    lineage = state.lineage or begin_lineage(state.particles, TRACKED)
    return extend_lineage(lineage, particles, parameters.smoothing_lag_frames)


class Guided(Coloured):
    """The same colour, with accelerations learned from recorded runs.

    Instead of one process noise for both axes, accelerations are drawn from the learned covariance, in the frame of the
    picture or in that of the ball's last motion. A ball has no heading, so the learned shape changes of Mitsugami et
    al. do not apply; only the spread of accelerations remains.
    """

    @override
    def prepare(self, state: PointState, frame: Frame, parameters: LoopParameters) -> PointState:
        return state if state.learner is None else replace(state, learner=None)

    @override
    def propagate(self, states: Floats, frame: Frame, parameters: Values, rng: Generator, known: PointState) -> Floats:
        diffusion = GUIDANCE.parse(parameters.learned).diffusion(
            parameters.guided_frame, scale=parameters.diffusion_scale, correlated=parameters.correlated_changes
        )
        dynamics = GuidedDynamics(diffusion, GUIDANCE.chart, parameters.guided_frame)
        places, before = states[:, :TRACKED], states[:, TRACKED:]
        moved = dynamics.diffuse(rng, np.hstack([places, places - before]), np.arange(len(states)))
        return np.asfortranarray(np.hstack([moved[:, :TRACKED], places]))


class Centroid(Coloured):
    """The same motion, with the colour centroid of the whole picture as a measurement (Bando 2007, ch. 3 section 4)."""

    title = "colour centroid of the picture"
    evidence = "normalised"
    scales: ClassVar = {
        "process_noise_px": NoiseScale("process"),
        "measurement_noise_px": NoiseScale("observation"),
    }
    most_places = 4800

    @override
    def linear(self, frame: Frame, parameters: BallTrackerParameters, known: PointState) -> LinearStep:
        image = frame.picture
        return LinearStep(
            dynamics_of(known, parameters, size_of(image)),
            chromaticity.centroid(image, colour_model(parameters)),
            np.eye(TRACKED, 2 * TRACKED),
            parameters.measurement_noise_px**2 * np.eye(TRACKED),
        )

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: State) -> Floats:
        """Return the log density of the centroid (N,), 0 without a centroid."""
        measurement = chromaticity.centroid(frame.picture, colour_model(parameters))
        if measurement is None:
            return np.zeros(len(states))
        off = (states[:, :TRACKED] - measurement) / parameters.measurement_noise_px
        return np.asarray(-0.5 * np.square(off).sum(axis=1))

    @override
    def parts(self, one: Floats, frame: Frame, parameters: ColourParameters, known: State) -> tuple[Part, ...]:
        return ()

    @override
    def chains(
        self, state: PointState, frames: Sequence[Frame], parameters: BallTrackerParameters
    ) -> tuple[LinearChain, ...] | None:
        """Return the model of some frames; None if the motion is learned."""
        learned = parameters.learn_dynamics or state.learner is not None
        return None if learned else super().chains(state, frames, parameters)


COLOURED, GUIDED, CENTROID = Coloured(_log_likelihood), Guided(_log_likelihood), Centroid(_log_likelihood)
"""The models of a ball's colour and motion, and variants with another motion or measurement."""


# Trackers of a ball by its colour: the filters of Bando 2007, ch. 3, with the likelihood of its section 2.2.
#
# All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in the sampling of the next
# posterior. Those that draw by prediction or by observation share one compiled loop
# (`pftrack.experiments.shared.sampling`), and differ only in its switching rule. Whether the dynamics are learned and
# the path smoothed is the same for all.


@dataclass(frozen=True)
class Unscented(Filter[PointModel]):
    """The unscented particle filter: its proposal uses a linear model of a measurement (Bando 2007, ch. 3 section 4).

    Attributes:
        measured: The linear model.
    """

    measured: Centroid = field(kw_only=True)

    @override
    def step(
        self, model: PointModel, state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream
    ) -> PointState:
        known = model.with_particles(model.prepare(state, frame, parameters), parameters, rng)
        linear = self.measured.linear(frame, parameters, known)
        posterior = unscented_particle.step(
            known.particles,
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
    **filtered(COLOURED, HARD, SOFT, CONDENSATION, AUXILIARY, Unscented("upf", measured=CENTROID), NOISE_CONTROL),
    **filtered(CENTROID, Kalman("kalman")),
    **filtered(GUIDED, Bootstrap("guided")),
}
"""The trackers of a ball, by name, in the order in which they are shown."""
