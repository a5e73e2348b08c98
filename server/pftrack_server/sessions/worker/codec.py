"""The codec of drawings: one binary message per frame, which a page can paint without copying its arrays.

A message is, in this order and with all numbers little-endian:

====================  ==================================================================================================
4 bytes               `pfd` and the version of this form
uint32                length of the head in bytes, a multiple of 4
head                  JSON in UTF-8, padded with spaces
arrays                each begins at a multiple of 4 bytes; `arrays` in the head is their total length
pictures, any number  uint32 key, uint32 length of the file, the file, padded to a multiple of 4 bytes
====================  ==================================================================================================

The head is `{"frame", "width", "height", "caption", "legend", "arrays", "primitives", "worlds", "messages"}`. Messages
are those of the session's stream up to this drawing. Each key of the legend is `{"layer", "colour", "meaning"}`, its
colour a name in the palette. Each primitive has `name`, `kind` (the class of `pftrack.core.model.drawing` in lower
case) and that class's fields. Each world has `world`, its declaration with the length of its `ruler`, and `primitives`
in its own coordinates. The head refers to an array by `{"type", "at", "shape"}`: `f4`, `i4` or `u1`, the offset of its
first byte from the end of the head, and its shape. Several primitives may refer to one array. The head refers to a
picture by `{"key", "shape"}`; its pixels are in the picture of that key. A page keeps the pictures of the newest
drawing and is not sent the file of a key that it keeps; a new file replaces the one kept under its key.

Pictures are JPEG of quality 92 with colours at full resolution (`pftrack_server.core.pictures`): on the experiments'
scenes the mean error is below two levels of 255 and an edge stays where it is, at 0.2 to 1 ms a frame; PNG takes 1 to
16 ms for the same pictures.
"""

import dataclasses
import json
import struct
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Drawing, Picture, Primitive, WorldDrawing
from pftrack.core.model.faults import faults
from pftrack_server.core.pictures import EncodedPicture, PictureEncoder

VERSION: Final = 2
MAGIC: Final = b"pfd" + bytes([VERSION])
START = struct.Struct("<4sI")
RECORD = struct.Struct("<II")
ALIGNMENT = 4
TYPES = {"f": "f4", "i": "i4", "u": "u1", "b": "u1"}
"""Type of a sent array, by its NumPy kind."""


@dataclass(frozen=True, slots=True)
class EncodedDrawing:
    """A drawing in the form that is sent to pages.

    Attributes:
        head: The head without its messages.
        arrays: The arrays of the head, one after the other.
        pictures: The pictures of the drawing.
    """

    head: bytes
    arrays: bytes
    pictures: tuple[EncodedPicture, ...]

    def message(self, known: Collection[int] = (), texts: Iterable[str] = ()) -> bytes:
        """Return the message for a page.

        Args:
            known: Keys of the pictures that the page already has.
            texts: Messages of the stream up to this drawing, as JSON.
        """
        head = b"".join((self.head[:-1], b',"messages":[', ",".join(texts).encode(), b"]}"))
        head += b" " * (-len(head) % ALIGNMENT)
        pictures = [picture_record(picture) for picture in self.pictures if picture.key not in known]
        return b"".join((START.pack(MAGIC, len(head)), head, self.arrays, *pictures))


def picture_record(picture: EncodedPicture) -> bytes:
    """Return a picture's record at the end of a message."""
    length = len(picture.file)
    return b"".join((RECORD.pack(picture.key, length), picture.file, bytes(-length % ALIGNMENT)))


class DrawingEncoder:
    """Encodes the drawings of one run.

    Args:
        pictures: Encoder of their pictures, which may be shared with the scene.
        bits: Fraction bits kept of each number, so that a file of many drawings compresses well; all by default.
    """

    def __init__(self, pictures: PictureEncoder | None = None, bits: int | None = None) -> None:
        self._pictures = pictures or PictureEncoder()
        self._bits = bits

    def encode(self, drawing: Drawing, frame: int) -> EncodedDrawing:
        """Return a drawing in its binary form.

        Args:
            drawing: The drawing.
            frame: Number of its frame.

        Raises:
            ValueError: A primitive has invalid content.
        """
        for name, clause in faults(drawing).items():
            raise ValueError(f"{name} cannot be shown: {clause}")
        arrays = _Arrays(self._bits)
        pictures = self._pictures.encode(drawing, fine=True)
        described = []
        for name, item in drawing.primitives.items():
            described.append(_describe(name, item, arrays))
            if isinstance(item, Picture):
                described[-1]["image_rgb"] = {"key": pictures[name].key, "shape": item.image_rgb.shape}
        worlds = [_describe_world(each, arrays) for each in drawing.worlds]
        body = arrays.bytes()
        head = {
            "frame": frame,
            "width": drawing.width,
            "height": drawing.height,
            "caption": drawing.caption,
            "legend": [{"layer": layer, **dataclasses.asdict(key)} for layer, key in drawing.legend],
            "arrays": len(body),
            "primitives": described,
            "worlds": worlds,
        }
        text = json.dumps(head, separators=(",", ":"), ensure_ascii=False, allow_nan=False, default=_number).encode()
        return EncodedDrawing(text, body, tuple(pictures.values()))


def _describe(name: str, item: Primitive, arrays: "_Arrays") -> dict[str, Any]:
    """Return a primitive's entry in the head; its picture is added later."""
    fields = {each.name: getattr(item, each.name) for each in dataclasses.fields(item) if each.name != "image_rgb"}
    named = {field: arrays.add(value) if isinstance(value, np.ndarray) else value for field, value in fields.items()}
    return {"name": name, "kind": type(item).__name__.lower(), **named}


def _describe_world(drawn: WorldDrawing, arrays: "_Arrays") -> dict[str, Any]:
    primitives = [_describe(name, item, arrays) for name, item in drawn.primitives.items()]
    return {"world": {**dataclasses.asdict(drawn.world), "ruler": drawn.world.ruler}, "primitives": primitives}


def _number(value: object) -> object:
    """Return a NumPy scalar as a Python number for JSON."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a drawing holds arrays, numbers and texts, got a {type(value).__name__}")


class _Arrays:
    """The arrays of a message, each once."""

    def __init__(self, bits: int | None) -> None:
        self._bits = bits
        self._parts: list[bytes] = []
        self._length = 0
        self._known: dict[int, tuple[NDArray[Any], dict[str, Any]]] = {}

    def add(self, array: NDArray[Any]) -> dict[str, Any]:
        """Add an array and return the head's reference to it."""
        known = self._known.get(id(array))
        if known is not None:
            return known[1]
        kind = TYPES[array.dtype.kind]
        rounded = array if self._bits is None or kind != "f4" else _round(array, self._bits)
        data = np.ascontiguousarray(rounded, dtype=f"<{kind}").tobytes()
        reference = {"type": kind, "at": self._length, "shape": array.shape}
        padding = bytes(-len(data) % ALIGNMENT)
        self._parts += (data, padding)
        self._length += len(data) + len(padding)
        # The array is kept so that no other array gets its `id` meanwhile.
        self._known[id(array)] = array, reference
        return reference

    def bytes(self) -> bytes:
        """Return all arrays as bytes."""
        return b"".join(self._parts)


def _round(array: NDArray[Any], bits: int) -> NDArray[Any]:
    """Return numbers rounded to some fraction bits; those that are not finite, or would not be, stay unchanged."""
    fraction, exponent = np.frexp(array.astype(np.float64))
    rounded = np.ldexp(np.rint(np.ldexp(fraction, bits)), exponent - bits)
    return np.where(np.abs(rounded) <= np.finfo(np.float32).max, rounded, array)
