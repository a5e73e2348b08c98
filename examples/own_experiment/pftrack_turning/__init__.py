"""A disc turns up or down behind a strip. Particles with a rate of turn wait for it on both sides."""
# ruff: noqa: ARG002 - all models have the same arguments

from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.glossary import cite
from pftrack.core.model.likelihood import Component
from pftrack.core.model.marks import Box
from pftrack.core.model.model import State
from pftrack.core.model.parameters import parameter, revise
from pftrack.core.model.preset import ExampleSweep, Preset
from pftrack.core.model.series import STANDARD_PLOTS, Interval, Plot, Series, SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, History, Target, Truth
from pftrack.core.numerics.random import Gaussian, Generator, Purpose, Stream
from pftrack.experiments.experiment import Display, Experiment, Judge, Texts, Video
from pftrack.experiments.shared.filtered import Bootstrap, PointModel, filtered
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource, paint
from pftrack.experiments.shared.reports import particle_count
from pftrack.experiments.shared.sketch import POINT_LAYERS, distance, draw_point_frame


class Parameters(RecordingParameters, group="Disc"):
    """Parameters of the filters and of the drawn overlays."""

    sample_count: int = particle_count(500)
    sharpest_deg: float = parameter(10, "Sharpest turn", unit="deg", within=(0, 30, 0.5), trackers=("turning",))
    """Largest turn in a frame."""
    change: float = parameter(0.05, "Change", within=(0, 1, 0.01), trackers=("turning",))
    """Probability that the turn changes in a frame."""
    radius_px: float = parameter(8, "Radius", unit="px", within=(1, 200, 0.5))
    """Radius of the disc."""
    brightness: float = parameter(230, "Brightness", within=(0, 255, 1))
    """Grey level of the disc."""


class Scene:
    """Endless frames: the disc runs to the right, turns behind the strip and comes round again."""

    size, frame_rate_hz, noisy = (320, 240), 30.0, True
    frame_count: int | None = None

    def __init__(self, seed: int, _parameters: Parameters) -> None:
        self._seed = seed
        sides = np.where(Stream(seed, 0, Purpose.SCENE).random(50) < 0.5, -1, 1)  # up or down, for 50 laps
        turns = np.outer(sides, np.repeat([0, np.pi / 27, 0, np.pi / 27], [30, 27, 30, 27]))  # rad, for each frame
        self._path = 90 + 120j + 4.7 * np.cumsum(np.exp(1j * np.cumsum(turns)))
        self.start = self._target(0)

    def _target(self, index: int) -> Target:
        place = self._path[index % len(self._path)]
        return Target(np.array([place.real, place.imag]), 16.0)

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        target, image = self._target(index), np.full((240, 320, 3), 120, np.uint8)
        paint_disc(image, target.position[0], target.position[1], 8.0, (230, 230, 230))
        paint(image, history.at(index), "#e6e6e6")
        noise = 4 * Stream(self._seed, index + 1, Purpose.SCENE).standard_normal((240, 320, 1))
        return Frame(index, index / 30, image_rgb=np.clip(image + noise, 0, 255).astype(np.uint8), target=target)


class Disc(PointModel):
    """The belief in a disc (x, y, vx, vy, turn) that turns, or else moves straight on."""

    title = "brightness inside and around"

    def __init__(self, *, turns: bool) -> None:
        self.turns = turns

    def components(self, parameters: Parameters) -> tuple[Component, ...]:
        """Name the coordinates of a state."""
        return *(Component(name, "px") for name in ("x", "y", "vx", "vy")), Component("turn", "rad")

    def prior(self, target: Target, parameters: Parameters) -> Gaussian:
        """Begin at the mark, at rest."""
        return Gaussian(np.append(target.position, [0, 0, 0]), np.diag([1.0, 1.0, 16.0, 16.0, 0.0]))

    def propagate(self, states: Floats, frame: Frame, parameters: Parameters, rng: Generator, known: State) -> Floats:
        """Change some of the turns, and move."""
        x, y, vx, vy, turn = states.T
        chance, rate = rng.random((2, len(states)))
        sharpest = np.deg2rad(parameters.sharpest_deg) if self.turns else 0.0
        turn = np.where(chance < parameters.change, (2 * rate - 1) * sharpest, turn.clip(-sharpest, sharpest))
        velocity = (vx + 1j * vy) * np.exp(1j * turn) + 0.3 * rng.standard_normal((len(states), 2)) @ [1, 1j]
        return np.stack([x + velocity.real, y + velocity.imag, velocity.real, velocity.imag, turn], axis=1)

    def log_likelihood(self, states: Floats, frame: Frame, parameters: Parameters, known: State) -> Floats:
        """Compare 16 pixels inside the disc, which should match it, and 8 around it, which should not."""
        circles = np.outer(parameters.radius_px * np.array([0.4, 0.85, 1.15]), np.exp(2j * np.pi * np.arange(8) / 8))
        x, y = states[:, 0, None, None] + circles.real, states[:, 1, None, None] + circles.imag
        grey = map_coordinates(frame.picture.mean(axis=2), [y, x], order=0, cval=-999)
        near, far, around = (np.abs(grey - parameters.brightness) < 40).mean(axis=2).T
        return np.asarray(12 * (near + far - around))

    @property
    def series(self) -> tuple[Series, ...]:
        """The rate of turn, in addition to the series of every particle filter."""
        return *super().series, Series("turn", "rate of turn", "deg", "interval")

    def measure(self, state: State) -> dict[str, SeriesValue]:
        """Return the values of the series."""
        mean, sd = np.rad2deg([state.posterior.mean[4], state.posterior.standard_deviations[4]])
        return {**super().measure(state), "turn": Interval(mean - 2 * sd, mean + 2 * sd)}


def wire(sequence: FrameSequence, mark: Box, start: int, truth: Truth | None) -> Setup:
    """Wire a recording: most of the pixels in the box are those of the disc."""
    x, y, width, height = mark.corner_and_size
    inside = sequence.picture(start)[int(y) : int(y + height), int(x) : int(x + width)]
    source = RecordingSource(sequence, mark.corner_and_size, start, truth.at if truth else None)
    seen = {"radius_px": float(np.clip(max(width, height) / 2, 1, 200)), "brightness": float(np.median(inside))}
    return Setup(lambda _seed, _parameters: source, revise(Parameters(), seen))


EXPERIMENT = Experiment(
    id="turning",
    title="A turn out of sight",
    texts=Texts(
        "Which way did it turn while nobody could see it?",
        "A disc turns behind a strip. Particles that may turn find it again, others go straight on.",
        (cite("bando2007", "chapter 2: particle filters"),),
        target="disc",
    ),
    trackers={
        **filtered(Disc(turns=True), Bootstrap("turning", "Turning", "Each particle has a rate of turn.")),
        **filtered(Disc(turns=False), Bootstrap("straight", "Straight on", "Expects no turn.")),
    },
    presets=(Preset("works", "works", "turning"), Preset("straight", "breaks: expects no turn", "straight")),
    display=Display(
        POINT_LAYERS,
        (*STANDARD_PLOTS, Plot("turn", "turn", "interval", "Probable rates of turn.", "deg", ("turn",))),
        thumbnail=Path(__file__).with_name("thumbnail.webp"),
    ),
    simulate=lambda: Setup(Scene, Parameters(occlusion_width_px=40, occlusion_offset_px=75)),
    video=Video(wire, marks=(Box,), wanted="a box around the disc"),
    draw=draw_point_frame,
    judge=Judge(distance, "px", lambda errors, sizes, _parameters: errors > sizes),
    example_sweep=ExampleSweep({"occlusion_width_px": (0, 20, 40, 60, 80)}, ("turning", "straight"), 4, 120),
    model=Disc(turns=True),
    interface=4,
)
