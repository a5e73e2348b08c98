"""What the pictures themselves say, or the numbers that are measured: whether they changed, however it is tracked.

A picture is told in a few numbers, its *sight*, and the ones just before a loss are compared with one another. What
happens to all of a picture at once (noise, light, blur, nothing on it, the same one again) did not come from the target
or from the filter, so it is seen without the truth. Of numbers that are measured, the second differences tell noise.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple
from zlib import crc32

import cv2
import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.source import Frame

LAPLACIANS = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]], dtype=np.float32)
"""Difference of two Laplacians, which an edge does not answer (Immerkaer 1996)."""
OF_NOISE = 0.6745 * 6.0
"""Median of its amount in white noise of unit deviation."""


RARE = 0.0005
"""Share of the pixels that may have more of a colour than is said of a picture: a target may be small."""
MOST_PIXELS = 300_000
"""Pixels that are all looked at; in larger pictures every other one is, or fewer."""


class Sight(NamedTuple):
    """A frame in a few numbers; NaN for what it does not have.

    Attributes:
        noise: Deviation of its white noise, grey levels.
        light: Mean grey level.
        contrast: Deviation of the grey levels.
        edge: Largest step from a pixel to the next, but for a few, grey levels.
        colours: (3,) by how much red, green and blue are more than the others where they are most, grey levels.
        target: (3,) mean colour in the box of the true target.
        known: Share of the measured numbers that are known; 1 for a picture.
        digest: The same for the same frames, and hardly ever for others.
        numbers: (n,) that were measured.
    """

    noise: float
    light: float
    contrast: float
    edge: float
    colours: Floats
    target: Floats
    known: float
    digest: int
    numbers: Floats


UNKNOWN = np.full(3, np.nan)


def look_at(frame: Frame) -> Sight:
    """Return the sight of a frame: of its measured numbers where there are any, else of its picture."""
    measured = frame.signal if frame.measurements is None else frame.measurements.points_px
    if measured is not None:
        numbers = np.asarray(measured, dtype=np.float64).ravel()
        share = float(np.isfinite(numbers).mean()) if len(numbers) else np.nan
        return Sight(*(np.nan,) * 4, UNKNOWN, UNKNOWN, share, crc32(numbers.tobytes()), numbers)
    if frame.image_rgb is None:
        return Sight(*(np.nan,) * 4, UNKNOWN, UNKNOWN, np.nan, frame.index, np.empty(0))
    picture = frame.image_rgb
    step = math.ceil(math.sqrt(picture[..., 0].size / MOST_PIXELS))
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    noise = float(np.median(np.abs(cv2.filter2D(grey, -1, LAPLACIANS))[::step, ::step])) / OF_NOISE
    edge = float(np.quantile(np.abs(np.diff(grey, axis=1))[::step, ::step], 1.0 - RARE / 5.0))
    sample = picture[::step, ::step].reshape(-1, 3).astype(np.float32)
    more = np.quantile(1.5 * (sample - sample.mean(axis=1, keepdims=True)), 1.0 - RARE, axis=0)
    same = crc32(picture.tobytes())
    shades = float(grey.mean()), float(grey.std())
    return Sight(noise, *shades, edge, more, _target(frame), 1.0, same, np.empty(0))


def _target(frame: Frame) -> Floats:
    """Return the mean colour in the box of the true target, as far as it lies in the picture."""
    target = frame.target
    if target is None or target.extent is None or len(target.position) != len(target.extent):
        return UNKNOWN
    (u, v), (width, height) = target.position, (max(side / 2, 1.0) for side in target.extent)
    columns, rows = (slice(max(round(at - by), 0), max(round(at + by), 0)) for at, by in ((u, width), (v, height)))
    box = frame.picture[rows, columns].reshape(-1, 3)
    return box.mean(axis=0) if len(box) else UNKNOWN


@dataclass
class Sights:
    """Sights of the frames of a run, each looked at when it is first asked for.

    Attributes:
        frame: The frame of a number; None where nothing can be looked at again.
    """

    frame: Callable[[int], Frame] | None = None
    _seen: dict[int, Sight] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether frames can be looked at."""
        return self.frame is not None or bool(self._seen)

    def __getitem__(self, index: int) -> Sight:
        """Return the sight of a frame."""
        if index not in self._seen and self.frame is not None:
            self._seen[index] = look_at(self.frame(index))
        return self._seen[index]
