"""Simulated tracks: points that move down the picture, aside and down again, measured with noise and with outliers.

Each track is that of Ichimura and Ikoma 2000, section 5.1: 4 px a frame downwards, and from frame 50 to 54 aside, 5 px
a frame. Its noise is Gaussian but every fifteenth frame, when the horizontal noise is Cauchy. Their "scale 50" of that
is its square: with a scale of 50 px the likelihood of the linear model has its maximum in the corner of the grid, with
the root of 50 it has it where they report it.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Measurements, Target
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, standard_normals
from pftrack.experiments.trajectories.scene.reference import REFERENCE_PX
from pftrack.experiments.trajectories.scene.target import SelectionParameters, TrajectoriesTarget

__all__ = ["FRAMES", "SIZE_PX", "TracksSceneParameters", "TracksSource", "simulate", "true_path"]

FRAMES = 100
SIZE_PX = (640, 520)
FRAME_RATE_HZ = 30.0
START_PX = np.array([100.0, 100.0])
DOWN, ASIDE = np.array([0.0, 4.0]), np.array([5.0, 0.5])
ASIDE_FROM, ASIDE_TO = 50, 55
"""Frames after which the velocity changes."""

ACROSS, APART_PX, SHIFT_PX = 6, 80.0, 13.0
"""Tracks beside each other, how far apart, and how far further ones are shifted against them."""

MEASUREMENTS = "Measurements"


class TracksSceneParameters(SelectionParameters):
    """The simulated tracks and their noise."""

    # fmt: off
    track_count: int = parameter(
        6, "Tracks", "How many tracks there are; all move alike and have noise of their own.",
        ge=1, le=200, step=1, live=False, group=MEASUREMENTS)
    reference_track: bool = parameter(
        True, "Reference track", "Whether the first track is the one whose numbers are the same in every run.",
        live=False, group=MEASUREMENTS)
    horizontal_variance_px2: float = parameter(
        2, "Horizontal noise", "Variance of the measurements across.",
        unit="px²", ge=0, le=50, step=0.5, group=MEASUREMENTS, role="world")
    vertical_variance_px2: float = parameter(
        0.5, "Vertical noise", "Variance of the measurements downwards.",
        unit="px²", ge=0, le=50, step=0.5, group=MEASUREMENTS, role="world")
    outlier_every: int = parameter(
        15, "Outlier every", "Every so many frames the horizontal noise is Cauchy; beyond 99 it never is.",
        unit="frames", ge=1, le=100, step=1, group=MEASUREMENTS)
    outlier_frames: int = parameter(
        1, "Outliers last", "For how many frames a track stays where an outlier has taken it.",
        unit="frames", ge=1, le=50, step=1, group=MEASUREMENTS)
    outlier_scale_px2: float = parameter(
        50, "Size of outliers", "Square of the scale of the Cauchy noise.",
        unit="px²", ge=0, le=2500, step=10, group=MEASUREMENTS, role="world")
    # fmt: on


def true_path(frames: int) -> NDArray[np.float64]:
    """Return (frames, 2) true positions of the first track, px."""
    moves = np.tile(DOWN, (max(frames - 1, 0), 1))
    moves[ASIDE_FROM:ASIDE_TO] = ASIDE
    return np.asarray(START_PX + np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)]))


TRUE_PATH = true_path(FRAMES)


class Falling:
    """The motion of all simulated tracks."""

    def path(self, points: NDArray[np.float64], index: int, born: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return where points are in a frame, (K, 2) px."""
        return np.asarray(points + TRUE_PATH[index] - TRUE_PATH[born])


def _beginnings(count: int) -> NDArray[np.float64]:
    """Return where tracks truly begin, (count, 2) px."""
    number = np.arange(count)
    across = APART_PX * (number % ACROSS) + SHIFT_PX * (number // ACROSS) % APART_PX
    return np.asarray(START_PX + np.stack([across, np.zeros(count)], axis=1))


class TracksSource:
    """Measured tracks, frame by frame, over a history of parameters.

    Attributes:
        size: Width and height of the picture in which they are drawn, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: Ichimura and Ikoma's 100.
        start: Of frame 0.
        noisy: The measurements depend on the seed.
    """

    size = SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    frame_count: int | None = FRAMES
    noisy = True

    def __init__(self, seed: int, parameters: TracksSceneParameters) -> None:
        """Set the scene; the seed is that of the noise."""
        self._seed = seed
        self._starts = _beginnings(parameters.track_count)
        self._reference = parameters.reference_track
        self.start: Target = self._target(0, parameters)

    def frame(self, index: int, history: History[TracksSceneParameters]) -> Frame:
        """Return the measurements of a frame; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self._target(index, parameters)
        points = self._starts + TRUE_PATH[index] - START_PX + self._noise(index, parameters)
        if self._reference:
            points[0] = REFERENCE_PX[index]
        sd = np.sqrt([parameters.horizontal_variance_px2, parameters.vertical_variance_px2])
        measured = Measurements(points, np.broadcast_to(sd, points.shape))
        return Frame(index, index / FRAME_RATE_HZ, measurements=measured, target=target)

    def _noise(self, index: int, parameters: TracksSceneParameters) -> NDArray[np.float64]:
        every = parameters.outlier_every
        since = index % every if FRAMES > every <= index else FRAMES
        across, down, _, _ = self._numbers(index)
        aside = np.sqrt(parameters.horizontal_variance_px2) * across
        if since < parameters.outlier_frames:
            _, _, above, below = self._numbers(index - since)
            aside = np.sqrt(parameters.outlier_scale_px2) * above / below + (aside if since else 0.0)
        return np.stack([aside, np.sqrt(parameters.vertical_variance_px2) * down], axis=1)

    def _numbers(self, index: int) -> NDArray[np.float64]:
        """Return (4, K) normal numbers; a track's do not depend on how many others there are."""
        numbers = [standard_normals(self._seed, index, Purpose.SCENE.value, k, 4) for k in range(len(self._starts))]
        return np.array(numbers).T

    def _target(self, index: int, parameters: TracksSceneParameters) -> TrajectoriesTarget:
        position = self._starts[parameters.selected_track % len(self._starts)] + TRUE_PATH[index] - START_PX
        return TrajectoriesTarget(position, hidden=None, motion=Falling(), start_px=self._starts, paper=SIZE_PX)


def simulate(seed: int, parameters: TracksSceneParameters) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return all measurements (100, K, 2) of a scene, px, and the true positions."""
    source, history = TracksSource(seed, parameters), History(((0, parameters),))
    frames = [source.frame(index, history) for index in range(FRAMES)]
    measured = [frame.measurements.points_px for frame in frames if frame.measurements is not None]
    truths = source._starts + TRUE_PATH[:, None] - START_PX  # noqa: SLF001 - of this very module
    return np.array(measured), truths
