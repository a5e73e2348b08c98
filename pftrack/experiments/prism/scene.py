"""The trapezoidal prism: eight vertices that turn in front of a camera; the rear ones hide now and then.

The measurement is the pinhole projection of every vertex with Gaussian noise, small for a visible vertex and huge for a
hidden one; which vertices are hidden is known (Bando 2007, ch. 4 section 3.3). The solid turns about its centroid in a
compound motion; it may also move to and fro and change its distance, which an affine camera cannot follow. With
everything at its default this is the scene of docs/methods/adaptive.md: 625 frames, and frame 0 shows the prism from
the front.

Vertices with odd numbers make the front face, the one with the short bases, and are never hidden; those with even
numbers make the rear one. The solid is convex, so a face is visible exactly if it looks towards the camera, and a
vertex if one of its faces is.
"""

from dataclasses import dataclass, field

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Landmarks, Measurements, Target
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Purpose, Stream

FRAMES = 625
"""Length of Bando's experiment; the motion then repeats."""

VERTICES_MM: Floats = np.array(
    [
        (-10.0, -10.0, -10.0),
        (-15.0, -10.0, 10.0),
        (-10.0, 10.0, -10.0),
        (-15.0, 10.0, 10.0),
        (10.0, -10.0, -10.0),
        (15.0, -10.0, 10.0),
        (10.0, 10.0, -10.0),
        (15.0, 10.0, 10.0),
    ]
)
"""(8, 3) x1..x8 in the object's frame, whose origin is the centre about which it turns."""
VERTICES_MM.flags.writeable = False

NAMES = tuple(f"x{number}" for number in range(1, len(VERTICES_MM) + 1))

FRAME_RATE_HZ = 30.0
SIZE_PX = (640, 480)
PRINCIPAL_PX: Floats = np.array(SIZE_PX) / 2.0
"""The point of the picture on the camera's axis."""
PRINCIPAL_PX.flags.writeable = False

FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3))
"""Front, rear, left, right, top and bottom: places of their corners in `VERTICES_MM`, in order around the face."""

REAR = (1, 3, 5, 7)
"""Places of the vertices that may be hidden."""

TOUCHING = np.array([[vertex in corners for corners in FACES] for vertex in range(len(VERTICES_MM))])
"""(8, 6) which vertices belong to which faces."""


EDGES = sorted({tuple(sorted(pair)) for face in FACES for pair in zip(face, (*face[1:], face[0]), strict=True)})
"""Corners at the ends of each of the twelve edges."""


def _outward_planes() -> tuple[Floats, Floats]:
    """Return the planes of the faces, normal (6, 3) outwards and offset (6,): a point x is outside if n.x > offset."""
    corners = VERTICES_MM[np.array(FACES)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    offsets = (normals * corners[:, 0]).sum(axis=1)
    inside = np.sign(offsets - (normals * VERTICES_MM.mean(axis=0)).sum(axis=1))
    return normals * inside[:, None], offsets * inside


NORMALS, OFFSETS = _outward_planes()

HIDDEN_NOISE_PX = 100.0
"""Standard deviation of the measurement of a hidden vertex."""

MOTION = "Motion"
CAMERA = "Camera"


class _Motion(Parameters, group=MOTION):
    """How the prism moves."""

    speed: float = parameter(1, "Speed", within=(0, 10, 0.1), useful=(0, 4), role="world")
    """How fast the prism moves, as a multiple of Bando's motion."""
    pitch_amplitude_deg: float = parameter(20, "Nod", unit="°", within=(0, 60, 1))
    """How far it turns about the horizontal axis."""
    yaw_amplitude_deg: float = parameter(40, "Turn", unit="°", within=(0, 60, 1))
    """How far it turns about the vertical axis."""
    roll_amplitude_deg: float = parameter(15, "Roll", unit="°", within=(0, 60, 1))
    """How far it turns about the line of sight."""
    translation: float = parameter(0, "Translation", within=(0, 2, 0.1))
    """How far it moves to and fro as well; 1 is 20 mm sideways, 15 mm up and down, 15 % of its distance."""


class _Camera(Parameters, group=CAMERA, constants={"hidden_noise_px": HIDDEN_NOISE_PX}):
    """How it is seen."""

    distance_mm: float = parameter(80, "Distance", unit="mm", within=(60, 1000, 5), useful=(60, 300), live=False)
    """Distance from the camera to the prism's centre; the nearer it is, the stronger the perspective."""
    focal_length_px: float = parameter(
        400, "Focal length", unit="px", within=(50, 2000, 10), useful=(100, 1000), live=False
    )
    """Focal length of the pinhole camera."""
    noise_px: float = parameter(1, "Noise", unit="px", within=(0.1, 50, 0.1), role="world")
    """Standard deviation of the measurement of a visible vertex."""


class PrismParameters(_Camera, _Motion):
    """The scene: how the prism moves, and how it is measured."""


@dataclass(frozen=True, eq=False)
class Sight:
    """One frame of the prism: what is measured, and what is true.

    Attributes:
        points_px: (8, 2) measured positions of the vertices, from the principal point.
        noise_sd_px: (8,) standard deviation of each measurement, which is known.
        visible: (8,) whether each vertex is seen.
        theta_rad: (3,) true angles.
        translation_mm: (3,) true place of the prism's centre in the camera's frame.
        true_px: (8, 2) where the vertices truly are.
    """

    points_px: Floats
    noise_sd_px: Floats
    visible: Bools
    theta_rad: Floats
    translation_mm: Floats
    true_px: Floats


@dataclass(frozen=True, slots=True)
class PrismTarget(Target):
    """The true pose of the prism: `position` is theta (3,) in rad, `landmarks` are its vertices.

    Attributes:
        translation_mm: (3,) its centre in the camera's frame.
    """

    translation_mm: Floats = field(default_factory=lambda: np.zeros(3))


class PrismSource:
    """The prism, frame by frame, over a history of parameters; a frame has measured vertices in place of a picture.

    Attributes:
        size: Width and height of the picture in whose middle the principal point is, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: None; the motion repeats after Bando's 625 frames.
        start: The truth of frame 0, theta = 0.
        noisy: The measurements depend on the seed.
    """

    size = SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    frame_count: int | None = None
    noisy = True

    def __init__(self, seed: int, parameters: PrismParameters) -> None:
        """Set the scene; the seed is that of the measurement noise."""
        self._seed = seed
        self.start: Target = _target(sight(seed, 0, parameters))

    def frame(self, index: int, history: History[PrismParameters]) -> Frame:
        """Return a frame in px of the picture; the same arguments give the same frame, to the bit."""
        seen = self.sight(index, history)
        measurements = Measurements(seen.points_px + PRINCIPAL_PX, seen.noise_sd_px)
        return Frame(index, index / FRAME_RATE_HZ, measurements=measurements, target=_target(seen))

    def sight(self, index: int, history: History[PrismParameters]) -> Sight:
        """Return a frame; the phase of the motion adds up over the history, so a change does not cause a jump."""
        phase = sum(steps * past.speed for steps, past in history.spans(index, "speed")) / FRAMES
        return sight(self._seed, index, history.at(index), phase)


def sight(seed: int, index: int, parameters: PrismParameters, phase: float | None = None) -> Sight:
    """Return a frame; the same arguments give the same frame, to the bit.

    Args:
        seed: Seed of the measurement noise.
        index: Number of the frame, from 0.
        parameters: In force.
        phase: u, where the motion is, in rounds of Bando's 625 frames; by default as if the parameters had been
            in force from the start.
    """
    u = index * parameters.speed / FRAMES if phase is None else phase
    theta = _theta(u, parameters)
    translation = _translation(u, parameters)
    placed = product(VERTICES_MM, rotation(theta).T) + translation
    visible = np.asarray((TOUCHING & visible_faces(theta, translation)).any(axis=1))
    noise_sd = np.where(visible, parameters.noise_px, HIDDEN_NOISE_PX)
    true = pinhole(placed, float(parameters.focal_length_px))
    normals = Stream(seed, index, Purpose.SCENE).standard_normal(true.shape)
    return Sight(true + noise_sd[:, None] * normals, noise_sd, visible, theta, translation, true)


def visible_faces(theta_rad: Floats, translation_mm: Floats) -> Bools:
    """Return which of `FACES` (6,) are seen: those on whose outer side the camera lies, in the object's frame."""
    seen: Bools = np.greater(product(NORMALS, product(-translation_mm, rotation(theta_rad))), OFFSETS)
    return seen


def _target(seen: Sight) -> PrismTarget:
    true_px = seen.true_px + PRINCIPAL_PX
    return PrismTarget(
        position=seen.theta_rad,
        size=float(np.ptp(true_px, axis=0).max()),
        landmarks=Landmarks(true_px, seen.visible, VERTICES_MM, NAMES),
        translation_mm=seen.translation_mm,
    )


def _theta(u: float, parameters: PrismParameters) -> Floats:
    amplitudes = (parameters.pitch_amplitude_deg, parameters.yaw_amplitude_deg, parameters.roll_amplitude_deg)
    theta: Floats = np.deg2rad(amplitudes) * np.sin(2.0 * np.pi * np.array([3.0, 4.0, 2.0]) * u)
    return theta


def _translation(u: float, parameters: PrismParameters) -> Floats:
    share = parameters.translation
    return np.array(
        [
            20.0 * share * np.sin(4.0 * np.pi * u),
            15.0 * share * np.sin(6.0 * np.pi * u),
            parameters.distance_mm * (1.0 + 0.15 * share * np.sin(3.0 * np.pi * u)),
        ]
    )
