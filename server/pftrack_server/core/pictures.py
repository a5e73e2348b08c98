"""Pictures as they leave a worker: JPEG files, each encoded once, for the scene and for flat views alike.

Encoding in the worker costs 0.1 to 1 ms; carrying the raw picture to the web process costs as much, and there it would
have to be encoded at the expense of all other sessions.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Drawing, Picture

JPEG = (cv2.IMWRITE_JPEG_QUALITY, 88)
"""Sharp enough that a ball of ten pixels keeps its edge on a plane that is seen from aside."""
FINE_JPEG = (
    cv2.IMWRITE_JPEG_QUALITY,
    92,
    # A thin line of one colour on another would bleed over two pixels at half the resolution.
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
)
"""What is painted pixel by pixel; it takes more than twice the time."""
NO_PIXELS: NDArray[np.uint8] = np.zeros((0, 0, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class EncodedPicture:
    """A picture of a drawing as a JPEG file.

    Attributes:
        key: Tells it from the other pictures of the same worker.
        width: Extent along x, px.
        height: Extent along y, px.
        file: The file's content.
    """

    key: int
    width: int
    height: int
    file: bytes


@dataclass(frozen=True, slots=True)
class SceneDrawing:
    """A drawing as it travels to the scene.

    Attributes:
        drawing: What is to be seen; its pictures have their place in the painting order, but no pixels.
        pictures: The pictures, by the names of their primitives.
    """

    drawing: Drawing
    pictures: Mapping[str, EncodedPicture]


class _Known(NamedTuple):
    image_rgb: NDArray[np.uint8]
    is_fine: bool
    encoded: EncodedPicture


class PictureEncoder:
    """Encodes the pictures of one run's drawings; one that stays as it was is encoded once."""

    def __init__(self) -> None:
        self._next_key = 0
        self._known: dict[str, _Known] = {}

    def encode(self, drawing: Drawing, *, fine: bool) -> dict[str, EncodedPicture]:
        """Return the pictures of a drawing by the names of their primitives.

        Args:
            drawing: What is to be seen.
            fine: Whether colours are wanted at full resolution; a picture that is known so is returned in any case.
        """
        self._known = {name: self._encode(name, item.image_rgb, fine=fine) for name, item in _pictures(drawing)}
        return {name: known.encoded for name, known in self._known.items()}

    def for_scene(self, drawing: Drawing) -> SceneDrawing:
        """Return a drawing as it travels to the scene."""
        pictures = self.encode(drawing, fine=False)
        bare = {name: replace(item, image_rgb=NO_PIXELS) for name, item in _pictures(drawing)}
        return SceneDrawing(replace(drawing, primitives={**drawing.primitives, **bare}), pictures)

    def _encode(self, name: str, image_rgb: NDArray[np.uint8], *, fine: bool) -> _Known:
        known = self._known.get(name)
        if known is not None and known.is_fine >= fine and _same(known.image_rgb, image_rgb):
            return known
        form = FINE_JPEG if fine else JPEG
        done, encoded = cv2.imencode(".jpg", cv2.cvtColor(image_rgb, cv2.COLOR_RGB2BGR), form)
        if not done:
            raise ValueError(f"a picture of shape {image_rgb.shape} cannot be encoded as JPEG")
        height, width = image_rgb.shape[:2]
        picture = EncodedPicture(self._next_key, width, height, encoded.tobytes())
        self._next_key += 1
        # An experiment may draw its next picture into the same array.
        return _Known(image_rgb.copy() if image_rgb.flags.writeable else image_rgb, fine, picture)


def _pictures(drawing: Drawing) -> Iterator[tuple[str, Picture]]:
    for name, item in drawing.primitives.items():
        if isinstance(item, Picture):
            yield name, item


def _same(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    return one is other or np.array_equal(one, other)
