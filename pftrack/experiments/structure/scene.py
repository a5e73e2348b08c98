"""A simulated body that turns before a camera: where its points are measured, with noise whose variance is known.

With everything at its default it is the prism of Bando 2007, ch. 4 section 5.3, on a larger scale: it turns by 1 degree
a frame about the vertical axis and by 2 about the horizontal one, and what is hidden is measured with fifty times the
noise. Beyond that, points may be missing altogether, for a while or at random, and a measurement may be off without its
variance saying so, as where a tracker holds on to the wrong thing.
"""

from typing import Literal

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Landmarks, Measurements, Target
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.sources.tracks.sequence import BodyTarget
from pftrack.sources.tracks.table import Body, body_of

FRAMES = 360
SIZE_PX = (640, 480)
FRAME_RATE_HZ = 30.0
SIZE_OF_BODY_PX = 110.0
"""As large a body of unit size is seen."""
PRINCIPAL_PX: Floats = np.array(SIZE_PX) / 2.0
PRINCIPAL_PX.flags.writeable = False

ROUND_DEG = 180.0
"""A swing from which on a body turns all the way round."""

WELL_SEEN, BADLY_SEEN = 0.9, 0.3
"""Cosines of the angle between where a graded point looks and the camera: seen as well as can be, and hardly."""

LN_10 = 2.302585092994046
SLIP_PX = 40.0
BURST_EVERY, BURST_FROM = 120, 60
"""Frames from one burst to the next, and the first one."""

BODY, MOTION, CAMERA, SEEN = "Body", "Motion", "Camera", "What is seen"


class _Body(Parameters, group=BODY):
    """Which body turns."""

    # fmt: off
    tracked_body: Literal["prism", "face", "cloud", "plate"] = parameter(
        "prism", "Body", "A prism of 14 points, a face of 11, or any number of points on an egg or in one plane.",
        live=False)
    body_seed: int = parameter(
        99, "Which one", "Number of the face, the egg or the plate: each has another shape.",
        within=(0, 999, 1), useful=(0, 199), live=False)
    body_points: int = parameter(
        20, "Points", "How many points an egg or a plate has.", within=(4, 60, 1), live=False)
    # fmt: on


class _Motion(Parameters, group=MOTION):
    """How fast it turns."""

    # fmt: off
    sideways_deg: float = parameter(
        1, "Turning sideways", "How fast it turns about the vertical axis, each frame.",
        unit="°", within=(0, 10, 0.1))
    upwards_deg: float = parameter(
        2, "Turning upwards", "How fast it turns about the horizontal axis, each frame.",
        unit="°", within=(0, 10, 0.1))
    swing_deg: float = parameter(
        180, "Swing", "How far it turns to either side before it turns back; at 180 it goes all the way round.",
        unit="°", within=(1, 180, 1), live=False)
    # fmt: on


class _Camera(Parameters, group=CAMERA):
    """How far away it is."""

    # fmt: off
    camera_distance: float = parameter(
        9, "Distance", "From the camera to the body, in sizes of the body; far away there is no perspective.",
        within=(4, 1000, 1), useful=(4, 300), live=False)
    # fmt: on


class _Seen(Parameters, group=SEEN):
    """How well its points are seen."""

    # fmt: off
    seen_noise_px: float = parameter(
        2, "Noise", "Standard deviation of the measurement of a point that is seen well.",
        unit="px", within=(0.001, 20, 0.1), useful=(0.1, 10), role="world")
    unseen_noise_px: float = parameter(
        100, "Noise while hidden", "Standard deviation of the measurement of a point that is hidden.",
        unit="px", within=(0.001, 500, 1), useful=(1, 200))
    unseen_missing: bool = parameter(
        False, "Hidden points missing", "Whether a hidden point is not measured at all.")
    missing_share: float = parameter(
        0, "Missing at random", "Share of the points that are not measured in a frame.",
        within=(0, 0.9, 0.05), role="world")
    burst_frames: int = parameter(
        0, "Burst", "For how many frames of every 120 the left half of the body is covered.",
        unit="frames", within=(0, 120, 5))
    slip_share: float = parameter(
        0, "Silently wrong", "Share of the measurements that are some 40 px off without their variance saying so.",
        within=(0, 0.5, 0.01), role="world")
    # fmt: on


class TracksSceneParameters(_Seen, _Camera, _Motion, _Body):
    """The scene: which body, how it turns, and how well its points are seen."""


class TracksSource:
    """A body's points, frame by frame, over a history of parameters.

    Attributes:
        size: Width and height of the picture in whose middle the principal point is, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: None; the body turns for ever.
        start: The truth of frame 0.
        noisy: The measurements depend on the seed.
    """

    size = SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    frame_count: int | None = None
    noisy = True

    def __init__(self, seed: int, parameters: TracksSceneParameters) -> None:
        """Set the scene; the seed is that of the noise."""
        self._seed = seed
        self.body: Body = body_of(parameters.tracked_body, parameters.body_seed, parameters.body_points)
        self.start: Target = self._target(np.zeros(3), parameters)

    def frame(self, index: int, history: History[TracksSceneParameters]) -> Frame:
        """Return a frame in px of the picture; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self._target(_theta(index, history), parameters)
        if target.landmarks is None:
            raise RuntimeError("a simulated body knows its points")
        stream = Stream(self._seed, index, Purpose.SCENE)
        count = len(self.body.points)
        noise, gone, slips = stream.standard_normal((count, 2)), stream.random(count), stream.random(count)
        away = stream.standard_normal((count, 2))
        sd = self._deviations(target, parameters)
        points = target.landmarks.points_px + sd[:, None] * noise
        points += SLIP_PX * np.where((slips < parameters.slip_share)[:, None], away, 0.0)
        missing = (gone < parameters.missing_share) | self._is_covered(index, parameters)
        missing |= ~target.landmarks.visible & parameters.unseen_missing
        measured = Measurements(np.where(missing[:, None], np.nan, points), np.where(missing, np.inf, sd))
        return Frame(index, index / FRAME_RATE_HZ, measurements=measured, target=target)

    def _facing(self, turn: Floats, translation: Floats) -> Floats:
        """Return how far each point looks at the camera (n,), -1..1."""
        camera = product(-translation, turn)
        length = float(np.sqrt(np.square(camera).sum()))
        beyond = (self.body.normals * camera).sum(axis=2) - self.body.offsets
        return np.asarray(beyond.max(axis=1) / length)

    def _deviations(self, target: BodyTarget, parameters: TracksSceneParameters) -> Floats:
        """Return the standard deviations (n,) of the measurements, px."""
        sd = np.full(len(self.body.points), float(parameters.seen_noise_px))
        if self.body.graded:
            facing = self._facing(target.turn, target.translation)
            lack = np.clip((WELL_SEEN - facing) / (WELL_SEEN - BADLY_SEEN), 0.0, 1.0)
            sd = sd * exponential(LN_10 * lack)
        visible = target.landmarks.visible if target.landmarks else np.ones(len(sd), dtype=np.bool_)
        return np.where(visible, sd, max(parameters.unseen_noise_px, parameters.seen_noise_px))

    def _is_covered(self, index: int, parameters: TracksSceneParameters) -> Bools:
        """Return which points (n,) a burst covers."""
        since = (index - BURST_FROM) % BURST_EVERY
        under_way = index >= BURST_FROM and since < parameters.burst_frames
        return np.asarray((self.body.points[:, 0] < 0.0) & under_way)

    def _target(self, theta: Floats, parameters: TracksSceneParameters) -> BodyTarget:
        points, turn = self.body.points, rotation(theta)
        translation = np.array([0.0, 0.0, parameters.camera_distance])
        # From further away it is seen with a longer lens, so that it stays as large.
        focal = SIZE_OF_BODY_PX * parameters.camera_distance
        true_px = pinhole(product(points, turn.T) + translation, focal) + PRINCIPAL_PX
        facing = self._facing(turn, translation)
        visible = facing > (BADLY_SEEN if self.body.graded else 0.0)
        return BodyTarget(
            position=points.ravel(),
            size=float(np.ptp(true_px, axis=0).max()),
            hidden=None,
            landmarks=Landmarks(true_px, visible, points, self.body.shape.names),
            shape=self.body.shape,
            principal_px=PRINCIPAL_PX,
            focal_px=focal,
            turn=turn,
            translation=translation,
        )


def _theta(index: int, history: History[TracksSceneParameters]) -> Floats:
    """Return how the body is turned (3,), rad; what it has turned adds up over the history."""
    upwards = sum(steps * past.upwards_deg for steps, past in history.spans(index, "upwards_deg"))
    sideways = sum(steps * past.sideways_deg for steps, past in history.spans(index, "sideways_deg"))
    way, swing = np.deg2rad([upwards, sideways, 0.0]), history.at(index).swing_deg
    if swing >= ROUND_DEG:
        return np.asarray(way)
    furthest = float(np.deg2rad(swing))
    return np.asarray(furthest * np.sin(way / furthest))
