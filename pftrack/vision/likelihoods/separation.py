"""Separation: does a likelihood tell a target from what is around it?

A tracker holds a target as long as its likelihood is higher there than beside it. Collins, Liu and Leordeanu ("Online
selection of discriminative tracking features", 2005) rank features by how well they separate the pixels of the target
from those of a ring around it, on the ground that those which discriminate best track best. Here the tracker's own
likelihood is looked at, as it is weighed by, background level included:

    contrast = 1 - (mean around the target) / (mean on the target),   0 if that is negative.

On the target is the ellipse inscribed in its box. Around it is what lies between the ellipse through the corners of the
box and one three times as large as the inscribed, so that neither the target's own corners nor far parts of the picture
count. A contrast of 0 says that particles beside the target weigh as much as those on it: nothing keeps them there.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Box", "Separation", "contrast", "separation", "surroundings"]

Box = tuple[float, float, float, float]
"""x, y of the left top corner, width and height, px."""

INNER, OUTER = 2**0.5, 3.0
"""Of the ring, in sizes of the ellipse inscribed in the box."""

ALIKE = 0.5
"""What has at least this share of the target's mean likelihood looks like it."""


@dataclass(frozen=True, slots=True)
class Separation:
    """How likely the target is and what is around it, relative to the likelihood's peak.

    Attributes:
        on: Mean on the target in the first picture.
        around: Mean around it: that of the first picture, or over all pictures if that is higher.
        alike: Share of the rest of the first picture, 0..1, that looks like the target.
    """

    on: float
    around: float
    alike: float

    @property
    def contrast(self) -> float:
        """How much less likely the surroundings are, 0..1."""
        return contrast(self.on, self.around)


def contrast(on: float, around: float) -> float:
    """Return how much less likely the surroundings are than the target, 0..1."""
    return max(0.0, 1.0 - around / on) if on > 0.0 else 0.0


def separation(first: NDArray[np.float64], later: Iterable[NDArray[np.float64]], box: Box) -> Separation:
    """Compare a target with its surroundings.

    The surroundings are also looked at in later pictures, at the same place: what comes by there, or changes with the
    light, is met by the tracker too. Where the target is by then is not known, so only the first picture says what is
    on it.

    Args:
        first: (height, width) likelihood of each pixel of the first picture, 0..1.
        later: The same of later pictures.
        box: Around the target in the first picture.
    """
    target, ring = _within(first.shape, box, 1.0), _ring(first.shape, box)
    on = float(first[target].mean()) if target.any() else 0.0
    rest = ~_within(first.shape, box, OUTER)
    alike = float((first[rest] >= ALIKE * on).mean()) if rest.any() and on > 0.0 else 0.0
    if not ring.any():
        return Separation(on, 0.0, alike)
    around = [float(picture[ring].mean()) for picture in (first, *later)]
    return Separation(on, max(around[0], float(np.mean(around))), alike)


def surroundings(shape: tuple[int, ...], box: Box) -> tuple[slice, slice]:
    """Return the rows and columns of a picture that `separation` looks at around a target."""
    height, width = shape[:2]
    x, y, w, h = box
    spans = ((y + h / 2, OUTER * h / 2, height), (x + w / 2, OUTER * w / 2, width))
    rows, columns = (
        slice(max(int(middle - half) - 1, 0), min(int(middle + half) + 2, side)) for middle, half, side in spans
    )
    return rows, columns


def _within(shape: tuple[int, ...], box: Box, scale: float) -> NDArray[np.bool_]:
    """Return which pixels lie in the ellipse inscribed in the box, enlarged; the middle of a pixel counts."""
    x, y, w, h = box
    across = (np.arange(shape[1]) + 0.5 - x - w / 2) / (scale * w / 2)
    down = (np.arange(shape[0]) + 0.5 - y - h / 2) / (scale * h / 2)
    return np.asarray(across[None, :] ** 2 + down[:, None] ** 2 <= 1.0)


def _ring(shape: tuple[int, ...], box: Box) -> NDArray[np.bool_]:
    """Return which pixels are around the target; of a box that nearly fills the picture, all that are not on it."""
    outer = _within(shape, box, OUTER)
    ring = outer & ~_within(shape, box, INNER)
    return ring if ring.any() else outer & ~_within(shape, box, 1.0)
