"""Recordings of faces for tests: sequences in memory, drawn by the simulated head."""

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, FrameIndex, FrameSequence, History
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.vision.face import FEATURES
from tests.making import encoded

Picture = NDArray[np.uint8]


class Pictures(FrameSequence):
    """Given pictures."""

    def __init__(self, pictures: Sequence[Picture], name: str = "face.mp4", frame_rate_hz: float = 30.0) -> None:
        self._pictures, self.name = pictures, name
        height, width = pictures[0].shape[:2]
        times, sums = tuple((np.arange(len(pictures)) / frame_rate_hz).tolist()), (0,) * len(pictures)
        self.index = FrameIndex("video", "0" * 64, width, height, frame_rate_hz, times, sums)

    def _picture(self, index: int) -> Picture:
        return self._pictures[index]


@cache
def simulated(count: int, *, width: int = 320, every: int = 1, **values: Value) -> tuple[Frame, ...]:
    """Return frames of the simulated driver, one out of so many of the script."""
    scene = revise(HeadSceneParameters(), {"image_width_px": width, **values})
    source = HeadSource(5, scene)
    history = History(((0, scene),))
    return tuple(source.frame(every * index, history) for index in range(count))


def pictures(count: int, change: Callable[[Picture], Picture] = np.asarray, **options: int) -> list[Picture]:
    """Return pictures of the simulated driver, changed one by one."""
    shown = [frame.image_rgb for frame in simulated(count, **options)]
    return [np.ascontiguousarray(change(picture)) for picture in shown if picture is not None]


def empty(picture: Picture) -> Picture:
    """Return a picture of the same size with nobody in it."""
    rng = np.random.default_rng(3)
    return (60 + 4 * rng.standard_normal(picture.shape)).clip(0, 255).astype(np.uint8)


def film(shown: Sequence[Picture], frame_rate_hz: int = 30) -> bytes:
    """Return pictures as a video of so high a quality that features keep their places."""
    return encoded(shown, frame_rate_hz, crf="10", preset="ultrafast")


def marked(index: int = 0, *, width: int = 320) -> dict[str, tuple[float, float]]:
    """Return where the features of the simulated driver truly are in a frame, px."""
    target = simulated(index + 1, width=width)[index].target
    return {name: (float(x), float(y)) for name, (x, y) in zip(FEATURES, target.landmarks.points_px, strict=True)}
