"""The Kalman filter and the particle filter on a signal in noise (Bando 2007, ch. 2).

The model is linear and the noise Gaussian, so the exact answer is known, and the loss of a particle filter by sampling
is visible: with few particles, and with more dimensions than they can fill.
"""

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import COLOURS, LIFT, Drawing, Links, Mesh, Picture, Points, Polyline, Primitive, Text
from pftrack.core.model.likelihood import Component, Part, Residual
from pftrack.core.model.model import LinearStep, NoiseScale, State, Values
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.random import Gaussian, Generator, Purpose, Stream
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import Experiment, Judge
from pftrack.experiments.shared.filtered import Bootstrap, Kalman, PointModel, filtered
from pftrack.experiments.shared.reports import particle_count, resampling_threshold
from pftrack.experiments.shared.sketch import at_height, caption, circle, grid_faces, particle_clouds
from pftrack.filters.dynamics import LinearDynamics, autoregression
from pftrack.vision.rendering import viridis

# A signal in noise, the belief in it, and its trackers: Bando 2007, ch. 2 sections 2 and 3.
#
# The truth turns once in 360 frames; what is seen is the truth plus white noise. Several dimensions are independent
# copies of the same signal with independent noise; Bando uses them to show the cost of dimension for a particle filter.
#
# The model is of second order, X_t = (x_t, x_{t-1}), X_t = [[2, -1], [1, 0]] X_{t-1} + (b u, 0), z_t = x_t + noise. In
# D dimensions the state is D copies: all newest values first, then all previous ones. The particle filter also carries
# the exact Kalman answer, which is known for this model. A sample that is not finite is a missing one.

SIGNAL = "Signal"


class SignalParameters(Parameters, group=SIGNAL):
    """The signal and its noise."""

    waveform: Literal["sine", "cosine"] = parameter("cosine", "Waveform", live=False)
    """The true signal."""
    dimension: int = parameter(1, "Dimension", within=(1, 10, 1), live=False)
    """Number of independent copies of the signal that are tracked together."""
    observation_noise_sd: float = parameter(
        0.1, "Observation noise", within=(0.001, 10, 0.01), useful=(0.01, 1), role="world"
    )
    """Standard deviation of the noise on what is seen."""


class SignalSource:
    """Endless samples of the signal.

    Attributes:
        size: Width and height that a drawing of the signal takes, px.
        frame_rate_hz: Frames a second.
        frame_count: None; the signal never ends.
        start: The true value at frame 0.
    """

    frame_rate_hz = 60.0
    period_frames = 360

    def __init__(self, seed: int, parameters: SignalParameters) -> None:
        """Set the signal up; the seed is that of the observation noise."""
        self._seed = seed
        self.size = (720, 400)
        self.frame_count: int | None = None
        self.start = self._target(0, parameters)
        self.noisy = True

    def frame(self, index: int, history: History[SignalParameters]) -> Frame:
        """Return what is seen at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self._target(index, parameters)
        noise = Stream(self._seed, index, Purpose.SCENE).standard_normal(parameters.dimension)
        return Frame(
            index,
            index / self.frame_rate_hz,
            signal=target.position + parameters.observation_noise_sd * noise,
            target=target,
        )

    def _target(self, index: int, parameters: SignalParameters) -> Target:
        angle = 2 * np.pi * index / self.period_frames
        value = np.sin(angle) if parameters.waveform == "sine" else np.cos(angle)
        return Target(np.full(parameters.dimension, value), hidden=None)


GROUP = "Filter"


class SignalTrackerParameters(Parameters, group=GROUP):
    """Everything that can be turned on the trackers of a signal."""

    sample_count: int = particle_count(100, trackers=("condensation",))
    process_noise_sd: float = parameter(
        0.001, "Process noise", within=(1e-6, 1, 0.0005), useful=(0.0005, 0.05), role="noise"
    )
    """Standard deviation of what the motion model leaves out, each frame."""
    assumed_noise_sd: float = parameter(
        0.1, "Assumed observation noise", within=(0.001, 10, 0.01), useful=(0.01, 1), role="noise"
    )
    """Standard deviation of the noise as the filter takes it to be."""
    initial_sd: float = parameter(0, "Initial spread", within=(0, 10, 0.1), useful=(0, 2), live=False)
    """Standard deviation of both newest values around the true start."""
    resampling_threshold: float = resampling_threshold(trackers=("condensation",))


class Signal(PointModel):
    """A value that keeps its velocity, measured with noise (Bando 2007, ch. 2, eqs. 2.8 and 2.9)."""

    title = "measured value"
    evidence = "normalised"
    scales: ClassVar = {
        "process_noise_sd": NoiseScale("process"),
        "assumed_noise_sd": NoiseScale("observation"),
    }
    axes = None
    movable = True
    instants = 2
    observed = "frame.signal is what was measured, (d,); a value that is not finite is missing"
    example = "pftrack.experiments.sine.example_filter"
    reads = "condensation"

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        """Return the newest values and those before."""
        axes = range(1, parameters.dimension + 1)
        return tuple(Component(f"x{axis}{when}") for when in ("", " before") for axis in axes)

    @override
    def prior(self, target: Target, parameters: SignalTrackerParameters) -> Gaussian:
        """Return the true start, at rest, with the initial spread."""
        mean = np.tile(target.position, 2)
        return Gaussian(mean, parameters.initial_sd**2 * np.eye(len(mean)))

    @override
    def propagate(
        self, states: Floats, frame: Frame, parameters: SignalTrackerParameters, rng: Generator, known: State
    ) -> Floats:
        """Keep the velocity, but for the process noise."""
        dynamics = _dynamics(states.shape[1] // 2, parameters.process_noise_sd)
        return dynamics.diffuse(rng, dynamics.predict(states), np.arange(len(states)))

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: SignalTrackerParameters, known: State) -> Floats:
        """Return log N(signal | newest values, assumed noise), (N,); 0 where the sample is missing."""
        signal, noise_sd = signal_of(frame), parameters.assumed_noise_sd
        if not math.isfinite(signal.sum()):
            return np.zeros(len(states))
        constant = -len(signal) * math.log(noise_sd * math.sqrt(2.0 * math.pi))
        off = ((signal - states[:, : len(signal)]) ** 2).sum(axis=1)
        return np.asarray(constant - 0.5 / noise_sd**2 * off)

    @override
    def linear(self, frame: Frame, parameters: SignalTrackerParameters, known: State) -> LinearStep:
        """Return the same model as matrices."""
        signal = signal_of(frame)
        dimension = len(signal)
        return LinearStep(
            _dynamics(dimension, parameters.process_noise_sd),
            signal if math.isfinite(signal.sum()) else None,
            *_measurement(dimension, parameters.assumed_noise_sd),
        )

    @override
    def reach(self, size: tuple[int, int], count: int) -> Floats:
        """Return the values that the drawing shows."""
        return np.outer((-SPAN, SPAN), np.ones(count))

    @override
    def landing(self, current: Floats, place_px: Floats) -> Floats:
        """Return the values with another one of the first copy, which alone is drawn."""
        return np.append(SPAN * (1.0 - place_px[1] / (HEIGHT / 2)), current[1:])

    @override
    def parts(self, one: Floats, frame: Frame, parameters: SignalTrackerParameters, known: State) -> tuple[Part, ...]:
        """Return each measured value with that of a state."""
        pairs = zip(self.components(parameters), signal_of(frame).tolist(), one.tolist(), strict=False)
        return tuple(Residual(it.name, found, expected, parameters.assumed_noise_sd) for it, found, expected in pairs)


@lru_cache(maxsize=64)
def _dynamics(dimension: int, process_noise_sd: float) -> LinearDynamics:
    one = np.eye(dimension)
    return autoregression(2 * one, -one, np.zeros(dimension), process_noise_sd * one)


@lru_cache(maxsize=64)
def _measurement(dimension: int, assumed_noise_sd: float) -> tuple[Floats, Floats]:
    """Return C and R: the newest values are measured."""
    return np.eye(dimension, 2 * dimension), assumed_noise_sd**2 * np.eye(dimension)


def signal_of(frame: Frame) -> Floats:
    """Return what was measured, (d,).

    Raises:
        ValueError: The frame has a picture in place of a signal.
    """
    if frame.signal is None:
        raise ValueError("a tracker of signals needs a signal, got a picture")
    return frame.signal


MODEL = Signal()

TRACKERS = filtered(MODEL, Bootstrap("condensation"), Kalman("kalman"))
"""The trackers of a signal, by name, in the order in which they are shown."""

FOLDER = Path(__file__).parent

WIDTH, HEIGHT, MARGIN = 720, 400, 40
WINDOW_FRAMES = 360
SPAN = 1.6
"""The drawing shows values between -SPAN and SPAN."""
SLICES, ACROSS = 61, np.linspace(-3.0, 3.0, 17)
"""Slices of the density over the frames that are shown, and the places of each, in standard deviations."""
LEAST_SD = SPAN / 200.0
"""A density that is narrower than half a pixel is drawn as if it were as wide."""


class SineParameters(SignalTrackerParameters, SignalParameters):
    """The signal and its trackers."""


def simulate() -> Setup:
    """Wire the signal with Bando's values."""
    return Setup(SignalSource, SineParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw the first copy of the signal over time: truth, what is seen, the estimate and its band, the particles."""
    row = step.diagnostics
    first = max(row.frame - WINDOW_FRAMES, 0)
    rows = past[first : row.frame + 1]
    frames = np.array([past_row.frame for past_row in rows], dtype=np.float64) - first
    estimates = np.array([past_row.estimate[0] for past_row in rows])
    sigmas = np.array([past_row.sigma[0] for past_row in rows])
    primitives: dict[str, Primitive] = {"picture": Picture(_paper())}
    seen = [
        (frame, past_row.observation[0]) for frame, past_row in zip(frames, rows, strict=True) if past_row.observation
    ]
    if seen:
        points = _curve(np.array([frame for frame, _ in seen]), np.array([value for _, value in seen]))
        grey = np.full((len(points), 3), COLOURS["hidden"], dtype=np.uint8)
        primitives["observations"] = Points(points, grey, 2.0, "observations")
    truths = np.array([past_row.truth[0] for past_row in rows if past_row.truth])
    primitives["truth"] = Polyline(_curve(frames, truths), COLOURS["truth"], 2.0, "truth")
    for name, sign in (("upper", 2.0), ("lower", -2.0)):
        band = _curve(frames, estimates + sign * sigmas)
        primitives[name] = Polyline(band, COLOURS["observation"], 1.0, "uncertainty")
    references = [past_row.vector("exact") for past_row in rows]
    exact = np.array([reference[0] for reference in references if reference])
    if len(exact) == len(frames):
        primitives["exact"] = Polyline(_curve(frames, exact), COLOURS["second"], 2.0, "exact (Kalman)")
    primitives |= _density(frames, estimates, sigmas, row.frame)
    primitives["estimate"] = Polyline(_curve(frames, estimates), COLOURS["estimate"], 2.0, "estimate")
    newest = _curve(frames[-1:], estimates[-1:])[0, :2].astype(np.float64)
    primitives["now"] = circle(newest, 5.0, COLOURS["estimate"], "estimate")
    if other is not None:
        there = _curve(frames[-1:], np.array(other.estimate[:1]))[0, :2].astype(np.float64)
        primitives["second"] = circle(there, 5.0, COLOURS["second"], "second run")
    particles = step.state.particles
    if particles is not None:
        positions = _curve(np.full(len(particles), frames[-1]), particles.states[:, 0])[:, :2].astype(np.float64)
        primitives |= particle_clouds(positions, particles, 0, 4.0)
    return Drawing(WIDTH, HEIGHT, primitives, _caption(step), grip=_curve(frames[-1:], step.state.estimate[:1])[0])


def _density(frames: Floats, estimates: Floats, sigmas: Floats, now: int) -> dict[str, Primitive]:
    """Draw the density of the posterior as a surface over time and value, and an axis that explains the height.

    The usual density of the frames that are shown, which is that of their median deviation, is half as high as the
    heaviest particle. A density twice as high, or higher, is as high as that.
    """
    at = np.linspace(frames[0], frames[-1], SLICES)
    means, deviations = (np.interp(at, frames, values) for values in (estimates, sigmas))
    deviations = np.maximum(deviations, LEAST_SD)
    levels = np.outer(np.minimum(np.median(deviations) / deviations, 2.0) / 2.0, exponentials(-0.5 * ACROSS**2))
    values = means[:, None] + deviations[:, None] * ACROSS
    lift, layer, colour = LIFT * WIDTH, "density", COLOURS["camera"]
    vertices = _curve(np.repeat(at, len(ACROSS)), values.ravel())
    vertices[:, 2] += lift * levels.ravel()
    low, high = _curve(np.zeros(2), np.array([-SPAN, SPAN]))
    top = low + np.array([0.0, 0.0, lift], np.float32)
    last = _curve(frames[-1:], np.array([-SPAN]))[0]
    first = now - round(frames[-1])
    return {
        "density": Mesh(vertices, grid_faces(SLICES, len(ACROSS)), viridis(levels.ravel()), 0.8, layer),
        "axis": Links(np.stack([low, top])[None], colour, 1.5, layer),
        "axis density": Text(top, "density, weight", colour, layer, "end"),
        "axis value": Text(high, "value", colour, layer, "end"),
        "axis first": Text(low, f"frame {first}", colour, layer, "end"),
        "axis now": Text(last, f"frame {now}", colour, layer),
    }


def _caption(step: Step) -> str:
    row = step.diagnostics
    return caption(row, step.tracker_title, "" if row.error is None else f"error {row.error:.3f}")


def _curve(frames: Floats, values: Floats) -> NDArray[np.float32]:
    across = MARGIN + frames * (WIDTH - 2 * MARGIN) / WINDOW_FRAMES
    down = HEIGHT / 2 - np.clip(values, -SPAN, SPAN) * (HEIGHT / 2) / SPAN
    return at_height(np.stack([across, down], axis=1), 1.0)


@cache
def _paper() -> NDArray[np.uint8]:
    """White paper with lines at -1, 0 and 1."""
    paper = np.full((HEIGHT, WIDTH, 3), 255, dtype=np.uint8)
    for value in (-1.0, 0.0, 1.0):
        down = round(HEIGHT / 2 - value * (HEIGHT / 2) / SPAN)
        cv2.line(paper, (MARGIN, down), (WIDTH - MARGIN, down), (221, 221, 221), 1)
        cv2.putText(paper, f"{value:g}", (8, down + 4), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (96, 96, 96), 1, cv2.LINE_AA)
    paper.flags.writeable = False
    return paper


def _mean_distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    return np.abs(estimates - truths).mean(axis=-1)


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS),
    id="sine",
    model=MODEL,
    simulate=simulate,
    draw=draw,
    judge=Judge(_mean_distance, ""),
)
