"""A tank of goldfish seen from above, the simulated source of the fish (docs/methods/diffusion.md).

How the fish swim, bend and turn is in `swimming`. Everything is painted with OpenCV's anti-aliased shapes in whole
numbers of sixteenths of a pixel, so a pose has one picture. Colours are BGR while painting, as OpenCV has them.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Self, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import ParameterError, parameter
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.random import Purpose, Stream, uniforms
from pftrack.experiments.fish.model import GOLDFISH, FishShape, body_points, inside, model_points, tail_corners
from pftrack.experiments.fish.swimming import FRAME_RATE_HZ, FRAMES, HEIGHT, WIDTH, TankName, clip
from pftrack.experiments.shared.recording import OverlayParameters, paint, strip

TANK = "Tank"


class FishSceneParameters(OverlayParameters, group=TANK):
    """The scene: which clip, how many fish, how they turn, and what is laid over the picture."""

    tank_number: int = parameter(
        200,
        "Clip",
        "Which clip is seen: the seed of the swimming, of the gravel and of the noise. The paper's test is done on "
        "200 to 211, and what the trackers know was learned on 100 to 109.",
        within=(0, 9999, 1),
        useful=(0, 500),
        live=False,
    )
    fish_count: int = parameter(2, "Fish", "How many fish swim.", within=(1, 2, 1), live=False)
    lively: bool = parameter(
        True,
        "Lively first fish",
        "Whether the first fish turns sharply at least once: by 60 degrees within four frames.",
        live=False,
    )
    followed_fish: int = parameter(
        1, "Followed fish", "Which of them is tracked; the second is always calm.", within=(1, 2, 1), live=False
    )
    tank: TankName = parameter(
        "goldfish",
        "Water",
        "How the water answers a bend. With the strong rudder the return stroke turns a fish the same way as the bend, "
        "so that bend and turn are not coupled with one sign.",
        live=False,
    )
    image_noise: int = parameter(
        9,
        "Pixel noise",
        "Largest noise of every pixel and channel; it is uniform.",
        unit="grey levels",
        within=(0, 60, 1),
        role="world",
    )


Slices: TypeAlias = tuple[slice, slice]

BASE, GAINS = (150.0, 140.0, 118.0), (1.0, 0.9, 0.8)
GRAVEL = ((2, 14.0), (5, 12.0), (17, 16.0))
"""Pitch, px, and amplitude, grey levels, of the three sizes of grain."""
PEBBLES = 60

SKIN = (40.0, 105.0, 235.0)
SCALES = (
    (0.35, -0.27, 0.225, 0.33, 1.10),
    (-0.05, 0.27, 0.275, 0.33, 0.88),
    (-0.50, -0.13, 0.200, 0.33, 1.12),
)
"""Middle and semi-axes, in those of the body, and brightness of the patches of scales."""
EYES_AT, EYE_RADIUS, EYE = (0.72, 0.47), 0.15, (30.0, 25.0, 20.0)
SHADOW_OFFSET, SHADOW_BLUR, SHADOW_SHARE = (6, 8), 4.0, 0.18
PATCH_MARGIN = 20
"""Around a fish, px: as far as its blurred shadow reaches."""

FRAME_DRAW = 1_000_000
"""Number of the draw of the pixels' noise, beyond those of a clip's motion."""

SHIFT = 4
"""Bits of a sixteenth of a pixel."""


@lru_cache(maxsize=8)
def floor(number: int, width: int, height: int) -> NDArray[np.float32]:
    """Return the floor of the tank (height, width, 3) in BGR grey levels, read-only.

    Args:
        number: Of the clip.
        width: Of the picture, px.
        height: Of the picture, px.
    """
    stream = Stream(number, 3, Purpose.SCENE)
    grain = np.zeros((height, width), np.float32)
    for pitch, amplitude in GRAVEL:
        coarse = stream.standard_normal((height // pitch + 2, width // pitch + 2)).astype(np.float32)
        size = (coarse.shape[1] * pitch, coarse.shape[0] * pitch)
        grain += amplitude * cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)[:height, :width]
    ground = np.array(BASE, np.float32) + grain[:, :, None] * np.array(GAINS, np.float32)
    for x, y, radius, tone in stream.random((PEBBLES, 4)):
        colour = tuple(float(level) for level in np.array([70.0, 95.0, 115.0]) + 40.0 * (tone - 0.5))
        centre = (round(16 * width * x), round(16 * height * y))
        cv2.circle(ground, centre, round(16 * (2.0 + 2.0 * radius)), colour, -1, cv2.LINE_8, SHIFT)
    ground.flags.writeable = False
    return ground


def paint_fish(picture: NDArray[np.float32], poses: Floats, shape: FishShape) -> None:
    """Paint fish with their shadows into a picture, in place.

    Args:
        picture: (height, width, 3) BGR grey levels.
        poses: (fish, 4) (a, b, theta, phi) in px and rad.
        shape: Of all of them.
    """
    for pose in poses:
        reach = int(shape.reach) + PATCH_MARGIN
        corner = np.floor(pose[:2]).astype(np.int64) - reach
        cover, skin = _patch(pose - np.append(corner, (0.0, 0.0)), shape, 2 * reach + 1)
        shadow = np.float32(SHADOW_SHARE) * cv2.GaussianBlur(cover, (0, 0), SHADOW_BLUR)
        ground, under = _overlap(picture, corner + SHADOW_OFFSET, len(cover))
        picture[ground] *= np.float32(1.0) - shadow[under][:, :, None]
        ground, under = _overlap(picture, corner, len(cover))
        picture[ground] += cover[under][:, :, None] * (skin[under] - picture[ground])


def _patch(pose: Floats, shape: FishShape, side: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return how much of each pixel of a square patch a fish covers (side, side), and its skin (side, side, 3)."""
    mask = np.zeros((side, side), np.uint8)
    cv2.fillPoly(mask, [_sixteenths(body_points(pose, shape, 90))], 255, cv2.LINE_AA, SHIFT)
    cv2.fillPoly(mask, [_sixteenths(tail_corners(pose, shape))], 255, cv2.LINE_AA, SHIFT)
    skin = np.empty((side, side, 3), np.float32)
    skin[:] = SKIN
    for along, across, long, wide, light in SCALES:
        spot = FishShape(long * shape.half_length, wide * shape.half_width, 0.0)
        colour = tuple(min(light * level, 255.0) for level in SKIN)
        cv2.fillPoly(skin, [_sixteenths(body_points(_beside(pose, shape, along, across), spot))], colour, 8, SHIFT)
    for side_of in (-EYES_AT[1], EYES_AT[1]):
        eye = _beside(pose, shape, EYES_AT[0], side_of)
        x, y = _sixteenths(eye[:2])
        cv2.circle(skin, (int(x), int(y)), round(16 * EYE_RADIUS * shape.half_width), EYE, -1, cv2.LINE_8, SHIFT)
    return mask.astype(np.float32) / np.float32(255.0), skin


def _beside(pose: Floats, shape: FishShape, along: float, across: float) -> Floats:
    """Return the pose (4,) of something on the body, at shares of its half length and half width from its centre."""
    x, y, cosine, sine = along * shape.half_length, across * shape.half_width, np.cos(pose[2]), np.sin(pose[2])
    moved: Floats = pose + np.array([cosine * x - sine * y, sine * x + cosine * y, 0.0, 0.0])
    return moved


def _sixteenths(points: Floats) -> NDArray[np.int32]:
    """Return positions in whole sixteenths of a pixel, as OpenCV takes them."""
    return np.asarray(np.rint(2.0**SHIFT * points), np.int32)


def _overlap(picture: NDArray[np.float32], corner: Ints, side: int) -> tuple[Slices, Slices]:
    """Return where a square patch lies in a picture, and which part of the patch that is, both possibly nothing."""
    height, width, _ = picture.shape
    begin = np.clip(corner, 0, (width, height))
    end = np.clip(corner + side, 0, (width, height))
    (left, top), (right, bottom) = begin.tolist(), end.tolist()
    (x, y) = corner.tolist()
    return (slice(top, bottom), slice(left, right)), (slice(top - y, bottom - y), slice(left - x, right - x))


@compiled
def _develop(picture_bgr: NDArray[np.float32], numbers: Floats, noise: int) -> NDArray[np.uint8]:
    """Return the picture in RGB, with whole numbers between -noise and noise added; six of them from each number."""
    height, width, _ = picture_bgr.shape
    image = np.empty((height, width, 3), np.uint8)
    levels = 2 * noise + 1
    share, at = 0.0, 0
    for row in range(height):
        for column in range(width):
            for channel in range(3):
                level = picture_bgr[row, column, 2 - channel] + np.float32(0.5)
                if noise > 0:
                    if at % 6 == 0:
                        share = numbers[at // 6]
                    at += 1
                    share *= levels
                    whole = np.floor(share)
                    share -= whole
                    level += np.float32(whole - noise)
                image[row, column, channel] = np.uint8(min(max(level, np.float32(0.0)), np.float32(255.0)))
    return image


def develop(picture_bgr: NDArray[np.float32], noise: int, number: int, frame: int) -> NDArray[np.uint8]:
    """Return what the camera makes of a picture: (height, width, 3) RGB, read-only.

    Args:
        picture_bgr: (height, width, 3) grey levels.
        noise: Largest noise of a pixel, grey levels: uniform in whole numbers.
        number: Of the clip.
        frame: Of the frame.
    """
    count = -(-picture_bgr.size // 6) if noise else 0
    numbers = uniforms(number, frame, Purpose.SCENE.value, FRAME_DRAW, count)
    return read_only(_develop(picture_bgr, numbers, noise))


@dataclass(frozen=True, slots=True)
class FishTarget(Target):
    """Where a fish truly is: `position` is the centre of its body's ellipse, px.

    Attributes:
        theta: Direction to the head, rad.
        phi: Bend of the tail, rad.
        velocity: (2,) of the centre, px/frame; zero where it is not known, as on a recording that is marked.
        shape: Of the fish.
    """

    theta: float = 0.0
    phi: float = 0.0
    velocity: Floats = field(default_factory=lambda: np.zeros(2))
    shape: FishShape = GOLDFISH

    @classmethod
    def of(cls, pose: Floats, shape: FishShape, velocity: Floats, *, hidden: bool | None = False) -> Self:
        """Return the truth of a pose (4,), with the box around the body without its tail, in whose middle it is."""
        cosine, sine = float(np.cos(pose[2])), float(np.sin(pose[2]))
        width = 2.0 * float(np.hypot(shape.half_length * cosine, shape.half_width * sine))
        height = 2.0 * float(np.hypot(shape.half_length * sine, shape.half_width * cosine))
        return cls(
            position=pose[:2],
            size=max(width, height),
            hidden=hidden,
            extent=(width, height),
            theta=float(pose[2]),
            phi=float(pose[3]),
            velocity=velocity,
            shape=shape,
        )

    @property
    def pose(self) -> Floats:
        """(4,) (a, b, theta, phi) in px and rad."""
        return np.append(self.position, (self.theta, self.phi))

    def holds(self, point: Floats) -> bool:
        """Return whether a point (2,) lies within the silhouette."""
        return inside(point, self.pose, self.shape)


LOOK_ALIKE = "#eb6928"
"""Colour of the look-alikes: the fish's."""


class FishSource:
    """Ten seconds of a tank.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 15.
        frame_count: 150.
        start: The followed fish in frame 0.
        noisy: False: all that is random depends on the clip, and not on the seed of a run.
    """

    def __init__(self, seed: int, parameters: FishSceneParameters) -> None:
        """Fill the tank.

        Args:
            seed: Of the run, on which the scene does not depend.
            parameters: In force at frame 0.

        Raises:
            ParameterError: The fish that is to be followed is not there.
        """
        del seed
        if parameters.followed_fish > parameters.fish_count:
            raise ParameterError("followed_fish", parameters.followed_fish, f"at most {parameters.fish_count}")
        self._number = parameters.tank_number
        self._followed = parameters.followed_fish - 1
        self._poses = clip(parameters.tank_number, parameters.fish_count, parameters.lively, parameters.tank)
        self.size = (WIDTH, HEIGHT)
        self.frame_rate_hz = FRAME_RATE_HZ
        self.frame_count: int | None = FRAMES
        self.noisy = False
        self.start: Target = self.target(0, parameters)

    def frame(self, index: int, history: History[FishSceneParameters]) -> Frame:
        """Return the tank at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        picture = floor(self._number, WIDTH, HEIGHT).copy()
        paint_fish(picture, self._poses[index], GOLDFISH)
        image = develop(picture, parameters.image_noise, self._number, index)
        if parameters.occlusion_width_px > 0 or parameters.distracter_radius_px > 0:
            image = image.copy()
            paint(image, parameters, LOOK_ALIKE)
            image.flags.writeable = False
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=self.target(index, parameters))

    def target(self, index: int, parameters: FishSceneParameters) -> FishTarget:
        """Return the truth of a frame."""
        poses = self._poses[:, self._followed]
        pose, speed = poses[index], poses[max(index, 1), :2] - poses[max(index, 1) - 1, :2]
        left, right = strip(parameters, WIDTH)
        outline = model_points(pose, GOLDFISH)[:, 0]
        hidden = bool(left <= outline.min() and outline.max() < right)
        return FishTarget.of(pose, GOLDFISH, speed, hidden=hidden)
