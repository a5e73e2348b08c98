"""Simulated tracks of many points, and tracks of a file from a chosen frame on, as sources with what is known of them.

Simulated points move down the picture, aside and down again, measured with noise and with outliers: each track is that
of Ichimura and Ikoma 2000, section 5.1, 4 px a frame downwards, and from frame 50 to 54 aside, 5 px a frame. Its noise
is Gaussian but every fifteenth frame, when the horizontal noise is Cauchy. Their "scale 50" of that is its square: with
a scale of 50 px the likelihood of the linear model has its maximum in the corner of the grid, with the root of 50 it
has it where they report it.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, FrameSequence, History, Measurements, Target
from pftrack.core.numerics.random import Purpose, standard_normals
from pftrack.sources.tracks.sequence import RecordedTracks, TrackSequence

# One simulated track in numbers, so that every implementation works on the same: x and y by frame, px. It is a draw of
# the model below, chosen among many since its likelihood over sigma^2 and tau^2 and the errors of the filters on it
# come closest to what Ichimura and Ikoma report. Its outliers, at frames 15, 30, 45, 60, 75 and 90, are by +11.5, -0.2,
# -37.8, +2.5, -2.7 and -21.4 px.

TABLE = """
101.19,100.27  98.45,103.63  99.69,107.96  103.25,111.81  102.61,115.09
99.06,119.63  99.19,123.09  100.93,128.04  100.56,132.56  98.31,135.64
99.94,139.83  99.42,144.87  102.70,147.96  99.24,151.67  100.52,155.80
111.54,161.07  99.79,164.44  99.86,168.35  97.22,171.74  102.93,176.18
100.39,179.47  101.48,182.92  98.25,188.49  98.06,190.92  102.09,196.75
100.43,200.39  100.89,202.69  100.52,207.94  100.13,212.47  100.89,215.05
99.85,219.60  102.30,223.73  99.50,228.87  101.41,232.29  101.10,234.88
100.05,239.71  103.23,243.21  100.70,248.29  100.10,251.28  101.62,255.73
100.58,260.30  99.34,262.04  99.18,268.41  97.33,271.86  99.56,276.11
62.18,280.34  99.78,282.90  98.94,287.60  101.52,292.72  98.51,296.75
101.39,298.65  104.78,299.38  109.13,299.78  116.46,301.40  119.88,300.65
124.59,302.07  124.34,307.44  122.24,310.44  123.65,315.38  124.93,319.75
127.46,322.90  124.26,326.05  125.47,329.81  125.16,333.77  125.45,337.80
123.83,341.95  124.67,345.55  125.05,350.42  124.71,353.55  124.77,358.39
125.97,363.14  124.62,367.05  123.86,371.14  125.52,374.21  125.41,378.54
122.30,381.55  124.32,385.84  122.71,391.74  125.00,394.62  123.96,398.76
123.77,401.61  125.01,407.19  125.56,410.27  124.00,415.40  123.94,418.71
126.22,422.49  123.16,426.91  126.45,431.36  122.89,433.68  124.22,438.68
103.63,442.30  122.88,446.81  125.61,450.46  124.24,455.87  125.76,457.93
126.80,462.16  124.73,466.73  124.37,471.51  126.39,475.67  124.19,478.30
"""

REFERENCE_PX: Floats = np.array([pair.split(",") for pair in TABLE.split()], dtype=np.float64)
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


class RecordedPictures:
    """The pictures of a recording, in which the tracker looks for points itself.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: Nothing is known beforehand.
        noisy: The pictures do not depend on the seed.
    """

    noisy = False

    def __init__(self, sequence: FrameSequence, first: int = 0) -> None:
        """Wire a recording up from the picture `first` on."""
        self._sequence, self._first = sequence, first
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start: Target = TrajectoriesTarget(NOWHERE, hidden=None)

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return a picture; the same arguments give the same frame, to the bit."""
        del history
        return Frame(index, float(self._times_s[index]), image_rgb=self._sequence.picture(self._first + index))
