"""Simulated tracks of many points, and tracks of a file from a chosen frame on, as sources with prior knowledge.

Simulated points move down the picture, aside and down again, measured with noise and with outliers: each track is that
of Ichimura and Ikoma 2000, section 5.1, 4 px a frame downwards, and from frame 50 to 54 aside, 5 px a frame. Its noise
is Gaussian but every fifteenth frame, when the horizontal noise is Cauchy. Their "scale 50" of that is its square: with
a scale of 50 px the likelihood of the linear model has its maximum in the corner of the grid, with the root of 50 it
has it where they report it.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter, revise
from pftrack.core.model.source import Frame, FrameSequence, History, Measurements, Target
from pftrack.core.numerics.random import Purpose, Stream, standard_normals
from pftrack.experiments.shared.recording import RecordedFrames
from pftrack.experiments.trajectories.corners import DetectorParameters, find_corners
from pftrack.sources.tracks import RecordedTracks, TrackSequence

# One simulated track in numbers (`reference_track.csv`), the same for every implementation: x and y by frame, px. It is
# a draw of the model below, chosen among many since its likelihood over sigma^2 and tau^2 and the errors of the filters
# on it come closest to what Ichimura and Ikoma report. Its outliers, at frames 15, 30, 45, 60, 75 and 90, are by +11.5,
# -0.2, -37.8, +2.5, -2.7 and -21.4 px.

REFERENCE_PX: Floats = np.loadtxt(Path(__file__).with_name("reference_track.csv"), delimiter=",", skiprows=1)
"""(100, 2) positions as they were measured."""

REFERENCE_PX.flags.writeable = False


class SelectionParameters(Parameters, group="Selection"):
    """Track of the run's estimate and error."""

    selected_track: int = parameter(0, "Selected track", within=(0, 399, 1), useful=(0, 60))
    """Number of the selected track; its position is the run's estimate."""


class Motion(Protocol):
    """True motion of a scene's points."""

    def path(self, points: Floats, index: int, born: Ints) -> Floats:
        """Return where points of the scene are in a frame, (K, 2) px; NaN where that is not known.

        Args:
            points: (K, 2) where each was in the frame in which it was taken up, px.
            index: Number of the frame.
            born: (K,) number of the frame in which each was taken up.
        """


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """Original form of tracks in their file.

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
        motion: Their true motion; None where that is not known.
        start_px: (K, 2) where they are in frame 0, if which points are followed is known beforehand.
        origin: Original form in a file; None for others.
        paper: Width and height of the paper without pictures, px.
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
"""Number of tracks in a row, their distance, and the shift of further rows."""

MEASUREMENTS = "Measurements"


class TracksSceneParameters(SelectionParameters, group=MEASUREMENTS):
    """The simulated tracks and their noise."""

    track_count: int = parameter(6, "Tracks", within=(1, 200, 1), useful=(1, 60), live=False)
    """Number of tracks; all move alike with independent noise."""
    reference_track: bool = parameter(True, "Reference track", live=False)
    """Whether the first track is the one whose numbers are the same in every run."""
    horizontal_variance_px2: float = parameter(
        2, "Horizontal noise", unit="px²", within=(0, 50, 0.5), useful=(0, 20), role="world"
    )
    """Variance of the measurements across."""
    vertical_variance_px2: float = parameter(
        0.5, "Vertical noise", unit="px²", within=(0, 50, 0.5), useful=(0, 20), role="world"
    )
    """Variance of the measurements downwards."""
    outlier_every: int = parameter(15, "Outlier every", unit="frames", within=(1, 100, 1))
    """Every so many frames the horizontal noise is Cauchy; beyond 99 it never is."""
    outlier_frames: int = parameter(1, "Outliers last", unit="frames", within=(1, 50, 1), useful=(1, 20))
    """Number of frames for which a track stays at an outlier."""
    outlier_scale_px2: float = parameter(
        50, "Size of outliers", unit="px²", within=(0, 2500, 10), useful=(0, 500), role="world"
    )
    """Square of the scale of the Cauchy noise."""


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
        start: State of frame 0.
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
        """Return (4, K) normal numbers; those of a track do not depend on the number of others."""
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
    """Return the tracks of a table from the frame `first` on, with only their form in the file known.

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


# The simulated sequence: pictures of wall, book and box that move, and the corners to be followed.
#
# What is painted has whole numbers of sixteenths of a grey level, since pictures between pixels are then sums of
# products that are exact on every processor.

CORNERS_SIZE_PX = (360, 288)
"""Width and height of the picture."""

LEVEL = 16
"""Numbers to a grey level."""

WALL_MARGIN_PX = 48
"""So far the wall extends beyond the picture on each side; it moves by less."""

WALL, CELL_SD, SMOOTH_SD = 170.0, 12.0, 4.0
LINE_PX = 2
BLUR_PX = 12
"""Side of the square that is run over white noise three times: nearly a Gaussian of 6 px standard deviation."""

BOOK_PX, BOX_PX = (110, 84), (70, 90)
LINE = ((8, 72), (85, 8))
"""From where to where the slanted line runs on the book, px."""
BOOK, BRIGHT = 120, 225
RECTANGLES, AWAY_PX, MOST_TRIES = 14, 20.0, 4000
CHECK_PX = 10

WALL_DRAW, BOOK_DRAW, BOX_DRAW = 1, 2, 3
"""Each surface has its own random numbers, so surfaces do not affect each other."""


@lru_cache(maxsize=8)
def wall(seed: int, pitch_px: int, contrast: float) -> NDArray[np.int32]:
    """Return the wall: a lattice of dark lines, cells of slightly different brightness, and smooth noise.

    Args:
        seed: Seed of brightness and noise.
        pitch_px: From one line to the next.
        contrast: Darkness of lines relative to the wall, grey levels.
    """
    width, height = (side + 2 * WALL_MARGIN_PX for side in CORNERS_SIZE_PX)
    stream = Stream(seed, WALL_DRAW, Purpose.START)
    cells = stream.standard_normal((height // pitch_px + 1, width // pitch_px + 1))
    rows, columns = np.arange(height), np.arange(width)
    dark = (rows[:, None] % pitch_px < LINE_PX) | (columns % pitch_px < LINE_PX)
    uneven = CELL_SD * cells[rows[:, None] // pitch_px, columns // pitch_px]
    return _levels(WALL - contrast * dark + uneven + SMOOTH_SD * _smooth(stream, (height, width)))


@lru_cache(maxsize=8)
def book(seed: int) -> NDArray[np.int32]:
    """Return the book: a bright slanted line, and rectangles of any brightness away from it."""
    width, height = BOOK_PX
    grey = np.full((height, width), BOOK, np.uint8)
    cv2.line(grey, *LINE, BRIGHT, 3)
    stream = Stream(seed, BOOK_DRAW, Purpose.START)
    painted = 0
    for across, down, wide, high, level in stream.random((MOST_TRIES, 5)):
        w, h = 8 + int(14 * wide), 8 + int(12 * high)
        x, y = int((width - w) * across), int((height - h) * down)
        corners = np.array([[x, y], [x + w, y], [x, y + h], [x + w, y + h]], np.float64)
        if painted < RECTANGLES and _beside_line(corners) >= AWAY_PX:
            cv2.rectangle(grey, (x, y), (x + w - 1, y + h - 1), 20 + int(220 * level), -1)
            painted += 1
    return _levels(grey.astype(np.float64))


@lru_cache(maxsize=8)
def box(seed: int) -> NDArray[np.int32]:
    """Return the box: checks of any brightness between 30 and 230."""
    width, height = BOX_PX
    checks = 30.0 + 200.0 * Stream(seed, BOX_DRAW, Purpose.START).random((height // CHECK_PX, width // CHECK_PX))
    return _levels(np.repeat(np.repeat(checks, CHECK_PX, axis=0), CHECK_PX, axis=1))


def _beside_line(points: Floats) -> float:
    """Return the distance of the nearest point (n, 2) from the line; negative if they are not all on one side."""
    (x0, y0), (x1, y1) = LINE
    length = float(np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2))
    sides = ((points[:, 0] - x0) * (y1 - y0) - (points[:, 1] - y0) * (x1 - x0)) / length
    return float(max(sides.min(), -sides.max()))


def _smooth(stream: Stream, shape: tuple[int, int]) -> Floats:
    """Return smooth noise of unit variance.

    Sums of whole numbers are exact in whatever order they are added up.
    """
    noise = np.rint(1024.0 * stream.standard_normal(shape))
    weights = np.ones(1)
    for _ in range(3):
        noise = cv2.boxFilter(noise, cv2.CV_64F, (BLUR_PX, BLUR_PX), normalize=False)
        weights = np.convolve(weights, np.ones(BLUR_PX))
    return np.asarray(noise / (1024.0 * np.square(weights).sum()))


def _levels(grey: Floats) -> NDArray[np.int32]:
    levels = np.rint(LEVEL * np.clip(grey, 0.0, 255.0)).astype(np.int32)
    levels.flags.writeable = False
    return levels


CORNERS_FRAMES = 60
"""So long everything drifts on; then it drifts back."""

STEPS = 64
"""Shifts are whole numbers of such parts of a pixel."""

ON_WALL, ON_BOOK, ON_BOX = range(3)
"""The surfaces, the rear one first; the book is in front of the box."""

CORNERS_PX: Floats = np.array([[0.0, 0.0], [40.0, 150.0], [235.0, 40.0]])
SIZES_PX: Floats = np.array([[0.0, 0.0], BOOK_PX, BOX_PX])
FRONT_TO_REAR = (ON_BOOK, ON_BOX)


def shifts_px(phases: Floats) -> Floats:
    """Return the displacements of wall, book and box from their places at rest, (n, 3, 2) px.

    Args:
        phases: (n,) frames at the speed of the study.
    """
    drift = CORNERS_FRAMES - np.abs(CORNERS_FRAMES - phases % (2 * CORNERS_FRAMES))
    turns = 2.0 * np.pi * phases
    across = 0.5 * drift + 4.0 * np.sin(turns / 40.0), 1.1 * drift + 3.0 * np.sin(turns / 25.0), -0.8 * drift
    down = 2.5 * np.sin(turns / 30.0), -0.7 * drift, 0.9 * drift + 3.0 * np.sin(turns / 35.0)
    moved = np.array([across, down]).transpose(2, 1, 0)
    return np.asarray(np.rint(STEPS * moved) / STEPS)


@dataclass(frozen=True, eq=False)
class SceneMotion:
    """The motion up to a frame.

    Attributes:
        shifts: (n, 3, 2) of the surfaces in frames 0..n - 1, px.
    """

    shifts: Floats

    def surfaces(self, points: Floats, born: Ints) -> Ints:
        """Return on which surface each point (K, 2) of a frame's picture is, given its frame (K,)."""
        found = np.full(len(points), ON_WALL, np.int64)
        for surface in reversed(FRONT_TO_REAR):
            found[self.inside(surface, points, born, 0.0)] = surface
        return found

    def inside(self, surface: int, points: Floats, frames: Ints, margin_px: float) -> Bools:
        """Return which points (K, 2), each of a frame (K,), are on a surface or so near to it, whatever hides it."""
        corner = CORNERS_PX[surface] + self.shifts[frames, surface]
        beyond = np.maximum(corner - points, points - corner - SIZES_PX[surface] + 1.0)
        return np.asarray((beyond <= margin_px).all(axis=1))

    def path(self, points: Floats, index: int, born: Ints) -> Floats:
        """Return where points (K, 2), each of the picture of a frame `born` (K,), are in a frame so far, (K, 2) px."""
        surfaces = self.surfaces(points, born)
        return np.asarray(points + self.shifts[index, surfaces] - self.shifts[born, surfaces])

    def hidden(self, points: Floats, index: int, margin_px: float) -> Bools:
        """Return which points (K, 2) of frame 0 are behind something, or as near to its edge or to their surface's."""
        first, frames = np.zeros(len(points), np.int64), np.full(len(points), index)
        now, surfaces = self.path(points, index, first), self.surfaces(points, first)
        book, box = (self.inside(surface, now, frames, margin_px) for surface in FRONT_TO_REAR)
        on_book, on_box = (self.inside(surface, now, frames, -margin_px) for surface in FRONT_TO_REAR)
        seen = np.where(surfaces == ON_BOOK, on_book, np.where(surfaces == ON_BOX, on_box & ~book, ~book & ~box))
        return np.asarray(~seen)


INSIDE_PX, CLEAR_PX = 12.0, 8.0
"""A corner stays so far from the edge of the picture, and from what may hide it."""

MOST_FOUND = 400
GAIN_NOISE, FLICKER, FLICKER_FRAMES = 0.01, 0.03, 17.0

WALL_GROUP, LIGHT, MOTION = "Wall and book", "Light and noise", "Motion"


class _Wall(Parameters, group=WALL_GROUP):
    """Similarity of the corners."""

    wall_pitch_px: int = parameter(11, "Lattice pitch", unit="px", within=(5, 40, 1), live=False)
    """From one line of the wall's lattice to the next: so far away is the nearest look-alike."""
    wall_contrast: float = parameter(75, "Lattice contrast", within=(0, 150, 1))
    """Darkness of its lines relative to the wall, in grey levels."""
    false_corners: int = parameter(6, "False corners", within=(0, 12, 1), live=False)
    """Number of followed points on the book's slanted line, whose places look alike."""


class _Light(Parameters, group=LIGHT):
    """How pictures are spoilt."""

    image_noise_sd: float = parameter(5, "Picture noise", within=(0, 40, 0.5), role="world")
    """Standard deviation of the noise of each pixel, in grey levels."""
    gain_jump: float = parameter(0.11, "Jump of the light", within=(0, 0.5, 0.01), role="world")
    """Relative size of the light's jumps, up or down, for single frames."""
    gain_jump_share: float = parameter(0.12, "Share of frames with a jump", within=(0, 1, 0.01))
    """Rate of the light's jumps."""


class _Speed(Parameters, group=MOTION):
    """How fast everything moves."""

    scene_speed: float = parameter(1, "Speed", within=(0, 4, 0.1), role="world")
    """How fast wall, book and box move, relative to the sequence of the study."""


class CornerSceneParameters(_Speed, _Light, _Wall, DetectorParameters, SelectionParameters):
    """The scene: how much alike its corners are, and how the pictures are spoilt."""


class CornerSource:
    """Endless frames of wall, book and box.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 30.
        frame_count: None; what has drifted for 60 frames drifts back.
        start: The truth of frame 0, with the corners to be followed.
        noisy: The frames depend on the seed.
        points_px: (K, 2) the same corners, in frame 0.
    """

    size = CORNERS_SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    frame_count: int | None = None
    noisy = True

    def __init__(self, seed: int, parameters: CornerSceneParameters) -> None:
        """Paint the scene, and find its corners in frame 0.

        Raises:
            ValueError: There is none that is seen in all of the first 60 frames.
        """
        self._seed = seed
        history = History(((0, parameters),))
        self.points_px = self._corners(self._grey(0, history), parameters)
        if not len(self.points_px):
            raise ValueError(
                f"no corner of frame 0 stays in sight for {CORNERS_FRAMES} frames; expected at least one, "
                f"which a lower least strength may find, got {parameters.corner_quality:g}"
            )
        self._since = np.zeros(len(self.points_px), np.int64)
        self.start: Target = self._target(0, history)

    def frame(self, index: int, history: History[CornerSceneParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        image = np.repeat(self._grey(index, history)[:, :, None], 3, axis=2)
        image.flags.writeable = False
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=self._target(index, history))

    def motion(self, index: int, history: History[CornerSceneParameters]) -> SceneMotion:
        """Return how all points of the scene have moved up to a frame."""
        return SceneMotion(shifts_px(_phases(index, history)))

    def _target(self, index: int, history: History[CornerSceneParameters]) -> TrajectoriesTarget:
        motion = self.motion(index, history)
        now = motion.path(self.points_px, index, self._since)
        selected = history.at(index).selected_track % len(now)
        hidden = bool(motion.hidden(self.points_px, index, 0.0)[selected])
        return TrajectoriesTarget(now[selected], hidden=hidden, motion=motion, start_px=self.points_px)

    def _grey(self, index: int, history: History[CornerSceneParameters]) -> NDArray[np.uint8]:
        parameters = history.at(index)
        shifts = shifts_px(_phases(index, history)[-1:])[0]
        lattice = wall(self._seed, parameters.wall_pitch_px, parameters.wall_contrast)
        grey, _ = _move(lattice, shifts[0] - WALL_MARGIN_PX)
        for surface, texture in ((ON_BOX, box(self._seed)), (ON_BOOK, book(self._seed))):
            light, share = _move(texture, CORNERS_PX[surface] + shifts[surface])
            grey = grey * (1.0 - share) + light
        stream = Stream(self._seed, index, Purpose.SCENE)
        unsteady, (often, sign) = stream.standard_normal(), stream.random(2)
        gain = 1.0 + FLICKER * float(np.sin(2.0 * np.pi * index / FLICKER_FRAMES)) + GAIN_NOISE * unsteady
        if often < parameters.gain_jump_share:
            gain += parameters.gain_jump if sign < 0.5 else -parameters.gain_jump
        noise = stream.standard_normal(grey.shape)
        noisy = np.rint(gain * grey + parameters.image_noise_sd * noise)
        return np.asarray(np.clip(noisy, 0, 255), np.uint8)

    def _corners(self, grey: NDArray[np.uint8], parameters: CornerSceneParameters) -> Floats:
        """Return the corners to be followed: those that stay in sight, and points of the slanted line."""
        (x0, y0), (x1, y1) = LINE
        shares = (np.arange(parameters.false_corners) + 0.5) / max(parameters.false_corners, 1)
        line = CORNERS_PX[ON_BOOK] + np.column_stack([x0 + shares * (x1 - x0), y0 + shares * (y1 - y0)])
        found = find_corners(grey, revise(parameters, {"corner_count": MOST_FOUND}))
        motion = SceneMotion(shifts_px(np.arange(float(CORNERS_FRAMES))))
        points = np.concatenate([np.rint(line), found])
        kept = np.ones(len(points), np.bool_)
        for index in range(CORNERS_FRAMES):
            now = motion.path(points, index, np.zeros(len(points), np.int64))
            kept &= ((now >= INSIDE_PX) & (now <= np.array(CORNERS_SIZE_PX) - 1.0 - INSIDE_PX)).all(axis=1)
            kept &= ~motion.hidden(points, index, CLEAR_PX)
        chosen = np.flatnonzero(kept)[_of_all_surfaces(points[kept], motion, parameters.corner_count)]
        # Points of the line before others of the book where not all can be followed, but behind all others.
        return points[chosen[np.argsort(chosen < len(line), kind="stable")]]


def _of_all_surfaces(points: Floats, motion: SceneMotion, most: int) -> Ints:
    """Return the numbers of at most so many points, a third of them on each surface if there are, the first ones."""
    surfaces = motion.surfaces(points, np.zeros(len(points), np.int64))
    order = [np.flatnonzero(surfaces == surface) for surface in (ON_WALL, ON_BOX, ON_BOOK)]
    share = -(-most // len(order))
    rest = np.sort(np.concatenate([numbers[share:] for numbers in order]))
    left = max(most - sum(min(len(numbers), share) for numbers in order), 0)
    return np.concatenate([*(numbers[:share] for numbers in order), rest[:left]])[:most]


def _phases(index: int, history: History[CornerSceneParameters]) -> Floats:
    """Return the phases of frames 0..index."""
    steps = [np.full(count, parameters.scene_speed) for count, parameters in history.spans(index)]
    return np.cumsum(np.concatenate([[0.0], *steps]))


def _move(texture: NDArray[np.int32], corner_px: Floats) -> tuple[Floats, Floats]:
    """Return what a texture shows in each pixel of the picture, and its share, if its corner is between pixels."""
    width, height = CORNERS_SIZE_PX
    corner = np.rint(STEPS * corner_px).astype(np.int64)
    (left, top), (right_part, lower_part) = corner // STEPS, corner % STEPS
    rows, columns = texture.shape
    light, share = np.zeros((height, width), np.int64), np.zeros((height, width), np.int64)
    for down, tall in ((0, STEPS - lower_part), (1, lower_part)):
        for across, wide in ((0, STEPS - right_part), (1, right_part)):
            y, x = top + down, left + across
            first, last = max(y, 0), min(y + rows, height)
            near, far = max(x, 0), min(x + columns, width)
            if first < last and near < far:
                part = texture[first - y : last - y, near - x : far - x]
                light[first:last, near:far] += tall * wide * part
                share[first:last, near:far] += tall * wide
    whole = float(STEPS * STEPS)
    return light / (whole * LEVEL), share / whole
