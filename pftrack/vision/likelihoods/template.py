"""Templates: a feature is where the picture looks as it did around the feature in the first frame.

A patch s of the picture is compared with a template r by the normalised correlation of both less their means,

    NCC = sum (r - mean r)(s - mean s) / sqrt(sum (r - mean r)^2 sum (s - mean s)^2),

which ignores changes of gain and offset. A particle is weighed by (Bando 2007, ch. 4, eq. 4.11)

    p(z | x) ~ exp(-(NCC - 1)^2 / (2 D^2)),  D = 0.15.

The patch lies around the particle's pixel (floor(x + 0.5), floor(y + 0.5)) and begins half its width and height,
rounded down, to the left and above. Where it reaches beyond the picture, or has no contrast, NCC is -1, its least
value.

Eleven features with fifty particles each take 0.18 ms by the sums themselves, in one pass over each patch; with
integral pictures for the patch's mean and variance 0.21 to 0.24 ms; by `cv2.matchTemplate` on the part of the picture
that the particles cover 0.65 to 0.85 ms, since it also computes what lies between the particles (640 x 480, one core).
The picture's luma takes 0.04 ms.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.arrays import Floats, Ints, check, check_picture
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import inner_product

SPREAD = 0.15
"""D of eq. 4.11: a correlation of 0.5 weighs 0.004."""

SMALLEST_PX, LARGEST_PX = 6, 128
LEAST_VARIANCE = 0.5
"""In squared grey levels, per pixel; a patch with less is flat up to rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Templates:
    """One template a feature.

    Attributes:
        pixels: (sum of w h,) float32: the patches one after another, row by row, each less its mean and of unit norm;
            all zero for a patch without contrast.
        sizes: (F, 2) widths and heights, px.
    """

    pixels: NDArray[np.float32]
    sizes: Ints

    def __post_init__(self) -> None:
        """Refuse patches that are not of these sizes.

        Raises:
            TypeError: An argument is not an array of numbers, or the sizes are not whole.
            ValueError: The sizes are not (F, 2) and above 0, or the patches have another number of pixels.
        """
        _check_sizes(self.sizes)
        check(pixels=(self.pixels, str(self.sizes.prod(axis=1).sum())))


def _check_sizes(sizes: Ints) -> None:
    check(sizes=(sizes, "F 2", "whole"))
    if sizes.min() < 1:
        raise ValueError(f"sizes must be at least 1 px, got {sizes.min()}")


def luma(image_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the brightness (height, width) of a picture, 0.299 R + 0.587 G + 0.114 B; a grey one is returned as it is.

    Args:
        image_rgb: (height, width, 3), (height, width, 1) or (height, width).

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It has other sides.
    """
    check_picture(image_rgb, "height width channels" if np.ndim(image_rgb) == 3 else "height width")
    if image_rgb.ndim == 2:
        return np.ascontiguousarray(image_rgb)
    if image_rgb.shape[2] == 1:
        return np.ascontiguousarray(image_rgb[:, :, 0])
    if image_rgb.shape[2] == 3:
        return np.asarray(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2GRAY), np.uint8)
    raise ValueError(f"expected a picture (height, width, 3) or (height, width), got shape {image_rgb.shape}")


def scaled_sizes(sizes_px: ArrayLike, scale: float) -> Ints:
    """Return widths and heights (F, 2) of templates, px, as even numbers within the bounds of a template.

    Args:
        sizes_px: (F, 2) for a target of the usual size.
        scale: Size of the target relative to its first size.

    Raises:
        ValueError: The sizes are not (F, 2), or one is not finite.
    """
    wanted = scale * np.asarray(sizes_px, dtype=np.float64)
    check(sizes=(wanted, "F 2"))
    sizes: Ints = np.clip(2 * np.rint(wanted / 2.0), SMALLEST_PX, LARGEST_PX).astype(np.int64)
    return sizes


def cut(grey: NDArray[np.uint8], points: Floats, sizes: Ints) -> Templates:
    """Cut templates around points; what is beyond the picture is filled with the nearest pixels in it.

    Args:
        grey: (height, width).
        points: (F, 2) px, within the picture.
        sizes: (F, 2) widths and heights, px.

    Raises:
        TypeError: The picture is not an array of bytes, or the others are not ones of numbers.
        ValueError: A point is not within the picture, or there are not as many points as sizes.
    """
    check_picture(grey, "height width")
    _check_sizes(sizes)
    check(missing=True, sizes=(sizes, "F 2"), points=(points, "F 2"))
    height, width = grey.shape
    pixels = []
    for (x, y), (w, h) in zip(points, sizes, strict=True):
        if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
            raise ValueError(f"a feature must lie within the picture of {width} x {height} px, got ({x:g}, {y:g})")
        columns = np.clip(int(np.floor(x + 0.5)) - w // 2 + np.arange(w), 0, width - 1)
        rows = np.clip(int(np.floor(y + 0.5)) - h // 2 + np.arange(h), 0, height - 1)
        pixels.append(_normalise(grey[np.ix_(rows, columns)].astype(np.float64)))
    return Templates(np.concatenate(pixels), sizes.copy())


def correlations(grey: NDArray[np.uint8], positions: Floats, templates: Templates) -> Floats:
    """Return the NCC (F, N), -1..1, of every feature's template at its particles.

    Args:
        grey: (height, width).
        positions: (F, N, 2) px; positions that are not finite count as outside the picture.
        templates: One a feature.

    Raises:
        TypeError: The picture is not an array of bytes, or the positions are not one of real numbers.
        ValueError: The picture is not (height, width), or there are not as many features as templates.
    """
    check_picture(grey, "height width")
    check(missing=True, templates=(templates.sizes, "F 2"), positions=(positions, "F N 2"))
    return ncc(grey, np.ascontiguousarray(positions), templates.pixels, templates.sizes)


def log_likelihood(grey: NDArray[np.uint8], positions: Floats, templates: Templates, spread: float = SPREAD) -> Floats:
    """Return the log likelihood (F, N) of positions, finite throughout; arguments as for `correlations`."""
    return score(correlations(grey, positions, templates), spread)


def score(correlation: Floats, spread: float = SPREAD) -> Floats:
    """Return the log likelihood of correlations (eq. 4.11), of the same shape."""
    scores: Floats = -0.5 * ((correlation - 1.0) / spread) ** 2
    return scores


def likeness(one: Templates, other: Templates) -> Floats:
    """Return the NCC (F,) of each template with that of another set of the same sizes.

    Raises:
        ValueError: The sizes differ.
    """
    if not np.array_equal(one.sizes, other.sizes):
        raise ValueError("expected templates of the same sizes, got different ones")
    ends = np.cumsum(one.sizes.prod(axis=1))[:-1]
    products = one.pixels.astype(np.float64) * other.pixels
    return np.array([float(part.sum()) for part in np.split(products, ends)])


def renew(templates: Templates, grey: NDArray[np.uint8], points: Floats, rate: float) -> Templates:
    """Return templates moved a little towards the picture at the points.

    Slow renewal follows the light and the turning of the head. It also follows every error of the estimate: what has
    slipped off a feature learns what it slipped on to, and drifts. That is why Bando never renews, and why it is
    off unless asked for: on four simulated drivers a rate of 0.01 a frame changed the mean pose error of PF-ASD from
    1.3, 4.7, 3.2 and 9.1 to 1.5, 17, 3.4 and 8.6 degrees.

    Args:
        templates: The current templates.
        grey: (height, width).
        points: (F, 2) px; a feature whose point is not within the picture keeps its template.
        rate: 0 keeps the old templates, 1 replaces them.

    Raises:
        TypeError: The picture is not an array of bytes, or the points are not one of numbers.
        ValueError: There are not as many points as templates.
    """
    check_picture(grey, "height width")
    check(missing=True, templates=(templates.sizes, "F 2"), points=(points, "F 2"))
    height, width = grey.shape
    # Comparisons with NaN are false, so what is not finite is not inside.
    inside = np.asarray(np.logical_and(points >= -0.5, points < np.array([width, height]) - 0.5).all(axis=1))
    fresh = cut(grey, np.where(inside[:, None], points, 0.0), templates.sizes)
    blended = [
        _normalise((1.0 - rate) * old + rate * new) if known and new.any() else old
        for old, new, known in zip(_patches(templates), _patches(fresh), inside, strict=True)
    ]
    return Templates(np.concatenate(blended), templates.sizes)


def _patches(templates: Templates) -> list[NDArray[np.float32]]:
    ends = np.cumsum(templates.sizes[:, 0] * templates.sizes[:, 1])
    return np.split(templates.pixels, ends[:-1])


def _normalise(patch: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return a patch as (w h,) less its mean and of unit norm, or zeros if it has no contrast."""
    off = patch.ravel() - patch.mean(dtype=np.float64)
    norm = float(np.sqrt(np.square(off).sum()))
    # A patch of grey levels is flat below this variance; one of unit norm is never.
    flat = norm < 1e-6 or (norm > 2.0 and norm**2 < LEAST_VARIANCE * off.size)
    return np.zeros(off.size, np.float32) if flat else (off / norm).astype(np.float32)


@compiled
def ncc(grey: NDArray[np.uint8], positions: Floats, pixels: NDArray[np.float32], sizes: Ints) -> Floats:
    """Return the NCC (F, N) inside a compiled loop; arguments as for `correlations`, the templates as their arrays."""
    features, count, axes = positions.shape
    height, width = grey.shape
    if axes != 2 or sizes.shape != (features, 2) or pixels.shape[0] != (sizes[:, 0] * sizes[:, 1]).sum():
        raise ValueError("expected a template of each feature for positions (F, N, 2), got other sizes")
    results = np.full((features, count), -1.0)
    begin = 0
    for f in range(features):
        w, h = sizes[f, 0], sizes[f, 1]
        area = w * h
        template = pixels[begin : begin + area]
        begin += area
        if inner_product(template, template) == 0.0:
            continue
        levels = np.empty(area, np.float32)
        for i in range(count):
            x, y = np.floor(positions[f, i, 0] + 0.5), np.floor(positions[f, i, 1] + 0.5)
            if not (x >= w // 2 and y >= h // 2 and x + w - w // 2 <= width and y + h - h // 2 <= height):
                continue
            left, top = int(x) - w // 2, int(y) - h // 2
            total, squares = np.int32(0), np.int32(0)
            for row in range(h):
                patch = grey[top + row, left : left + w]
                line = levels[row * w : row * w + w]
                for column in range(w):
                    level = np.int32(patch[column])
                    total = np.int32(total + level)
                    squares = np.int32(squares + np.int32(level * level))
                    line[column] = np.float32(level)
            power = squares - total * (total / area)
            if power > LEAST_VARIANCE * area:
                # The template's mean is zero, so the patch's mean need not be subtracted.
                results[f, i] = min(max(inner_product(levels, template) / np.sqrt(power), -1.0), 1.0)
    return results
