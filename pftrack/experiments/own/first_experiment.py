"""A dot on a noisy path, followed by a particle filter: a first version of NAME, to be changed."""

import numpy as np
from scipy.ndimage import map_coordinates

from pftrack.core.geometry import paint_disc
from pftrack.core.model.glossary import cite
from pftrack.core.model.likelihood import Component
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.preset import Preset
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.experiment import INTERFACE, Display, Experiment, Judge, Texts
from pftrack.experiments.shared.filtered import Bootstrap, PointModel, filtered
from pftrack.experiments.shared.reports import particle_count
from pftrack.experiments.shared.sketch import POINT_LAYERS, distance, draw_point_frame


class DotParameters(Parameters, group="Dot"):  # each is a slider, and may be an axis of a sweep
    sample_count: int = particle_count(300)
    step_px: float = parameter(8.0, "Step", unit="px", within=(0.1, 60, 0.1))
    """How far the dot may move in a frame."""
    hidden_frames: int = parameter(2, "Hidden", unit="frames", within=(0, 60, 1))
    """Frames without the dot."""


class DotScene:  # what is simulated, with its truth
    size, frame_rate_hz, frame_count, noisy = (320, 240), 30.0, None, True

    def __init__(self, seed: int, _parameters: DotParameters) -> None:
        self.phase = 6.28 * Stream(seed, 0, Purpose.SCENE).random()
        self.start = self.target(0)

    def target(self, index: int) -> Target:
        angle = self.phase + index / 20
        return Target(np.array([160 + 110 * np.sin(angle), 120 + 70 * np.sin(2 * angle)]), 10.0)

    def frame(self, index: int, history) -> Frame:
        image, target = np.full((240, 320, 3), 40, np.uint8), self.target(index)
        if index % 60 < 60 - history.at(index).hidden_frames:
            paint_disc(image, target.position[0], target.position[1], target.size / 2, (220, 220, 220))
        return Frame(index, index / 30, image_rgb=image, target=target)


class Dot(PointModel):  # what is believed: prior, move, weigh
    title = "brightness of the pixel"

    def components(self, parameters):
        return Component("u", "px"), Component("v", "px")

    def prior(self, target, parameters):
        return Gaussian(target.position, np.eye(2))

    def propagate(self, states, frame, parameters, rng, known):
        return states + parameters.step_px * rng.standard_normal(states.shape)

    def log_likelihood(self, states, frame, parameters, known):
        grey = map_coordinates(frame.picture[..., 0], states.T[::-1], order=0)  # 0 outside the picture
        return np.where(grey > 128, 0.0, -4.0)


EXPERIMENT = Experiment(
    id="NAME",
    title="A dot",
    texts=Texts(
        "How long may the dot be hidden?",
        "A dot runs along a path and is hidden from time to time.",
        (cite("bando2007", "chapter 2: particle filters"),),
    ),
    trackers=filtered(Dot(), Bootstrap("bootstrap", "Particle filter", "Moves at random and weighs by brightness.")),
    presets=(
        Preset("works", "works", "bootstrap"),
        Preset("hidden", "hidden for long", "bootstrap", {"hidden_frames": 40}),
    ),
    display=Display(POINT_LAYERS),
    simulate=lambda: Setup(DotScene, DotParameters()),
    draw=draw_point_frame,
    judge=Judge(distance, "px", lambda errors, sizes, parameters: errors > 2 * sizes),
    model=Dot(),
    interface=INTERFACE,
)
