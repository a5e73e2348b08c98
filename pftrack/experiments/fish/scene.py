"""A tank of goldfish seen from above, the simulated source of the fish (docs/methods/diffusion.md).

`swimming` defines how the fish swim, bend and turn. Everything is painted with OpenCV's anti-aliased shapes in whole
numbers of sixteenths of a pixel, so a pose has one picture. Colours are BGR while painting, as in OpenCV.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Self, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.marks import LongBody
from pftrack.core.model.parameters import parameter, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Setup, Suitability, grade
from pftrack.core.model.source import Frame, FrameSequence, History, Target, Truth
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.random import Purpose, Stream, uniforms
from pftrack.core.refusal import ParameterError
from pftrack.experiments.fish.model import (
    CAP_PX,
    GOLDFISH,
    Edges,
    FishShape,
    body_points,
    edges_of,
    foreground,
    inside,
    largest_distances,
    model_points,
    shape,
    tail_corners,
)
from pftrack.experiments.fish.parameters import FishTrackerParameters
from pftrack.experiments.fish.swimming import FRAME_RATE_HZ, FRAMES, HEIGHT, WIDTH, TankName, clip
from pftrack.experiments.shared.recording import (
    SHIFT,
    OverlayParameters,
    RecordingParameters,
    RecordingSource,
    overlaid,
    sixteenths,
    strip,
)
from pftrack.experiments.shared.reports import JudgedByBox

TANK = "Tank"


class FishSceneParameters(OverlayParameters, group=TANK):
    """The scene: which clip, how many fish, how they turn, and what is laid over the picture."""

    tank_number: int = parameter(200, "Clip", within=(0, 9999, 1), useful=(0, 500), live=False)
    """Number of the clip: the seed of the swimming, of the gravel and of the noise. The paper's test uses 200 to 211,
    and the trackers' motion was learned on 100 to 109."""
    fish_count: int = parameter(2, "Fish", within=(1, 2, 1), live=False)
    """Number of fish."""
    lively: bool = parameter(True, "Lively first fish", live=False)
    """Whether the first fish turns sharply at least once: by 60 degrees within four frames."""
    followed_fish: int = parameter(1, "Followed fish", within=(1, 2, 1), live=False)
    """Number of the fish that is tracked; the second fish is always calm."""
    tank: TankName = parameter("goldfish", "Water", live=False)
    """How the water answers a bend. With the strong rudder the return stroke turns a fish the same way as the bend, so
    that bend and turn are not coupled with one sign."""
    image_noise: int = parameter(9, "Pixel noise", unit="grey levels", within=(0, 60, 1), role="world")
    """Largest noise of every pixel and channel; it is uniform."""


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


@lru_cache(maxsize=8)
def floor(number: int, width: int, height: int) -> NDArray[np.float32]:
    """Return the floor of the tank (height, width, 3) in BGR grey levels, read-only.

    Args:
        number: Number of the clip.
        width: Width of the picture, px.
        height: Height of the picture, px.
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
        shape: Shape of all fish.
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
    """Return a fish's cover (side, side) of the pixels of a square patch, and its skin (side, side, 3)."""
    mask = np.zeros((side, side), np.uint8)
    cv2.fillPoly(mask, [sixteenths(body_points(pose, shape, 90))], 255, cv2.LINE_AA, SHIFT)
    cv2.fillPoly(mask, [sixteenths(tail_corners(pose, shape))], 255, cv2.LINE_AA, SHIFT)
    skin = np.empty((side, side, 3), np.float32)
    skin[:] = SKIN
    for along, across, long, wide, light in SCALES:
        spot = FishShape(long * shape.half_length, wide * shape.half_width, 0.0)
        colour = tuple(min(light * level, 255.0) for level in SKIN)
        cv2.fillPoly(skin, [sixteenths(body_points(_beside(pose, shape, along, across), spot))], colour, 8, SHIFT)
    for side_of in (-EYES_AT[1], EYES_AT[1]):
        eye = _beside(pose, shape, EYES_AT[0], side_of)
        x, y = sixteenths(eye[:2])
        cv2.circle(skin, (int(x), int(y)), round(16 * EYE_RADIUS * shape.half_width), EYE, -1, cv2.LINE_8, SHIFT)
    return mask.astype(np.float32) / np.float32(255.0), skin


def _beside(pose: Floats, shape: FishShape, along: float, across: float) -> Floats:
    """Return the pose (4,) of a part of the body, at shares of its half length and half width from its centre."""
    x, y, cosine, sine = along * shape.half_length, across * shape.half_width, np.cos(pose[2]), np.sin(pose[2])
    moved: Floats = pose + np.array([cosine * x - sine * y, sine * x + cosine * y, 0.0, 0.0])
    return moved


def _overlap(picture: NDArray[np.float32], corner: Ints, side: int) -> tuple[Slices, Slices]:
    """Return the region of a square patch in a picture, and the matching region of the patch; both may be empty."""
    height, width, _ = picture.shape
    begin = np.clip(corner, 0, (width, height))
    end = np.clip(corner + side, 0, (width, height))
    (left, top), (right, bottom) = begin.tolist(), end.tolist()
    (x, y) = corner.tolist()
    return (slice(top, bottom), slice(left, right)), (slice(top - y, bottom - y), slice(left - x, right - x))


@compiled
def _develop(picture_bgr: NDArray[np.float32], numbers: Floats, noise: int) -> NDArray[np.uint8]:
    """Return the picture in RGB with whole numbers between -noise and noise added, six from each random number."""
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
    """Return the camera's version of a picture: (height, width, 3) RGB, read-only.

    Args:
        picture_bgr: (height, width, 3) grey levels.
        noise: Largest noise of a pixel, grey levels: uniform in whole numbers.
        number: Number of the clip.
        frame: Number of the frame.
    """
    count = -(-picture_bgr.size // 6) if noise else 0
    numbers = uniforms(number, frame, Purpose.SCENE.value, FRAME_DRAW, count)
    return read_only(_develop(picture_bgr, numbers, noise))


@dataclass(frozen=True, slots=True)
class FishTarget(Target):
    """The true pose of a fish: `position` is the centre of its body's ellipse, px.

    Attributes:
        theta: Direction to the head, rad.
        phi: Bend of the tail, rad.
        velocity: (2,) velocity of the centre, px/frame; zero if unknown, as on a marked recording.
        shape: Shape of the fish.
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
            seed: Seed of the run; the scene does not depend on it.
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
        image = overlaid(image, parameters, LOOK_ALIKE)
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=self.target(index, parameters))

    def target(self, index: int, parameters: FishSceneParameters) -> FishTarget:
        """Return the truth of a frame."""
        poses = self._poses[:, self._followed]
        pose, speed = poses[index], poses[max(index, 1), :2] - poses[max(index, 1) - 1, :2]
        left, right = strip(parameters, WIDTH)
        outline = model_points(pose, GOLDFISH)[:, 0]
        hidden = bool(left <= outline.min() and outline.max() < right)
        return FishTarget.of(pose, GOLDFISH, speed, hidden=hidden)


# A recording of a fish from above: the mark gives the shape, and the separation of the fish from the water.
#
# The motion learned from the tank's fish is scaled to the marked body: lengths go with its half length, the tolerance
# of edges with the square of it. That assumes that fish move alike when measured in bodies per frame, which holds at
# best for fish of one kind at one frame rate. It is a starting point: the width of the diffusion is live.

LEAST_SIGMA_D_PX2, LARGEST_SIGMA_D_PX2 = 1.0, 400.0
"""Edges are a pixel wide, however small the fish; a fish of more than 320 px has the largest that can be set."""

COLOURFUL, DISTINCT = 60, 0.35
"""Least median saturation of a fish separated by colour, and the largest share of such pixels around it."""

HUE_ROOM, SHARE_OF_LOW = 6, 0.7
"""Margin of hues beyond nine tenths of the fish, and factor on the tenth percentile of its other values."""

AROUND_BODIES = 2.0
"""Radius of a fish's surroundings, in half lengths."""


class FishBody(LongBody):
    """A fish from above."""

    title: ClassVar[str] = "Fish"

    @classmethod
    def of_target(cls, target: Target) -> "FishBody | None":
        """Return the mark of a fish whose pose is known."""
        if not isinstance(target, FishTarget):
            return None
        ahead = np.array([np.cos(target.theta), np.sin(target.theta)])
        tail = np.array([np.cos(target.theta + target.phi), np.sin(target.theta + target.phi)])
        head = target.position + target.shape.half_length * ahead
        root = target.position - target.shape.half_length * ahead
        tip = root - target.shape.tail_length * tail
        return cls(
            head=tuple(head.tolist()),
            root=tuple(root.tolist()),
            tip=tuple(tip.tolist()),
            half_width=target.shape.half_width,
        )

    @property
    def target(self) -> FishTarget:
        """The fish that is marked, at rest."""
        lengths = FishShape(self.half_length, self.half_width, self.tail_length)
        pose = np.append(self.centre, (self.heading, self.bend))
        return FishTarget.of(pose, lengths, np.zeros(2), hidden=None)


class RecordedFishParameters(JudgedByBox, RecordingParameters, FishTrackerParameters):
    """A recording with an overlay, and its trackers."""


def wire(sequence: FrameSequence, mark: FishBody, start: int, truth: Truth | None) -> Setup:
    """Wire a recording of a fish.

    Args:
        sequence: The pictures.
        mark: The fish in the picture `start`.
        start: Number of the picture to start at.
        truth: True boxes by number of the picture, where they are known.
    """
    target = mark.target
    scaled = 25.0 * (target.shape.half_length / GOLDFISH.half_length) ** 2
    parameters = revise(
        RecordedFishParameters(),
        {
            "half_length_px": min(max(target.shape.half_length, 2.0), 400.0),
            "half_width_px": min(target.shape.half_width, 400.0),
            "tail_length_px": min(target.shape.tail_length, 400.0),
            "sigma_d_px2": min(max(scaled, LEAST_SIGMA_D_PX2), LARGEST_SIGMA_D_PX2),
            **_appearance(sequence.picture(start), target),
        },
    )
    source = RecordingSource(sequence, (0.0, 0.0, 1.0, 1.0), start, truth.at if truth else None, start=target)
    return Setup(lambda _seed, _parameters: source, parameters)


def _appearance(image_rgb: NDArray[np.uint8], target: FishTarget) -> dict[str, object]:
    """Return the separation of a fish from its surroundings: by its colour if it has one, else by its brightness."""
    on, around = _regions(image_rgb.shape[:2], target)
    hsv = np.asarray(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2HSV), np.int64)
    grey = np.asarray(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2GRAY), np.float64)
    hue, saturation, value = hsv[on].T
    middle = int(np.argmax(np.bincount(hue, minlength=180)))
    off = np.sort((hue - middle + 90) % 180 - 90)
    low, high = (int(off[int(share * (len(off) - 1))]) for share in (0.05, 0.95))
    ranges = {
        "lowest_hue": (middle + low - HUE_ROOM) % 180,
        "highest_hue": (middle + high + HUE_ROOM) % 180,
        "saturation_low": int(SHARE_OF_LOW * np.sort(saturation)[len(off) // 10]),
        "value_low": int(SHARE_OF_LOW * np.sort(value)[len(off) // 10]),
    }
    beside = hsv[around]
    within = (beside[:, 0] - ranges["lowest_hue"]) % 180 <= (ranges["highest_hue"] - ranges["lowest_hue"]) % 180
    alike = within & (beside[:, 1] >= ranges["saturation_low"]) & (beside[:, 2] >= ranges["value_low"])
    difference = float(np.median(grey[around]) - np.median(grey[on])) if around.any() else 0.0
    chosen: dict[str, object] = {
        **ranges,
        "least_contrast": min(max(round(0.5 * abs(difference)), 5), 255),
        "contrast_radius_px": min(max(round(AROUND_BODIES * target.shape.half_length), 3), 200),
    }
    share = float(alike.mean()) if len(alike) else 0.0
    if np.median(saturation) >= COLOURFUL and share <= DISTINCT:
        return {**chosen, "foreground": "colour"}
    return {**chosen, "foreground": "dark" if difference > 0.0 else "light"}


def _regions(size: tuple[int, ...], target: FishTarget) -> tuple[Bools, Bools]:
    """Return the pixels of the inner part of a fish's body, at least one, and those around the fish."""
    rows, columns = np.indices(size[:2])
    x, y = columns - target.position[0], rows - target.position[1]
    cosine, sine = np.cos(target.theta), np.sin(target.theta)
    along, across = cosine * x + sine * y, cosine * y - sine * x
    shape_of = target.shape
    inner = (along / shape_of.half_length) ** 2 + (across / shape_of.half_width) ** 2
    away = np.hypot(x, y) / shape_of.half_length
    own = (inner <= 2.0) | ((np.abs(across) < shape_of.half_width) & (along < 0.0))
    return inner <= max(0.7, float(inner.min())), (away <= AROUND_BODIES) & ~own


def suits(sequence: FrameSequence, footage: Footage, parameters: RecordedFishParameters) -> Suitability:
    """Return how well a marked fish stands out: the share of it classified as fish, and that of its surroundings.

    The marked outline must also fit the edges; the worse of the two counts.
    """
    mark = FishBody.read(footage.mark)
    image = sequence.picture(footage.start)
    seen = edges_of(image, foreground(parameters))
    on, around = _regions(image.shape[:2], mark.target)
    covered, beside = (float((seen.mask[region] > 0).mean()) if region.any() else 0.0 for region in (on, around))
    d_max = _fit(seen, mark, parameters)
    allowed = 0.5 * parameters.half_width_px + 2.0
    value = min(grade(max(covered - beside, 0.0), 0.3, 0.7), grade(allowed / max(d_max, 0.1), 0.5, 1.0))
    told = {"colour": "colour", "dark": "darkness", "light": "brightness"}[parameters.foreground]
    fits = f"within {d_max:.1f} px of edges" if d_max < CAP_PX else f"partly {CAP_PX} px or more from any edge"
    remark = (
        f"{100 * covered:.0f} % of the body is told from the water by its {told}, and {100 * beside:.0f} % of what is "
        f"around it as well; the outline is {fits}"
    )
    return Suitability(value, remark, _advice(parameters, covered, beside, d_max > 2.0 * allowed))


def _fit(seen: Edges, mark: FishBody, parameters: FishTrackerParameters) -> float:
    """Return the largest distance of the marked outline's points from an edge, px."""
    pose = np.asfortranarray(mark.target.pose[None])
    return float(largest_distances(seen.distances, pose, shape(parameters))[0]) / 4.0


def _advice(parameters: RecordedFishParameters, covered: float, beside: float, far: bool) -> tuple[str, ...]:
    by_colour = parameters.foreground == "colour"
    advice = []
    if covered < 0.7:
        wider = "widen the range of hues, or lower the least saturation or brightness"
        advice.append(wider if by_colour else "lower the least contrast, or separate it by its colour")
    if beside > 0.2:
        narrower = "narrow the range of hues, or raise the least saturation or brightness"
        advice.append(narrower if by_colour else "raise the least contrast, or separate it by its colour")
    if far:
        advice.append("mark head, root and tip on the outline; each point of it should lie near an edge")
    if parameters.half_length_px < 8.0:
        advice.append("the fish is a few pixels long, so its bend cannot be seen: expect its place and no more")
    return tuple(advice)
