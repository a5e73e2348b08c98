"""A simulated hand before a dark background, seen as a silhouette, with the truth (docs/methods/hands.md).

It moves in one of three ways that begin with an open hand (after Shimada 1997, section 2.8); time is in frames of the
motion, and need not be whole:

- *wrist*: the hand turns about its long axis until it is seen from the side, with fingers a little curled: with
  straight ones a turn either way has the same silhouette;
- *bend*: the fingers close until none is seen beside the palm;
- *occlusion*: the middle and the ring finger fold within two frames, stay folded, and come back.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Literal, Self, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import exponential, sines_cosines
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.hand.shape import ANGLES, MODEL, HandShape, joints, open_pose, silhouette
from pftrack.experiments.shared.recording import OverlayParameters, overlaid, strip

MotionName: TypeAlias = Literal["wrist", "bend", "occlusion"]

FRAMES = MappingProxyType({"wrist": 30, "bend": 30, "occlusion": 24})
"""Frames of each motion."""

FOUR = np.array([9, 13, 17, 21])
"""Indices of the four fingers' angles in a pose, each beginning with its spread."""
FOLDED = FOUR[1:3]
"""Fingers that fold in *occlusion*: the middle and the ring finger."""


def pose_at(motion: MotionName, time: float) -> Floats:
    """Return the pose (25,) of a hand whose wrist is at the origin and whose fingers point upwards.

    Args:
        motion: One of the three.
        time: Time in frames, from 0; after its last frame the motion stops.
    """
    pose, last = open_pose((0.0, 0.0)), FRAMES[motion] - 1.0
    match motion:
        case "wrist":
            share = _ease(time / last)
            pose[2], pose[3] = 0.10 * share, 1.05 * share
            _flex(pose, FOUR, 0.22)
        case "bend":
            share = _ease((time - 3.0) / (last - 3.0))
            _flex(pose, FOUR, 1.25 * share)
            pose[6:9] += share * (0.35 - pose[6:9])
        case "occlusion":
            pose[3] = 0.25 * sines_cosines(np.array([0.25 * time]))[0][0]
            share = min(max((time - 4.0) / 2.0, 0.0), 1.0) - min(max((time - 14.0) / 4.0, 0.0), 1.0)
            _flex(pose, FOLDED, 1.3 * share)
    return pose


def folded_time(motion: MotionName, time: float) -> float:
    """Return the time of a motion that runs forwards, then backwards, then forwards again without end."""
    last = FRAMES[motion] - 1.0
    within = time % (2.0 * last)
    return min(within, 2.0 * last - within)


def _ease(share: float) -> float:
    """Return 0 before the beginning, 1 after the end, and half a cosine between."""
    return 0.5 - 0.5 * float(sines_cosines(np.array([np.pi * min(max(share, 0.0), 1.0)]))[1][0])


def _flex(pose: Floats, fingers: Ints, angle: float) -> None:
    for first in fingers:
        pose[first + 1 : first + 4] = angle


HAND, CAMERA = "Hand", "Camera and light"


class _Hand(OverlayParameters, group=HAND):
    """The hand and its gestures."""

    motion: MotionName = parameter("occlusion", "Motion", live=False)
    """Gesture of the hand: it turns at the wrist, bends all fingers, or folds two of them within two frames."""
    speed: float = parameter(1.0, "Speed", within=(0.25, 4, 0.25), live=False, role="world")
    """How fast it does that; at 1 a motion takes 24 to 30 frames."""
    passes: int = parameter(1, "Passes", within=(1, 40, 1), useful=(1, 10), live=False)
    """How often the motion is gone through, forwards and backwards in turn."""
    hand: Literal["right", "left"] = parameter("right", "Which hand", live=False)
    """Hand that shows its palm: a right one with the thumb on the right, or a left one."""
    turn_deg: float = parameter(0, "Turn", unit="°", within=(-180, 180, 5), live=False)
    """Angle by which hand and arm are turned on the screen, counter-clockwise."""
    palm_axis_px: float = parameter(52, "Palm axis", unit="px", within=(20, 70, 1), live=False)
    """Length from the wrist to the middle of the knuckles, in a picture with sides of 200 px."""
    proportions: float = parameter(0.04, "Other proportions", within=(0, 0.2, 0.01), live=False)
    """Share by which lengths and widths of a finger may differ from those that the trackers expect."""


class HandSceneParameters(_Hand, group=CAMERA):
    """The scene: how the hand moves, how it differs from the model, and how well it is seen."""

    edge_noise_px: float = parameter(0.6, "Edge noise", unit="px", within=(0, 4, 0.1), role="world")
    """Standard deviation of where the edge of the silhouette is seen."""
    image_noise_sd: float = parameter(0, "Pixel noise", unit="grey levels", within=(0, 60, 1), role="world")
    """Standard deviation of the noise on every pixel."""
    flash_every: int = parameter(0, "Flashes", unit="frames", within=(0, 100, 1))
    """Every how many frames one is all white, as by a flash of light; 0 for none."""
    picture_side_px: int = parameter(200, "Picture size", unit="px", within=(120, 1000, 20), live=False)
    """Width and height of the picture; the hand grows with it."""


# Smooth noise is added to each pixel's distance from the silhouette's edge, positive inside; the hand is visible where
# the sum is above 0. So the edge moves by the noise, and what is thin stays whole.

SKIN, BACKGROUND = (224, 172, 138), (16, 20, 24)
"""RGB. Any threshold of brightness between 25 and 175 separates them."""

SMOOTH_PX = 2.0
"""Standard deviation of the Gaussian that smooths the edge's noise."""
REACH_PX = 6

EDGE, PIXELS = 0, 1
"""Draws of a frame."""


def with_noisy_edge(mask: Bools, noise_px: float, seed: int, frame: int) -> Bools:
    """Return a silhouette (height, width) whose edge has moved.

    Args:
        mask: (height, width).
        noise_px: Standard deviation of its displacement.
        seed: Seed of the run.
        frame: Number of the frame.
    """
    if noise_px <= 0.0:
        return mask
    inside, outside = (
        cv2.distanceTransform(side.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) for side in (mask, ~mask)
    )
    # The edge runs between the pixels, half a pixel from the centres on either side.
    distance = np.where(mask, inside - np.float32(0.5), np.float32(0.5) - outside)
    near = np.abs(distance) < 5.0 * noise_px
    return np.asarray(np.where(near, distance + noise_px * _smooth_noise(mask.shape, seed, frame), distance) > 0.0)


def paint_silhouette(mask: Bools, noise_sd: float, seed: int, frame: int) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3) of a silhouette, RGB.

    Args:
        mask: (height, width).
        noise_sd: Standard deviation of the noise of every pixel, grey levels; the same in all channels.
        seed: Seed of the run.
        frame: Number of the frame.
    """
    image = np.where(mask[:, :, None], np.array(SKIN, np.uint8), np.array(BACKGROUND, np.uint8))
    if noise_sd > 0.0:
        noise = noise_sd * _normals(mask.shape, seed, frame, PIXELS)[:, :, None]
        image = np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)
    return image


def _normals(shape: tuple[int, ...], seed: int, frame: int, draw: int) -> Floats:
    """Return N(0, 1) numbers (height, width) of one of a frame's draws."""
    # The first draws of frame 0 make the hand.
    return np.asarray(Stream(seed, 2 * frame + draw + 1, Purpose.SCENE).standard_normal(shape))


def _smooth_noise(shape: tuple[int, ...], seed: int, frame: int) -> Floats:
    """Return smooth noise (height, width) of unit variance: summed in a fixed order, not by OpenCV."""
    weights, (height, width) = _weights(), shape
    noise = _normals((height + 2 * REACH_PX, width + 2 * REACH_PX), seed, frame, EDGE)
    across = weights[0] * noise[:, :width]
    for step in range(1, len(weights)):
        across += weights[step] * noise[:, step : step + width]
    smooth = weights[0] * across[:height]
    for step in range(1, len(weights)):
        smooth += weights[step] * across[step : step + height]
    return np.asarray(smooth)


@lru_cache(maxsize=1)
def _weights() -> tuple[float, ...]:
    """Return the Gaussian's weights; the sum of their squares is 1, which keeps the variance."""
    steps = np.arange(-REACH_PX, REACH_PX + 1)
    weights = exponential(-0.5 * np.square(steps / SMOOTH_PX))
    return tuple((weights / np.sqrt(sum(np.square(weights).tolist()))).tolist())


@dataclass(frozen=True, slots=True)
class HandTarget(Target):
    """The true pose of a hand: `position` (15,) holds the places of the five tips, thumb first, px.

    Each has column, row, and height above the wrist towards the camera.

    Attributes:
        pose: (25,) as `pftrack.experiments.hand.shape` has it.
        scale: Length of the palm axis, px.
        shape: Shape of this hand.
        model: The tracker's model of the hand's shape: that of the average hand, or one measured from a person.
    """

    pose: Floats = field(default_factory=lambda: np.zeros(ANGLES))
    scale: float = 1.0
    shape: HandShape = MODEL
    model: HandShape = MODEL

    @classmethod
    def of(
        cls,
        pose: Floats,
        scale: float,
        shape: HandShape,
        model: HandShape,
        *,
        hidden: bool | None = False,
    ) -> Self:
        """Return the truth of a pose, with the box around wrist and tips."""
        tips = joints(pose, scale, shape)[:, 3]
        points = np.vstack([pose[:2], tips[:, :2]])
        width, height = (points.max(axis=0) - points.min(axis=0)).tolist()
        return cls(
            position=tips.ravel(),
            size=max(width, height),
            hidden=hidden,
            extent=(width, height),
            pose=pose,
            scale=scale,
            shape=shape,
            model=model,
        )

    @property
    def tips(self) -> Floats:
        """(5, 2) column and row of the tips, thumb first, px."""
        return self.position.reshape(5, 3)[:, :2]


WRIST = (0.0, 37.0)
"""Offset of an unturned hand from the middle of a picture with sides of `SIDE_PX`, px, as in the reference scene."""
SIDE_PX = 200.0
ARM = (MODEL.arm[0], 4.0)
"""Half the forearm's width and its length: beyond the border, however it is turned."""
FRAME_RATE_HZ = 10.0
LOOK_ALIKE = "#e0ac8a"
"""Colour of the look-alikes: the hand's."""


class HandSource:
    """Two or three seconds of a hand.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 10.
        frame_count: Frames of the motion, by its speed and passes.
        start: The hand in frame 0.
        noisy: True: the seed gives the hand's proportions and the edge's noise.
    """

    def __init__(self, seed: int, parameters: HandSceneParameters) -> None:
        """Hold the hand up; arguments as for every source."""
        self._seed = seed
        self._motion, self._speed = parameters.motion, parameters.speed
        side = parameters.picture_side_px
        self._scale = parameters.palm_axis_px * side / SIDE_PX
        self._turn = parameters.turn_deg * math.pi / 180.0
        self._model = MODEL.with_changes(side=1.0 if parameters.hand == "right" else -1.0, arm=ARM)
        self._shape = hand_of(seed, parameters.proportions, self._model)
        sines, cosines = sines_cosines(np.array([self._turn]))
        across, down = (offset * side / SIDE_PX for offset in WRIST)
        middle = side / 2.0
        self._wrist = (
            middle + cosines[0] * across + sines[0] * down,
            middle - sines[0] * across + cosines[0] * down,
        )
        self.size = (side, side)
        self.frame_rate_hz = FRAME_RATE_HZ
        steps = (FRAMES[parameters.motion] - 1) * parameters.passes / parameters.speed
        self.frame_count: int | None = math.ceil(steps) + 1
        self.noisy = True
        self.start: Target = self.target(0, parameters)

    def frame(self, index: int, history: History[HandSceneParameters]) -> Frame:
        """Return the hand at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self.target(index, parameters)
        image = self._picture(target, index, parameters)
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=read_only(image), target=target)

    def target(self, index: int, parameters: HandSceneParameters) -> HandTarget:
        """Return the truth of a frame."""
        pose = pose_at(self._motion, folded_time(self._motion, self._speed * index))
        pose[:2] = self._wrist
        # The hand of the other side is the mirror image, which turns the other way.
        pose[2:4] *= self._model.side
        pose[2] += self._turn
        target = HandTarget.of(pose, self._scale, self._shape, self._model)
        left, right = strip(parameters, self.size[0])
        columns = np.append(target.tips[:, 0], pose[0])
        if left <= columns.min() and columns.max() < right:
            return HandTarget.of(pose, self._scale, self._shape, self._model, hidden=True)
        return target

    def _picture(self, target: HandTarget, index: int, parameters: HandSceneParameters) -> NDArray[np.uint8]:
        if parameters.flash_every and index % parameters.flash_every == parameters.flash_every - 1:
            return np.full((self.size[1], self.size[0], 3), 255, np.uint8)
        mask = silhouette(target.pose, target.scale, target.shape, self.size)
        mask = with_noisy_edge(mask, parameters.edge_noise_px, self._seed, index)
        image = paint_silhouette(mask, parameters.image_noise_sd, self._seed, index)
        return overlaid(image, parameters, LOOK_ALIKE)


def hand_of(seed: int, proportions: float, model: HandShape) -> HandShape:
    """Return the hand of a seed: each finger's lengths and radii differ from the model's by separate shares.

    Args:
        seed: Seed of the run.
        proportions: Largest share; they are uniform.
        model: The average hand.
    """
    lengths, widths = 1.0 + proportions * (2.0 * Stream(seed, 0, Purpose.SCENE).random((2, 5, 1)) - 1.0)
    return model.with_changes(phalanges=lengths * model.phalanges, radii=widths * model.radii)
