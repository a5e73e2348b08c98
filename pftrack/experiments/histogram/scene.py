"""The simulated lawn: a two-coloured target passes a look-alike, and then behind a column (docs/methods/colours.md).

The target is an ellipse, red above and yellow below. The look-alike has the same colours in other shares, and comes
towards it; the target passes in front. The column stands in front of both and has the colours of the lawn, combed
vertically: a part of the target's window also shows lawn, so a cloud of particles without its target would be attracted
by the lawn on either side of a column of another colour. All but the number of the scene is live.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.recording import GROUP as OCCLUSION
from pftrack.experiments.shared.recording import occlusion_width

GROUP = "Scene"
SIZE = 320, 240
FRAME_RATE_HZ = 30.0
HALF_AXES_PX = 12.5, 16.5
"""From the middle of the target to its edge, so it fills a window of 25 x 33 px."""
TEXTURE = 0.3
"""Standard deviation of the blurred noise. It is not known whether blurring left it at 1 in the reference scene or, as
it does by itself, at 0.1; at 0.3 target, look-alike and lawn are as like the model as there, the scenes as hard."""
LAWN_RGB, LAWN_SD_RGB = np.array([105.0, 120.0, 95.0]), TEXTURE * np.array([16.0, 12.0, 14.0])
GREY_RGB, GREY_SD_RGB = np.full(3, 108.0), np.full(3, TEXTURE * 14.0)
RED_RGB, YELLOW_RGB = np.array([205.0, 40.0, 40.0]), np.array([215.0, 190.0, 40.0])
BORDER_PX = 2
BORDER_RGB = 0.6 * LAWN_RGB
"""Darker, of the lawn's hue: a border that shares no bin with the lawn would keep particles from going behind it."""
LAWN_BLUR_PX, COLUMN_BLUR_PX = (2.5, 2.5), (1.5, 12.0)
"""Standard deviations across and down."""
SPLIT_PX, EDGE_PX = 2.0, 0.5
"""Over which the two colours, and target and lawn, pass into each other."""
LIGHTING_FRAMES = 50.0


class LawnSceneParameters(Parameters, group=GROUP):
    """What the scene looks like."""

    scene_number: int = parameter(0, "Scene number", within=(0, 9999, 1), useful=(0, 99), live=False)
    """Number of the lawn, with its column and its noise; the seed of a run is that of its tracker alone."""
    look_alike_red: float = parameter(0.68, "Red of the look-alike", within=(0, 1, 0.01), role="world")
    """Red share of the look-alike's height; the target has 0.5."""
    occlusion_width_px: float = occlusion_width(46)
    occlusion_offset_px: float = parameter(69, "Occluder place", unit="px", within=(-160, 160, 1), group=OCCLUSION)
    """Distance of the column's middle to the right of the picture's middle."""
    column_colours: Literal["lawn", "grey"] = parameter("lawn", "Colours of the column")
    """Those of the lawn, or greys, which look like no part of a window."""
    lighting_amplitude: float = parameter(0.08, "Change of light", within=(0, 0.9, 0.01), role="world")
    """Share by which the light grows and falls again, every 50 frames."""
    image_noise_sd: float = parameter(
        4, "Pixel noise", unit="grey levels", within=(0, 100, 1), useful=(0, 40), role="world"
    )
    """Standard deviation of the noise on every pixel and channel."""


class LawnSource:
    """120 frames of the lawn, and the target's way on from there.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: None; the target moves on, out of the picture.
        start: The target at frame 0.
        noisy: False: all runs of a scene see the same pictures.
    """

    def __init__(self, seed: int, parameters: LawnSceneParameters) -> None:
        """Set the scene.

        Args:
            seed: Seed of the run; the scene does not depend on it.
            parameters: In force at frame 0.
        """
        del seed
        self.size = SIZE
        self.frame_rate_hz = FRAME_RATE_HZ
        self.frame_count: int | None = None
        self.start = _target(0, parameters)
        self.noisy = False

    def frame(self, index: int, history: History[LawnSceneParameters]) -> Frame:
        """Return the scene at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        return Frame(
            index,
            index / FRAME_RATE_HZ,
            image_rgb=_picture(index, _scene(parameters)),
            target=_target(index, parameters),
        )


def visible_share(index: int, parameters: LawnSceneParameters) -> float:
    """Return what share of the target, 0..1, is not hidden by the column."""
    (u, v), (left, right) = _place(index), _column(parameters)
    rows, columns = _window(u, v)
    shown = _ellipse(u, v, rows, columns)[0] > 0.0
    across = np.arange(SIZE[0])[columns]
    return float(np.count_nonzero(shown[:, (across < left) | (across >= right)]) / np.count_nonzero(shown))


def look_alike_place(index: int) -> tuple[float, float]:
    """Return where the middle of the look-alike is, px."""
    return 250.0 - 2.4 * index, float(138.0 - 6.0 * np.sin(2.0 * np.pi * index / 70.0))


def _place(index: int) -> tuple[float, float]:
    return 28.0 + 2.2 * index, float(120.0 + 14.0 * np.sin(2.0 * np.pi * index / 90.0))


def _target(index: int, parameters: LawnSceneParameters) -> Target:
    extent = 2.0 * HALF_AXES_PX[0], 2.0 * HALF_AXES_PX[1]
    hidden = 0 < index < 200 and visible_share(index, parameters) == 0.0
    return Target(np.array(_place(index)), max(extent), hidden=hidden, extent=extent)


def _column(parameters: LawnSceneParameters) -> tuple[int, int]:
    """Return the first column of pixels that is covered, and the one behind the last."""
    left = SIZE[0] / 2 + parameters.occlusion_offset_px - parameters.occlusion_width_px / 2
    first, last = (
        int(min(max(np.floor(edge + 0.5), 0), SIZE[0])) for edge in (left, left + parameters.occlusion_width_px)
    )
    return first, last


@lru_cache(maxsize=64)
def _scene(parameters: LawnSceneParameters) -> LawnSceneParameters:
    """Return only the values that a picture depends on, so trackers with other parameters see the same one."""
    return LawnSceneParameters(**{name: getattr(parameters, name) for name in LawnSceneParameters.model_fields})


@lru_cache(maxsize=256)
def _picture(index: int, parameters: LawnSceneParameters) -> NDArray[np.uint8]:
    """Draw a frame; two runs of a scene stay in the cache."""
    image = _lawn(parameters.scene_number).copy()
    _paint(image, *look_alike_place(index), parameters.look_alike_red)
    _paint(image, *_place(index), 0.5)
    left, right = _column(parameters)
    image[:, left:right] = _standing(parameters.scene_number, parameters.column_colours)[:, left:right]
    image[:, left : min(left + BORDER_PX, right)] = BORDER_RGB
    image[:, max(right - BORDER_PX, left) : right] = BORDER_RGB
    image *= 1.0 + parameters.lighting_amplitude * np.sin(2.0 * np.pi * index / LIGHTING_FRAMES)
    if parameters.image_noise_sd > 0.0:
        # One draw a frame after those of the lawn and of the column, which are the draws of frame 0.
        noise = Stream(parameters.scene_number, index + 1, Purpose.SCENE).standard_normal(image.shape)
        image += parameters.image_noise_sd * noise
    drawn = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    drawn.flags.writeable = False
    return drawn


@lru_cache(maxsize=8)
def _lawn(scene_number: int) -> Floats:
    return LAWN_RGB + LAWN_SD_RGB * _texture(scene_number, 0, LAWN_BLUR_PX)


@lru_cache(maxsize=8)
def _standing(scene_number: int, colours: Literal["lawn", "grey"]) -> Floats:
    """Return the texture of a column as wide as the picture."""
    texture = _texture(scene_number, 1, COLUMN_BLUR_PX)
    if colours == "grey":
        return GREY_RGB + GREY_SD_RGB * texture[:, :, :1]
    return LAWN_RGB + LAWN_SD_RGB * texture


def _texture(scene_number: int, draw: int, blur_px: tuple[float, float]) -> Floats:
    """Return blurred white noise (height, width, 3) of unit variance."""
    stream = Stream(scene_number, 0, Purpose.SCENE)
    for _ in range(draw + 1):
        noise = stream.standard_normal((SIZE[1], SIZE[0], 3))
    for axis, sd in ((1, blur_px[0]), (0, blur_px[1])):
        noise = _blur(noise, axis, sd)
    return np.asarray(noise)


def _blur(noise: Floats, axis: int, sd: float) -> Floats:
    """Return noise convolved with a Gaussian along an axis, on around the edges, with its variance kept."""
    reach = int(3.0 * sd + 0.5)
    offsets = np.arange(-reach, reach + 1)
    weights = exponential(-0.5 * np.square(offsets / sd))
    weights /= np.sqrt(np.square(weights).sum())
    blurred = np.zeros_like(noise)
    for offset, weight in zip(offsets, weights, strict=True):
        blurred += weight * np.roll(noise, offset, axis)
    return blurred


def _window(u: float, v: float) -> tuple[slice, slice]:
    """Return the rows and columns of the pixels that the target may cover, one more on each side."""
    rows, columns = (
        slice(*(int(min(max(np.floor(edge), 0), length)) for edge in (middle - reach - 1.0, middle + reach + 3.0)))
        for middle, reach, length in ((v, HALF_AXES_PX[1], SIZE[1]), (u, HALF_AXES_PX[0], SIZE[0]))
    )
    return rows, columns


def _ellipse(u: float, v: float, rows: slice, columns: slice) -> tuple[Floats, Floats]:
    """Return how far pixels are covered by the target, 0..1, and how far below its middle they are, px."""
    across, down = np.arange(SIZE[0])[columns] - u, np.arange(SIZE[1])[rows, None] - v
    radius = np.sqrt(np.square(across / HALF_AXES_PX[0]) + np.square(down / HALF_AXES_PX[1]))
    covered = np.clip(0.5 + (1.0 - radius) * min(HALF_AXES_PX) / EDGE_PX, 0.0, 1.0)
    return covered, np.broadcast_to(down, covered.shape)


def _paint(image: Floats, u: float, v: float, red_share: float) -> None:
    """Paint an ellipse whose upper part is red and whose lower part is yellow, in place."""
    rows, columns = _window(u, v)
    covered, below = _ellipse(u, v, rows, columns)
    split = (2.0 * red_share - 1.0) * HALF_AXES_PX[1]
    yellow = np.clip(0.5 + (below - split) / SPLIT_PX, 0.0, 1.0)[:, :, None]
    colour = RED_RGB + yellow * (YELLOW_RGB - RED_RGB)
    place = image[rows, columns]
    place += covered[:, :, None] * (colour - place)
