"""The overlay: an occluder and look-alikes that any source can wear.

The occluder is a vertical strip in front of everything; the distracters are discs in the target's colour at three of
six slots around the middle of the picture, twenty layouts in all (Bando 2007, ch. 3 section 3).
On a simulated scene they are the experiment; on a recording they make an easy clip hard, live.
"""

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.compiled import compiled

__all__ = [
    "LAYOUTS",
    "OccluderParameters",
    "OverlayParameters",
    "distracter_radius",
    "occlusion_width",
    "paint",
    "paint_disc",
    "paint_strip",
    "rgb",
    "strip",
]

LAYOUTS = tuple(combinations(range(6), 3))
"""Which three of the six slots hold a distracter, by layout number; slots run row by row from the left top."""

GROUP = "Occluder and look-alikes"


def occlusion_width(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the occluder's width, px."""
    return parameter(
        default,
        "Occluder width",
        "Width of the vertical strip that hides whatever passes behind it.",
        unit="px",
        ge=0,
        le=640,
        step=1,
        group=GROUP,
        role="world",
    )


def distracter_radius(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the distracters' radius, px."""
    return parameter(
        default,
        "Look-alike radius",
        "Radius of the three discs in the target's colour; 0 shows none.",
        unit="px",
        ge=0,
        le=100,
        step=1,
        group=GROUP,
        role="world",
    )


class OccluderParameters(Parameters):
    """A strip in front of everything; none by default."""

    occlusion_width_px: float = occlusion_width(0)
    occlusion_offset_px: float = parameter(
        0,
        "Occluder place",
        "Where the middle of the strip is, to the right of the middle of the picture.",
        unit="px",
        ge=-960,
        le=960,
        step=1,
        group=GROUP,
    )
    occluder_colour: str = parameter("#3c3c3c", "Occluder colour", "Colour of the strip.", colour=True, group=GROUP)


class OverlayParameters(OccluderParameters):
    """What is laid over the picture; nothing by default."""

    distracter_radius_px: float = distracter_radius(0)
    layout: int = parameter(
        7,
        "Look-alike layout",
        "Which three of the six slots around the middle hold a look-alike.",
        ge=0,
        le=len(LAYOUTS) - 1,
        step=1,
        group=GROUP,
    )
    slot_spacing_px: float = parameter(
        60,
        "Slot spacing",
        "Distance between neighbouring columns of slots.",
        unit="px",
        ge=0,
        le=640,
        step=1,
        group=GROUP,
    )
    slot_offset_px: float = parameter(
        50,
        "Slot offset",
        "Distance of the two rows of slots from the middle of the picture.",
        unit="px",
        ge=0,
        le=540,
        step=1,
        group=GROUP,
    )


def strip(parameters: OccluderParameters, width: int) -> tuple[float, float]:
    """Return the left and right edge of the occluder, px: it covers the columns left <= u < right.

    Args:
        parameters: The occluder.
        width: Of the picture, px.
    """
    middle = width / 2 + parameters.occlusion_offset_px
    half = parameters.occlusion_width_px / 2
    return middle - half, middle + half


def paint(image_rgb: NDArray[np.uint8], parameters: OverlayParameters, target_colour: str) -> None:
    """Paint the overlay into a picture.

    Args:
        image_rgb: (height, width, 3), changed in place.
        parameters: The overlay.
        target_colour: Colour of the distracters, #rrggbb.
    """
    height, width, _ = image_rgb.shape
    if parameters.distracter_radius_px > 0:
        for slot in LAYOUTS[parameters.layout]:
            row, column = divmod(slot, 3)
            u = width / 2 + (column - 1) * parameters.slot_spacing_px
            v = height / 2 + (2 * row - 1) * parameters.slot_offset_px
            paint_disc(image_rgb, u, v, float(parameters.distracter_radius_px), rgb(target_colour))
    paint_strip(image_rgb, parameters)


def paint_strip(image_rgb: NDArray[np.uint8], parameters: OccluderParameters) -> None:
    """Paint the occluder into a picture (height, width, 3), in place."""
    width = image_rgb.shape[1]
    left, right = strip(parameters, width)
    first, last = (min(max(int(np.ceil(edge)), 0), width) for edge in (left, right))
    _paint_columns(image_rgb, first, last, rgb(parameters.occluder_colour))


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0..255, of #rrggbb."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


@compiled
def paint_disc(image_rgb: NDArray[np.uint8], u: float, v: float, radius: float, colour: tuple[int, int, int]) -> None:
    """Fill the pixels whose centres are within `radius` px of (u, v), in place."""
    height, width, _ = image_rgb.shape
    for row in range(max(int(np.ceil(v - radius)), 0), min(int(np.floor(v + radius)), height - 1) + 1):
        for column in range(max(int(np.ceil(u - radius)), 0), min(int(np.floor(u + radius)), width - 1) + 1):
            if (column - u) ** 2 + (row - v) ** 2 <= radius * radius:
                for channel in range(3):
                    image_rgb[row, column, channel] = colour[channel]


@compiled
def _paint_columns(image_rgb: NDArray[np.uint8], first: int, last: int, colour: tuple[int, int, int]) -> None:
    """Fill the columns first..last - 1, in place."""
    for row in range(image_rgb.shape[0]):
        for column in range(first, last):
            for channel in range(3):
                image_rgb[row, column, channel] = colour[channel]
