"""Pictures from a worker: JPEG files, each encoded once for both the scene and the flat views.

Encoding in the worker costs 0.1 to 1 ms; sending the raw picture to the web process costs as much, and encoding it
there would slow all other sessions.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Drawing, Picture

JPEG = (cv2.IMWRITE_JPEG_QUALITY, 88)
"""JPEG quality at which a ball of ten pixels keeps its edge on a plane seen at an angle."""
FINE_JPEG = (
    cv2.IMWRITE_JPEG_QUALITY,
    92,
    # At half the colour resolution a thin coloured line would bleed over two pixels.
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
    cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
)
"""Options for views that paint pixel by pixel; encoding takes more than twice the time."""
NO_PIXELS: NDArray[np.uint8] = np.zeros((0, 0, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class EncodedPicture:
    """A picture of a drawing as a JPEG file.

    Attributes:
        key: Number that identifies the picture among those of the same worker.
        width: Width, px.
        height: Height, px.
        file: The file's content.
    """

    key: int
    width: int
    height: int
    file: bytes


@dataclass(frozen=True, slots=True)
class SceneDrawing:
    """A drawing in the form that is sent to the scene.

    Attributes:
        drawing: The drawing; its pictures keep their place in the painting order, but hold no pixels.
        pictures: The pictures, by the names of their primitives.
    """

    drawing: Drawing
    pictures: Mapping[str, EncodedPicture]


class _Known(NamedTuple):
    image_rgb: NDArray[np.uint8]
    is_fine: bool
    encoded: EncodedPicture


class PictureEncoder:
    """Encodes the pictures of one run's drawings; an unchanged picture is encoded once."""

    def __init__(self) -> None:
        self._next_key = 0
        self._known: dict[str, _Known] = {}

    def encode(self, drawing: Drawing, *, fine: bool) -> dict[str, EncodedPicture]:
        """Return the pictures of a drawing by the names of their primitives.

        Args:
            drawing: The drawing.
            fine: Whether to encode colours at full resolution; a picture already encoded that way is returned in any
                case.
        """
        self._known = {name: self._encode(name, item.image_rgb, fine=fine) for name, item in _pictures(drawing)}
        return {name: known.encoded for name, known in self._known.items()}

    def for_scene(self, drawing: Drawing) -> SceneDrawing:
        """Return a drawing in the form that is sent to the scene."""
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
