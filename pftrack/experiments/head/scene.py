"""The simulated driver's head, a source of near-infrared pictures with the truth (docs/methods/heads.md).

Bando's videos of drivers are not available, so a head drawn from a face model replaces them (`painting`): procedural,
textured, self-occluding, with changes of light. The camera is behind the steering wheel (f = 1200 px at a width of
640); the head turns about a point in the neck, so that its face moves in the picture and in depth as it turns, and the
pure rotation that the affine camera assumes is wrong by as much as it is in a car.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Landmarks, Target
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head import painting
from pftrack.vision.face import FEATURES, FaceModel, HeadMesh, head_mesh, mean_model, person

# Parameters of the simulated scene of a driver's head.

MOTION, LOOK, COVER = "Head", "Light and camera", "In front of the face"


class _Motion(Parameters, group=MOTION):
    """Who is driving, and how the head moves."""

    person: int = parameter(99, "Person", within=(0, 9999, 1), useful=(0, 199), live=False)
    """Which person drives: the seed with which the face is drawn from the statistics of adult faces."""
    face: Literal["person", "mean"] = parameter("person", "Face", live=False)
    """Whether the driver has the face of that person or the mean face, which fits the mean model exactly."""
    speed: float = parameter(1.0, "Speed", within=(0, 4, 0.1), role="world")
    """How fast the script of motions runs; at 1 it takes 900 frames."""
    amplitude: float = parameter(1.0, "Amplitude", within=(0, 1.5, 0.05))
    """Factor on all angles; at 1 the head turns by 35 degrees and nods and rolls by 25."""


class _Look(_Motion, group=LOOK):
    """The light and the camera."""

    sun_strength: float = parameter(0.3, "Sunlight", within=(0, 1, 0.05), role="world")
    """Strength of the sun that comes and goes from the side, where the lamp at the camera has 0.72."""
    lamp_strength: float = parameter(0.72, "Lamp", within=(0, 1.2, 0.02), role="world")
    """Strength of the near-infrared lamp at the camera."""
    image_noise_sd: float = parameter(3, "Pixel noise", unit="grey levels", within=(0, 40, 0.5), role="world")
    """Standard deviation of the noise on every pixel."""
    blur_px: float = parameter(0, "Blur", unit="px", within=(0, 8, 0.25), role="world")
    """How far the lens is out of focus: standard deviation of a Gaussian, in px of a picture 640 px wide."""
    image_width_px: int = parameter(640, "Picture width", unit="px", within=(160, 1280, 16), live=False)
    """Width of the picture; its height is three quarters of that, and the view stays the same. What the trackers assume
    in px, such as the noise of the features, does not follow it."""


class HeadSceneParameters(_Look, group=COVER):
    """The scene: who is driving, how the head moves, the light, and what passes in front."""

    pillar_width_px: float = parameter(0, "Pillar width", unit="px", within=(0, 640, 1), useful=(0, 320), role="world")
    """Width of the vertical pillar in front of everything, in px of a picture 640 px wide."""
    pillar_offset_px: float = parameter(0, "Pillar place", unit="px", within=(-320, 320, 1))
    """Distance of the pillar's middle to the right of the picture's middle, in px of a picture 640 px wide."""
    hand_cover: float = parameter(0, "Hand", within=(0, 1, 0.01), role="world")
    """Height of the hand in front of the face, from 0, out of sight, to 1, before the eyes."""
    sunglasses: bool = parameter(False, "Sunglasses")
    """Whether the driver wears glasses that are dark in near-infrared light too."""


# The script is rest, two turns to either side, rest, two nods, rest, two rolls, rest, with a small wobble on all axes
# throughout. At speed 1 it takes 900 frames, 330 of them with an axis beyond 20 degrees; then it repeats without a
# jump.
#
# What is asked for in mid-run must not make the head jump either, and a frame must remain a function of the history of
# parameters alone. So the place in the script is the sum of all past speeds, and the amplitude in force follows the one
# asked for with a lag of half a second, written in closed form over the spans of the history.

SCRIPT_FRAMES = 900
UNITS = 600.0
"""The script's own measure of time."""

SEGMENTS = ((30.0, 190.0, 1, 35.0), (210.0, 370.0, 0, 25.0), (390.0, 550.0, 2, 25.0))
"""First and last unit, axis of rotation (0 is the nod) and amplitude in degrees."""

EASE = 0.06
WOBBLE_FROM, WOBBLE_FULL = 10.0, 50.0
"""Frames between which the wobble fades in, so the head begins at theta = 0."""

LAG_FRAMES = 15.0

Spans = Sequence[tuple[int, HeadSceneParameters]]


def script_time(spans: Spans) -> float:
    """Return how many runs of the script have passed: 1 at the end of the first.

    Args:
        spans: Numbers of steps with each set of parameters.
    """
    return sum(steps * parameters.speed for steps, parameters in spans) / SCRIPT_FRAMES


def eased_amplitude(spans: Spans, initial: float) -> float:
    """Return the amplitude in force, which follows the one asked for with a lag.

    Args:
        spans: Numbers of steps with each set of parameters.
        initial: The amplitude at frame 0.
    """
    amplitude = initial
    for steps, parameters in spans:
        amplitude = parameters.amplitude + (amplitude - parameters.amplitude) * math.exp(-steps / LAG_FRAMES)
    return float(amplitude)


def angles_rad(time: float, amplitude: float) -> Floats:
    """Return theta (3,) in rad: nod (down is positive), turn (to image left), roll (clockwise in the image).

    Args:
        time: Runs of the script, from 0.
        amplitude: Factor on all angles; 1 is the script's.
    """
    unit = UNITS * (time % 1.0)
    degrees = _wobble_deg(time)
    for first, last, axis, peak in SEGMENTS:
        part = (unit - first) / (last - first)
        if 0.0 <= part < 1.0:
            ease = min(min(part, 1.0 - part) / EASE, 1.0)
            degrees[axis] += peak * ease * np.sin(4.0 * np.pi * part)
    return np.deg2rad(amplitude * degrees)


def _wobble_deg(time: float) -> Floats:
    fade = min(max((SCRIPT_FRAMES * time - WOBBLE_FROM) / (WOBBLE_FULL - WOBBLE_FROM), 0.0), 1.0)
    turn = 2.0 * np.pi * time
    nod, yaw, roll = np.sin(5.3 * turn), np.sin(4.1 * turn + 1.0) - np.sin(1.0), np.sin(3.7 * turn)
    return fade * np.array([2.0 * nod, 2.0 * yaw, 1.5 * roll])


@dataclass(frozen=True, slots=True)
class HeadTarget(Target):
    """The true pose of a head: `position` is theta (3,) in rad, `landmarks` are the features and the driver's own face.

    It counts as hidden when none of its features is seen.

    Attributes:
        translation_mm: (3,) t in Xc = R(theta) X + t, the camera's frame.
    """

    translation_mm: Floats = field(default_factory=lambda: np.zeros(3))


FRAME_RATE_HZ = 30.0
REFERENCE_WIDTH, REFERENCE_FOCAL_PX = 640, 1200.0
PIVOT_MM = np.array([0.0, 90.0, 100.0])
HEAD_MM = np.array([0.0, -15.0, 700.0])
"""The head's origin in the camera's frame while theta = 0."""

AMBIENT = 0.18
HAIR_BEHIND_MM, HAIR = 75.0, 0.15
LONGITUDES, LATITUDES = 110, 120
"""Resolution of the drawn mesh: with three tenths of the full one's triangles the face differs by 0.2 grey levels."""

VISIBLE_WITHIN_MM = 4.0


class HeadSource:
    """Endless frames of a driver who turns, nods and rolls the head.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 30.
        frame_count: None; the script repeats.
        start: The truth of frame 0, theta = 0.
        noisy: Whether there is pixel noise, which depends on the seed.
        model: The driver's own face, the individual model.
        focal_px: Focal length, px.
        centre_px: (2,) principal point, px.
    """

    def __init__(self, seed: int, parameters: HeadSceneParameters) -> None:
        """Set the scene.

        Args:
            seed: Seed of the pixel noise.
            parameters: In force at frame 0.
        """
        self._seed = seed
        width = parameters.image_width_px
        self.size = (width, 3 * width // 4)
        self.frame_rate_hz = FRAME_RATE_HZ
        self.frame_count: int | None = None
        self.model = _model(parameters.person, parameters.face)
        self.focal_px = focal_px(width)
        self.centre_px = np.array([self.size[0] / 2.0, self.size[1] / 2.0])
        self.noisy = parameters.image_noise_sd > 0
        self.start: Target = self._render(np.zeros(3), 0.0, parameters)[1]

    def frame(self, index: int, history: History[HeadSceneParameters]) -> Frame:
        """Return the scene at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        spans = history.spans(index, "speed", "amplitude")
        time = script_time(spans)
        theta = angles_rad(time, eased_amplitude(spans, history.at(0).amplitude))
        grey, target = self._render(theta, time, parameters)
        noise = Stream(self._seed, index, Purpose.SCENE).standard_normal(
            grey.size if parameters.image_noise_sd > 0 else 0
        )
        image = painting.expose(grey, float(parameters.image_noise_sd), noise)
        image.flags.writeable = False
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=target)

    def _render(
        self, theta: Floats, time: float, parameters: HeadSceneParameters
    ) -> tuple[NDArray[np.float32], HeadTarget]:
        """Return the picture in grey levels before noise, and the truth."""
        return self.picture_of(theta, HEAD_MM + PIVOT_MM - product(rotation(theta), PIVOT_MM), time, parameters)

    def picture_of(
        self,
        theta: Floats,
        translation: Floats,
        time: float,
        parameters: HeadSceneParameters,
    ) -> tuple[NDArray[np.float32], HeadTarget]:
        """Return the picture (height, width) of a head anywhere, in grey levels before noise, and the truth.

        Args:
            theta: (3,) rad.
            translation: (3,) mm, where the head's origin is in the camera's frame.
            time: Time of the changing light, in runs of the script.
            parameters: The scene.
        """
        mesh = _mesh(parameters.person, parameters.face, parameters.sunglasses)
        texture = _texture(parameters.person, parameters.face, parameters.sunglasses)
        turn = rotation(theta)
        sun, sun_share, gain = _light(time)
        strength = parameters.sun_strength * sun_share
        light = painting.lit(product(mesh.normals, turn.T), sun, AMBIENT, parameters.lamp_strength, strength)
        centre = (float(self.centre_px[0]), float(self.centre_px[1]))
        pixels, inverse_depths = painting.project(
            product(mesh.vertices_mm, turn.T) + translation, self.focal_px, centre
        )
        grey = painting.background(parameters.person, self.size[0]).copy()
        depth_buffer = np.zeros(grey.shape, np.float32)
        painting.rasterise(
            grey,
            depth_buffer,
            mesh.triangles,
            pixels,
            inverse_depths,
            mesh.vertices_mm,
            light,
            texture,
            (painting.LEFT_MM, painting.TOP_MM, painting.STEP_MM),
            (HAIR_BEHIND_MM, HAIR),
        )
        hidden = np.zeros(grey.shape, np.bool_)
        painting.cover(grey, hidden, parameters.hand_cover, parameters.pillar_width_px, parameters.pillar_offset_px)
        grey = painting.blur(grey * np.float32(gain), parameters.blur_px * self.size[0] / REFERENCE_WIDTH)
        points, depths = painting.project(product(self.model.points_mm, turn.T) + translation, self.focal_px, centre)
        visible = _visible(points, 1.0 / depths, depth_buffer, hidden)
        target = HeadTarget(
            position=theta,
            size=float(np.ptp(points, axis=0).max()),
            hidden=not visible.any(),
            landmarks=Landmarks(points, visible, self.model.points_mm, FEATURES),
            translation_mm=translation,
        )
        return grey, target


def focal_px(width: int) -> float:
    """Return the focal length, px, of the camera whose pictures are so wide, px."""
    return REFERENCE_FOCAL_PX * width / REFERENCE_WIDTH


def _light(time: float) -> tuple[Floats, float, float]:
    """Return the sun's direction (3,) and share of its full strength, and the camera's gain."""
    sun = np.array([0.8 * np.cos(2.0 * np.pi * (0.15 + 1.3 * time)), -0.35, -0.5])
    share = min(max(np.sin(2.0 * np.pi * 2.2 * time) + 0.2, 0.0), 1.0)
    return sun / np.sqrt(np.square(sun).sum()), share, 1.0 + 0.08 * float(np.sin(2.0 * np.pi * 3.1 * time))


def _visible(
    points: Floats,
    depths: Floats,
    depth_buffer: NDArray[np.float32],
    hidden: Bools,
) -> Bools:
    """Return which points (n,) are seen: in the picture, within 4 mm of the surface there, nothing before it."""
    height, width = depth_buffer.shape
    columns, rows = np.floor(points + 0.5).astype(int).T
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    columns, rows = np.clip(columns, 0, width - 1), np.clip(rows, 0, height - 1)
    inverse = depth_buffer[rows, columns]
    surface = 1.0 / np.maximum(inverse, 1e-9)
    seen: Bools = inside & (depths < surface + VISIBLE_WITHIN_MM) & ~hidden[rows, columns]
    return seen


@lru_cache(maxsize=8)
def _mesh(seed: int, face: str, sunglasses: bool) -> HeadMesh:
    model = _model(seed, face)
    mesh = head_mesh(model, LONGITUDES, LATITUDES)
    return painting.with_lenses(mesh, model) if sunglasses else mesh


@lru_cache(maxsize=8)
def _texture(seed: int, face: str, sunglasses: bool) -> NDArray[np.float32]:
    model = _model(seed, face)
    if sunglasses:
        return painting.with_sunglasses(_texture(seed, face, False), model)
    return painting.albedo(model, seed)


def _model(seed: int, face: str) -> FaceModel:
    return mean_model() if face == "mean" else person(seed)
