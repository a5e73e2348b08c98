"""Simulated tracks of many points, and tracks of a file from a chosen frame on, as sources with what is known of them.

Simulated points move down the picture, aside and down again, measured with noise and with outliers: each track is that
of Ichimura and Ikoma 2000, section 5.1, 4 px a frame downwards, and from frame 50 to 54 aside, 5 px a frame. Its noise
is Gaussian but every fifteenth frame, when the horizontal noise is Cauchy. Their "scale 50" of that is its square: with
a scale of 50 px the likelihood of the linear model has its maximum in the corner of the grid, with the root of 50 it
has it where they report it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, FrameSequence, History, Measurements, Target
from pftrack.core.numerics.random import Purpose, standard_normals
from pftrack.experiments.shared.recording import RecordedFrames
from pftrack.sources.tracks import RecordedTracks, TrackSequence

# One simulated track in numbers (`reference_track.csv`), so that every implementation works on the same: x and y by
# frame, px. It is a draw of the model below, chosen among many since its likelihood over sigma^2 and tau^2 and the
# errors of the filters on it come closest to what Ichimura and Ikoma report. Its outliers, at frames 15, 30, 45, 60, 75
# and 90, are by +11.5, -0.2, -37.8, +2.5, -2.7 and -21.4 px.

REFERENCE_PX: Floats = np.loadtxt(Path(__file__).with_name("reference_track.csv"), delimiter=",", skiprows=1)
"""(100, 2) positions as they were measured."""

REFERENCE_PX.flags.writeable = False


class SelectionParameters(Parameters, group="Selection"):
    """Which track the run's estimate and error are of."""

    # fmt: off
    selected_track: int = parameter(
        0, "Selected track", "Number of the track that is looked at closely; its position is the run's estimate.",
        within=(0, 399, 1), useful=(0, 60))
    # fmt: on


class Motion(Protocol):
    """How the points of a scene truly move."""

    def path(self, points: Floats, index: int, born: Ints) -> Floats:
        """Return where points of the scene are in a frame, (K, 2) px; NaN where that is not known.

        Args:
            points: (K, 2) where each was in the frame in which it was taken up, px.
            index: Number of the frame.
            born: (K,) number of the frame in which each was taken up.
        """


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """What tracks of a file were in the file.

    Attributes:
        names: (K,) of the tracks.
        scale: px of the picture for a unit of the file.
        corner: (2,) where the picture's corner is, in the file's unit.
        first_frame: Number in the file of the frame 0 of the run.
    """

    names: tuple[str, ...]
    scale: float
    corner: Floats
    first_frame: int


@dataclass(frozen=True, slots=True)
class TrajectoriesTarget(Target):
    """Many points; `position` is that of the selected one.

    Attributes:
        motion: How they truly move; None where that is not known.
        start_px: (K, 2) where they are in frame 0, if which points are followed is known beforehand.
        origin: What they were in a file; None for others.
        paper: Width and height of what is drawn on where there are no pictures, px.
    """

    motion: Motion | None = None
    start_px: Floats | None = None
    origin: Origin | None = None
    paper: tuple[int, int] = (0, 0)


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


class TracksSceneParameters(SelectionParameters, group=MEASUREMENTS):
    """The simulated tracks and their noise."""

    # fmt: off
    track_count: int = parameter(
        6, "Tracks", "How many tracks there are; all move alike and have noise of their own.",
        within=(1, 200, 1), useful=(1, 60), live=False)
    reference_track: bool = parameter(
        True, "Reference track", "Whether the first track is the one whose numbers are the same in every run.",
        live=False)
    horizontal_variance_px2: float = parameter(
        2, "Horizontal noise", "Variance of the measurements across.",
        unit="px²", within=(0, 50, 0.5), useful=(0, 20), role="world")
    vertical_variance_px2: float = parameter(
        0.5, "Vertical noise", "Variance of the measurements downwards.",
        unit="px²", within=(0, 50, 0.5), useful=(0, 20), role="world")
    outlier_every: int = parameter(
        15, "Outlier every", "Every so many frames the horizontal noise is Cauchy; beyond 99 it never is.",
        unit="frames", within=(1, 100, 1))
    outlier_frames: int = parameter(
        1, "Outliers last", "For how many frames a track stays where an outlier has taken it.",
        unit="frames", within=(1, 50, 1), useful=(1, 20))
    outlier_scale_px2: float = parameter(
        50, "Size of outliers", "Square of the scale of the Cauchy noise.",
        unit="px²", within=(0, 2500, 10), useful=(0, 500), role="world")
    # fmt: on


def true_path(frames: int) -> Floats:
    """Return (frames, 2) true positions of the first track, px."""
    moves = np.tile(DOWN, (max(frames - 1, 0), 1))
    moves[ASIDE_FROM:ASIDE_TO] = ASIDE
    return np.asarray(START_PX + np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)]))


TRUE_PATH = true_path(FRAMES)


class Falling:
    """The motion of all simulated tracks."""

    def path(self, points: Floats, index: int, born: Ints) -> Floats:
        """Return where points are in a frame, (K, 2) px."""
        return np.asarray(points + TRUE_PATH[index] - TRUE_PATH[born])


def _beginnings(count: int) -> Floats:
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

    def _noise(self, index: int, parameters: TracksSceneParameters) -> Floats:
        every = parameters.outlier_every
        since = index % every if FRAMES > every <= index else FRAMES
        across, down, _, _ = self._numbers(index)
        aside = np.sqrt(parameters.horizontal_variance_px2) * across
        if since < parameters.outlier_frames:
            _, _, above, below = self._numbers(index - since)
            aside = np.sqrt(parameters.outlier_scale_px2) * above / below + (aside if since else 0.0)
        return np.stack([aside, np.sqrt(parameters.vertical_variance_px2) * down], axis=1)

    def _numbers(self, index: int) -> Floats:
        """Return (4, K) normal numbers; a track's do not depend on how many others there are."""
        numbers = [standard_normals(self._seed, index, Purpose.SCENE.value, k, 4) for k in range(len(self._starts))]
        return np.array(numbers).T

    def _target(self, index: int, parameters: TracksSceneParameters) -> TrajectoriesTarget:
        position = self._starts[parameters.selected_track % len(self._starts)] + TRUE_PATH[index] - START_PX
        return TrajectoriesTarget(position, hidden=None, motion=Falling(), start_px=self._starts, paper=SIZE_PX)


def simulate(seed: int, parameters: TracksSceneParameters) -> tuple[Floats, Floats]:
    """Return all measurements (100, K, 2) of a scene, px, and the true positions."""
    source, history = TracksSource(seed, parameters), History(((0, parameters),))
    frames = [source.frame(index, history) for index in range(FRAMES)]
    measured = [frame.measurements.points_px for frame in frames if frame.measurements is not None]
    truths = source._starts + TRUE_PATH[:, None] - START_PX  # noqa: SLF001 - of this very module
    return np.array(measured), truths


NOWHERE: Floats = np.full(2, np.nan)
NOWHERE.flags.writeable = False


def tracks_from(sequence: TrackSequence, first: int) -> RecordedTracks:
    """Return the tracks of a table from the frame `first` on, of which nothing is known but what they were in the file.

    Raises:
        ParameterError: That is not within the sequence.
    """
    origin = Origin(tuple(sequence.names), sequence.scale, sequence.origin, sequence.first_frame + first)
    return RecordedTracks(sequence, TrajectoriesTarget(NOWHERE, hidden=None, origin=origin, paper=sequence.size), first)


class RecordedPictures(RecordedFrames):
    """The pictures of a recording, in which the tracker looks for points itself: nothing is known beforehand."""

    def __init__(self, sequence: FrameSequence, first: int = 0) -> None:
        """Wire a recording up from the picture `first` on."""
        super().__init__(sequence, first, TrajectoriesTarget(NOWHERE, hidden=None))

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return a picture; the same arguments give the same frame, to the bit."""
        del history
        return Frame(index, float(self._times_s[index]), image_rgb=self._sequence.picture(self._first + index))
