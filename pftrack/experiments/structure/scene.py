"""A simulated body that turns before a camera: measured positions of its points, with noise of known variance.

With everything at its default it is the prism of Bando 2007, ch. 4 section 5.3, on a larger scale: it turns by 1 degree
a frame about the vertical axis and by 2 about the horizontal one, and hidden points are measured with fifty times the
noise. Beyond that, points may be missing altogether, for a while or at random, and a measurement may be off without its
variance saying so, as where a tracker holds on to the wrong thing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Landmarks, Measurements, Target
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.prism.scene import EDGES, FACES, NAMES, NORMALS, OFFSETS, TOUCHING, VERTICES_MM
from pftrack.sources.tracks import TrackSequence
from pftrack.vision.face import FEATURES, LINKS, mean_model, person

FRAMES = 360
SIZE_PX = (640, 480)
FRAME_RATE_HZ = 30.0
SIZE_OF_BODY_PX = 110.0
"""Size of a unit body in the picture."""
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

# A body defines the edges and faces between its points, their visibility, and the variation of its kind.

Kind: TypeAlias = Literal["prism", "face", "cloud", "plate"]

HEAD_CENTRE_MM = np.array([0.0, 0.0, 90.0])
"""From the face's origin, about the middle of the head: a feature looks away from there."""

GOLDEN_RAD = np.pi * (3.0 - 5.0**0.5)
CLOUD_AXES = np.array([1.0, 0.7, 0.8])
PRIOR_SD = 0.06
"""Standard deviation of a face's coordinates about the mean face, relative to its size: 3 mm."""


@dataclass(frozen=True, eq=False)
class Shape:
    """Edges and faces between a body's points.

    Attributes:
        names: (n,) of the points.
        edges: (m, 2) numbers of points that belong together.
        triangles: (k, 3) numbers of points, clockwise seen from outside.
        mean: (n, 3) mean of other bodies of the kind, about its centre and of unit size; None where none are known.
        prior_sd: Standard deviation of a coordinate about the mean, of unit size.
    """

    names: tuple[str, ...]
    edges: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    triangles: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    mean: Floats | None = None
    prior_sd: float = PRIOR_SD


@dataclass(frozen=True, eq=False)
class Body:
    """A body that can be simulated.

    Attributes:
        shape: Edges and faces between its points.
        points: (n, 3) about the centre, of unit size: their root mean square distance from it is 1.
        normals: (n, m, 3) in which directions each point looks: it is seen if one of its planes is.
        offsets: (n, m) of these planes from the centre; infinite for a plane that there is not.
        graded: Whether a point is seen the worse the more it turns away, rather than well or not at all.
    """

    shape: Shape
    points: Floats
    normals: Floats
    offsets: Floats
    graded: bool = False


def unnamed_shape(count: int) -> Shape:
    """Return the prior of a body with only a known number of points."""
    return Shape(tuple(map(str, range(1, count + 1))))


def named_shape(points: Sequence[str]) -> Shape:
    """Return what is known of a body by the names of its points: other faces, if all are features of one."""
    if not set(points) <= set(FEATURES):
        return Shape(tuple(points))
    mean = mean_model().points_mm[[FEATURES.index(point) for point in points]]
    return Shape(tuple(points), _links(points), mean=normalise(mean))


def _links(points: Sequence[str]) -> Ints:
    both = [(points.index(one), points.index(other)) for one, other in LINKS if {one, other} <= set(points)]
    return np.array(both, np.int64).reshape(-1, 2)


def normalise_size(points: Floats) -> tuple[Floats, float]:
    """Return points (n, 3) about their centre, their root mean square distance from it 1, and what that was.

    Points that are all in one place are all 0, and of size 1.
    """
    centred = points - points.mean(axis=0)
    size = float(np.sqrt(np.square(centred).sum() / len(centred)))
    return (centred / size, size) if size > 0.0 else (centred, 1.0)


def normalise(points: Floats) -> Floats:
    """Return points (n, 3) about their centre and of unit size."""
    return normalise_size(points)[0]


@lru_cache(maxsize=16)
def body_of(kind: Kind, seed: int, count: int) -> Body:
    """Return a body.

    Args:
        kind: Kind of the body.
        seed: Seed of a face or a cloud.
        count: Number of points of a cloud or a plate.
    """
    match kind:
        case "prism":
            return _prism()
        case "face":
            return _face(seed)
        case "cloud":
            return _cloud(seed, count)
        case "plate":
            return _plate(seed, count)


def _prism() -> Body:
    corners = np.array(FACES)
    points = np.concatenate([VERTICES_MM, VERTICES_MM[corners].mean(axis=1)])
    names = (*NAMES, "front", "rear", "left", "right", "top", "bottom")
    fans = [
        (8 + place, *pair) for place, face in enumerate(FACES) for pair in zip(face, (*face[1:], face[0]), strict=True)
    ]
    middle = points.mean(axis=0)
    size = float(np.sqrt(np.square(points - middle).sum() / len(points)))
    faces = np.concatenate([TOUCHING, np.eye(len(FACES), dtype=np.bool_)])
    normals = np.broadcast_to(NORMALS, (len(points), *NORMALS.shape))
    offsets = np.where(faces, (OFFSETS - (NORMALS * middle).sum(axis=1)) / size, np.inf)
    triangles = _outwards(np.array(fans, np.int32), points)
    return Body(Shape(names, np.array(EDGES), triangles), normalise(points), normals, offsets)


def _outwards(triangles: NDArray[np.int32], points: Floats) -> NDArray[np.int32]:
    """Return triangles of a convex body, clockwise as they are seen from outside with y downwards and z away."""
    one, two, three = points[triangles].transpose(1, 0, 2)
    away = (np.cross(two - one, three - one) * (one - points.mean(axis=0))).sum(axis=1)
    return np.where((away > 0.0)[:, None], triangles, triangles[:, ::-1])


def _face(seed: int) -> Body:
    points = person(seed).points_mm
    outwards = points - HEAD_CENTRE_MM
    normals = outwards / np.sqrt(np.square(outwards).sum(axis=1))[:, None]
    return Body(named_shape(FEATURES), normalise(points), normals[:, None], np.zeros((len(points), 1)), graded=True)


def _cloud(seed: int, count: int) -> Body:
    """Points on an egg, spread evenly (Fibonacci's spiral) and shifted a little at random."""
    heights = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    angles = GOLDEN_RAD * np.arange(count)
    radii = np.sqrt(1.0 - heights * heights)
    directions = np.stack([radii * np.cos(angles), heights, radii * np.sin(angles)], axis=1)
    bumps = 1.0 + 0.15 * Stream(seed, 0, Purpose.SCENE).standard_normal((count, 1))
    points = normalise(directions * CLOUD_AXES * bumps)
    return Body(unnamed_shape(count), points, directions[:, None], np.zeros((count, 1)))


def _plate(seed: int, count: int) -> Body:
    """Points in one plane, which is seen from both sides."""
    places = Stream(seed, 0, Purpose.SCENE).standard_normal((count, 2))
    points = normalise(np.column_stack([places, np.zeros(count)]))
    both = np.broadcast_to([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], (count, 2, 3))
    return Body(unnamed_shape(count), points, both, np.zeros((count, 2)))


@dataclass(frozen=True, slots=True)
class BodyTarget(Target):
    """A body: `position` is its shape (3 n,), about its centre and of unit size; zero where that is not known.

    Attributes:
        shape: What is between its points, and what others of the kind look like; a tracker may know that.
        principal_px: (2,) where the camera's axis meets the picture.
        focal_px: Focal length of the camera.
        turn: (3, 3) from the body's frame to the camera's.
        translation: (3,) the body's centre in the camera's frame, in units of the body's size.
    """

    shape: Shape = field(default_factory=lambda: Shape(()))
    principal_px: Floats = field(default_factory=lambda: np.zeros(2))
    focal_px: float = 1000.0
    turn: Floats = field(default_factory=lambda: np.eye(3))
    translation: Floats = field(default_factory=lambda: np.zeros(3))


FAR = 10.0
"""The focal length that is assumed, in longer sides of the picture: with a long one a body is seen without perspective,
and little is wrong whatever the camera was."""


def named_body(sequence: TrackSequence) -> BodyTarget:
    """Return the prior of a body: its number of points, and its shape if they have a face's names."""
    return BodyTarget(
        np.zeros(3 * len(sequence.names)),
        hidden=None,
        shape=named_shape(sequence.names),
        principal_px=np.array(sequence.size) / 2.0,
        focal_px=FAR * max(sequence.size),
    )


class _Body(Parameters, group=BODY):
    """Which body turns."""

    tracked_body: Literal["prism", "face", "cloud", "plate"] = parameter("prism", "Body", live=False)
    """A prism of 14 points, a face of 11, or any number of points on an egg or in one plane."""
    body_seed: int = parameter(99, "Which one", within=(0, 999, 1), useful=(0, 199), live=False)
    """Number of the face, the egg or the plate: each has another shape."""
    body_points: int = parameter(20, "Points", within=(4, 60, 1), live=False)
    """Number of points of an egg or a plate."""


class _Motion(Parameters, group=MOTION):
    """How fast it turns."""

    sideways_deg: float = parameter(1, "Turning sideways", unit="°", within=(0, 10, 0.1))
    """How fast it turns about the vertical axis, each frame."""
    upwards_deg: float = parameter(2, "Turning upwards", unit="°", within=(0, 10, 0.1))
    """How fast it turns about the horizontal axis, each frame."""
    swing_deg: float = parameter(180, "Swing", unit="°", within=(1, 180, 1), live=False)
    """Angle to either side at which it turns back; at 180 it goes all the way round."""


class _Camera(Parameters, group=CAMERA):
    """How far away it is."""

    camera_distance: float = parameter(9, "Distance", within=(4, 1000, 1), useful=(4, 300), live=False)
    """Distance from the camera to the body, in sizes of the body; far away perspective vanishes."""


class _Seen(Parameters, group=SEEN):
    """How well its points are seen."""

    seen_noise_px: float = parameter(2, "Noise", unit="px", within=(0.001, 20, 0.1), useful=(0.1, 10), role="world")
    """Standard deviation of the measurement of a point that is seen well."""
    unseen_noise_px: float = parameter(100, "Noise while hidden", unit="px", within=(0.001, 500, 1), useful=(1, 200))
    """Standard deviation of the measurement of a point that is hidden."""
    unseen_missing: bool = parameter(False, "Hidden points missing")
    """Whether a hidden point is not measured at all."""
    missing_share: float = parameter(0, "Missing at random", within=(0, 0.9, 0.05), role="world")
    """Share of the points that are not measured in a frame."""
    burst_frames: int = parameter(0, "Burst", unit="frames", within=(0, 120, 5))
    """Number of frames out of every 120 in which the left half of the body is covered."""
    slip_share: float = parameter(0, "Silently wrong", within=(0, 0.5, 0.01), role="world")
    """Share of the measurements that are some 40 px off without their variance saying so."""


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
            raise RuntimeError("the points of a simulated body are known")
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
        """Return the cosine of each point's normal towards the camera (n,), -1..1."""
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
        # A more distant body is seen with a longer lens, so its size stays the same.
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
    """Return the body's rotation (3,), rad, accumulated over the history."""
    upwards = sum(steps * past.upwards_deg for steps, past in history.spans(index, "upwards_deg"))
    sideways = sum(steps * past.sideways_deg for steps, past in history.spans(index, "sideways_deg"))
    way, swing = np.deg2rad([upwards, sideways, 0.0]), history.at(index).swing_deg
    if swing >= ROUND_DEG:
        return np.asarray(way)
    furthest = float(np.deg2rad(swing))
    return np.asarray(furthest * np.sin(way / furthest))
