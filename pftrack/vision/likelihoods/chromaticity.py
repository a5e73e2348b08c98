"""Chromaticity: the colour of a pixel, independent of its brightness.

Bando 2007 weighs a particle by the redness R / (R + G + B) of the one pixel under it (ch. 3, eqs. 3.8 and 3.9):

    p(z | x) ~ rho + exp(-(r - mean)^2 / (2 spread^2))

where rho, relative to the kernel's peak, is the value of any background pixel. It keeps hidden targets possible, and it
limits how far look-alikes and occluders are penalised. Redness is the first of the two coordinates of chromaticity, (R,
G) / (R + G + B); with both, any colour can be followed. Spreads are standard deviations (Bando says variance, an
erratum).

The pixel of a real position (u, v) is (floor(u + 0.5), floor(v + 0.5)). Outside the picture, and on black pixels that
have no colour, the kernel is zero.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, check, check_picture
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import exponential, exponentials, logarithms

SMALLEST_SPREAD = 0.01
"""Eight-bit pictures resolve chromaticity to about 1/255; a narrower kernel would follow rounding."""


@dataclass(frozen=True, slots=True)
class ColourModel:
    """Colour of a target.

    Attributes:
        mean: (2,) mean of (R, G) / (R + G + B).
        spread: (2,) standard deviations; inf leaves a coordinate out.
    """

    mean: tuple[float, float]
    spread: tuple[float, float]

    @property
    def precision(self) -> tuple[float, float]:
        """(2,) factors 1 / (2 spread^2) of the exponent."""
        return 0.5 / self.spread[0] ** 2, 0.5 / self.spread[1] ** 2


def log_likelihood(image_rgb: NDArray[np.uint8], states: Floats, model: ColourModel, background_level: float) -> Floats:
    """Return the log likelihood (N,) of states whose first two coordinates are (u, v) in px.

    Args:
        image_rgb: (height, width, 3).
        states: (N, d) with d >= 2; positions that are not finite count as outside the picture.
        model: Colour of the target.
        background_level: rho, relative to the kernel's peak; at 0 a particle off the target has the likelihood 0.

    Raises:
        TypeError: The picture is not an array of bytes, or the states are not one of real numbers.
        ValueError: The picture is not (height, width, 3), or the states are not (N, d) with d >= 2.
    """
    check_picture(image_rgb)
    if check(missing=True, states=(states, "N d"))["d"] < 2:
        raise ValueError(f"states must be (N, d) with d at least 2, got {states.shape}")
    return log_kernel(
        read_only(image_rgb), np.asfortranarray(states), model.mean, model.precision, float(background_level)
    )


def likelihood_map(image_rgb: NDArray[np.uint8], model: ColourModel, background_level: float) -> Floats:
    """Return the likelihood of every pixel, (height, width), relative to that of the target's own colour.

    Args:
        image_rgb: (height, width, 3).
        model: Colour of the target.
        background_level: rho, relative to the kernel's peak.

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It is not (height, width, 3).
    """
    check_picture(image_rgb)
    colours = image_rgb.astype(np.float64)
    total = colours.sum(axis=2)
    seen = total > 0.0
    shares = colours[:, :, :2] / np.where(seen, total, 1.0)[:, :, None]
    exponents = ((shares - model.mean) ** 2 * model.precision).sum(axis=2)
    kernel = np.where(seen, exponential(-exponents), 0.0)
    return np.asarray((background_level + kernel) / (background_level + 1.0))


def centroid(image_rgb: NDArray[np.uint8], model: ColourModel) -> Floats | None:
    """Return the kernel-weighted mean position (2,) of all pixels, px, or None if no pixel has the target's colour.

    This is the crude measurement of the unscented filter (Bando 2007, ch. 3 section 4). Bando weighs by redness
    itself, which a grey background dominates; the kernel without the background level is used here.

    Args:
        image_rgb: (height, width, 3).
        model: Colour of the target.

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It is not (height, width, 3).
    """
    check_picture(image_rgb)
    weight, u, v = _centroid(read_only(image_rgb), *model.mean, *model.precision)
    return np.array([u / weight, v / weight]) if weight > 0.5 else None


def fit(image_rgb: NDArray[np.uint8], box: tuple[float, float, float, float]) -> ColourModel:
    """Fit mean and spread to the target in a box that a person drew.

    The pixels of the ellipse inscribed in the box are used, since corners show background. Median and median absolute
    deviation keep a finger or a highlight from spoiling them.

    Args:
        image_rgb: (height, width, 3).
        box: x, y of the left top corner, width and height, px.

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It is not (height, width, 3), or the box holds no pixel of it, or only black ones.
    """
    pixels = _pixels(image_rgb, box)
    total = pixels.sum(axis=1)
    if not (total > 0).any():
        raise ValueError("the box must cover at least one pixel of the picture that is not black")
    colours = pixels[total > 0, :2] / total[total > 0, None]
    mean = np.median(colours, axis=0)
    spread = np.maximum(1.4826 * np.median(np.abs(colours - mean), axis=0), SMALLEST_SPREAD)
    return ColourModel((float(mean[0]), float(mean[1])), (float(spread[0]), float(spread[1])))


def median_colour(image_rgb: NDArray[np.uint8], box: tuple[float, float, float, float]) -> str:
    """Return the median colour of the target in a box as #rrggbb; arguments as for `fit`."""
    red, green, blue = np.median(_pixels(image_rgb, box), axis=0).astype(int)
    return f"#{red:02x}{green:02x}{blue:02x}"


def _pixels(image_rgb: NDArray[np.uint8], box: tuple[float, float, float, float]) -> Floats:
    """Return the pixels (n, 3) within the ellipse inscribed in the box."""
    check_picture(image_rgb)
    height, width = image_rgb.shape[:2]
    x, y, w, h = box
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    inside = ((columns + 0.5 - x - w / 2) / (w / 2)) ** 2 + ((rows + 0.5 - y - h / 2) / (h / 2)) ** 2 <= 1.0
    return image_rgb[inside].astype(np.float64)


@compiled
def log_kernel(
    image_rgb: NDArray[np.uint8],
    states: Floats,
    mean: tuple[float, float],
    precision: tuple[float, float],
    background_level: float,
) -> Floats:
    """Return the log likelihood (N,) inside a compiled loop; arguments as for `log_likelihood`."""
    height, width, channels = image_rgb.shape
    if channels != 3 or states.shape[1] < 2:
        raise ValueError("expected a picture (height, width, 3) and states (N, d) with d >= 2, got other sizes")
    count = states.shape[0]
    columns, rows = np.empty(count), np.empty(count)
    red, green, total = np.zeros(count), np.zeros(count), np.zeros(count)
    # There are three loops; only the one that looks up pixels cannot be vectorised.
    for n in range(count):
        columns[n] = np.floor(states[n, 0] + 0.5)
        rows[n] = np.floor(states[n, 1] + 0.5)
    for n in range(count):
        if 0 <= columns[n] < width and 0 <= rows[n] < height:
            column, row = np.uint64(columns[n]), np.uint64(rows[n])
            red[n], green[n] = image_rgb[row, column, 0], image_rgb[row, column, 1]
            total[n] = red[n] + green[n] + image_rgb[row, column, 2]
    exponents = np.empty(count)
    for n in range(count):
        off_red, off_green = red[n] / total[n] - mean[0], green[n] / total[n] - mean[1]
        exponent = -(precision[0] * off_red * off_red + precision[1] * off_green * off_green)
        exponents[n] = exponent if total[n] > 0.0 else -np.inf
    if background_level == 0.0:
        return exponents
    return logarithms(background_level + exponentials(exponents))


@compiled
def _centroid(
    image_rgb: NDArray[np.uint8], red: float, green: float, red_precision: float, green_precision: float
) -> tuple[float, float, float]:
    height, width, _ = image_rgb.shape
    weight, u, v = 0.0, 0.0, 0.0
    for row in range(height):
        for column in range(width):
            r = float(image_rgb[row, column, 0])
            g = float(image_rgb[row, column, 1])
            total = r + g + float(image_rgb[row, column, 2])
            if total > 0.0:
                exponent = red_precision * (r / total - red) ** 2 + green_precision * (g / total - green) ** 2
                # exp(-30) times a megapixel is still less than a ten-millionth of one pixel.
                if exponent < 30.0:
                    kernel = np.exp(-exponent)
                    weight += kernel
                    u += kernel * column
                    v += kernel * row
    return weight, u, v
