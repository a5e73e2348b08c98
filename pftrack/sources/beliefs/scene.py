"""An example of a recording that is made up, frame by frame: two discs that pass each other, and beliefs of both.

There is no tracker behind it. The particles of a disc lie around a point that is off its centre by a random error, and
are as wide as that error is on average: so what they say of themselves is right, and can be checked. Where the discs
meet, their numbers may be confused, as trackers of several targets do.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.belief import Belief, Beliefs, Plane
from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.sources.beliefs.recorded import target_of
from pftrack.sources.beliefs.selection import SelectionParameters
from pftrack.sources.overlay import paint_disc

__all__ = ["FRAMES", "UNITS", "ExampleParameters", "ExampleSource"]

FRAMES = 120
SIZE_PX = (480, 320)
GROUP = "Example"
PAPER, COLOURS = 245, ((86, 180, 233), (230, 159, 0))
RADIUS_PX, BOX_PX = 14.0, 28.0
MEETING = 60
"""The frame in which the discs are nearest to each other."""

NAMES = ("x", "y", "vx", "vy")
UNITS = ("px", "px", "px/frame", "px/frame")
VELOCITY_SD_PX = 0.5


class ExampleParameters(SelectionParameters):
    """The example that is made up."""

    # fmt: off
    example_particles: int = parameter(
        300, "Particles", "How many particles there are of each target.",
        ge=1, le=10_000, step=1, live=False, group=GROUP, role="particles", sets=2)
    example_error_px: float = parameter(
        4, "Error", "Standard deviation of the estimate's error, and of the particles.",
        unit="px", ge=0.1, le=50, step=0.1, group=GROUP, role="world")
    confuse_numbers: bool = parameter(
        False, "Confuse numbers", "Whether the two targets have each other's number after they met.",
        group=GROUP)
    # fmt: on


class ExampleSource:
    """The frames of the example.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: How many there are.
        start: Where the selected disc is in frame 0.
        noisy: The errors depend on the seed.
    """

    frame_rate_hz = 30.0
    noisy = True

    def __init__(self, seed: int, parameters: ExampleParameters) -> None:
        """Set the example up; the seed is that of the errors.

        Raises:
            ParameterError: There is no such target or component.
        """
        self._seed = seed
        self._selected = 2 if parameters.selected_target == 2 else 1
        self._components = (min(parameters.component_across, 3), min(parameters.component_down, 3))
        self.size = SIZE_PX
        self.frame_count: int | None = FRAMES
        self.start = self._target(0) or Target(np.zeros(2))

    def frame(self, index: int, history: History[ExampleParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        believed = {target: _belief(self._seed, index, target, parameters) for target in (1, 2)}
        if parameters.confuse_numbers and index >= MEETING:
            believed = {1: believed[2], 2: believed[1]}
        switched = parameters.confuse_numbers and index == MEETING
        beliefs = Beliefs(
            _numbered(believed[self._selected], self._selected),
            present=True,
            others=(_numbered(believed[3 - self._selected], 3 - self._selected),),
            truths=tuple(_truth(index, target) for target in (1, 2)),
            switches=2 if switched else 0,
            components=self._components,
            names=NAMES,
            plane=Plane(SIZE_PX),
        )
        return Frame(
            index, index / self.frame_rate_hz, image_rgb=_picture(index), target=self._target(index), beliefs=beliefs
        )

    def _target(self, index: int) -> Target | None:
        return target_of(_truth(index, self._selected), self._components)


def _state(index: int, target: int) -> NDArray[np.float64]:
    """Return the true place and velocity of a disc, px and px a frame."""
    pace = 3.2 if target == 1 else -3.2
    x = SIZE_PX[0] / 2 + pace * (index - MEETING)
    bend = 1.0 if target == 1 else -1.0
    y = SIZE_PX[1] / 2 + bend * (18.0 + 0.008 * (index - MEETING) ** 2)
    return np.array([x, y, pace, bend * 0.016 * (index - MEETING)])


def _truth(index: int, target: int) -> Belief:
    state = _state(index, target)
    return Belief(target, mean=state, box=_box(state))


def _box(state: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([*(state[:2] - (BOX_PX - 1.0) / 2.0), BOX_PX, BOX_PX])


def _belief(seed: int, index: int, target: int, parameters: ExampleParameters) -> Belief:
    stream = Stream(seed, index, Purpose.SCENE)
    spread = np.array([parameters.example_error_px] * 2 + [VELOCITY_SD_PX] * 2)
    count = parameters.example_particles
    normals = stream.standard_normal((2, count + 1, 4))[target - 1]
    middle = _state(index, target) + spread * normals[0]
    # Every second one has twice the weight, as if it had been resampled less.
    weights = np.where(np.arange(count) % 2 == 0, 2.0, 1.0)
    ancestors = np.arange(count) - np.arange(count) % 3
    return Belief(
        target,
        particles=middle + spread * normals[1:],
        log_weights=np.where(weights == 2.0, np.float64(0.6931471805599453), np.float64(0.0)),
        ancestors=ancestors,
        box=_box(middle),
    )


def _numbered(belief: Belief, target: int) -> Belief:
    return Belief(
        target,
        particles=belief.particles,
        log_weights=belief.log_weights,
        ancestors=belief.ancestors,
        box=belief.box,
    )


def _picture(index: int) -> NDArray[np.uint8]:
    image = np.full((SIZE_PX[1], SIZE_PX[0], 3), PAPER, dtype=np.uint8)
    for target, colour in zip((1, 2), COLOURS, strict=True):
        x, y, _, _ = _state(index, target).tolist()
        paint_disc(image, x, y, RADIUS_PX, colour)
    image.flags.writeable = False
    return image
