"""Reading drawings as a page does: the truth against which the codec is tested."""

import json
from collections.abc import Mapping
from typing import Any, get_args

import cv2
import numpy as np
from pydantic import TypeAdapter

from pftrack.core.model.drawing import Drawing, Key, Primitive, World, WorldDrawing
from pftrack_server.sessions.worker.codec import ALIGNMENT, MAGIC, RECORD, START

__all__ = ["Reader", "decode", "messages_of"]

WORLDS: TypeAdapter[World] = TypeAdapter(World)
KINDS: dict[str, type[Primitive]] = {kind.__name__.lower(): kind for kind in get_args(Primitive)}


def messages_of(message: bytes) -> list[dict[str, Any]]:
    """Return what was told up to a drawing, from the drawing's message."""
    _, length = START.unpack_from(message)
    return json.loads(message[START.size : START.size + length])["messages"]


class Reader:
    """What somebody has read of a session's stream: all that was told, and where the run stood with each drawing."""

    def __init__(self) -> None:
        self.heard: list[dict[str, Any]] = []
        self.position = -1
        self.frames: list[int] = []
        self.positions: list[int] = []
        self._pictures: dict[int, bytes] = {}

    def take(self, message: str | bytes) -> Drawing | None:
        """Take a message, and return the drawing if it is one."""
        for each in [json.loads(message)] if isinstance(message, str) else messages_of(message):
            self.heard.append(each)
            self.position = each.get("session", {}).get("position", self.position)
        if isinstance(message, str):
            return None
        frame, drawing, self._pictures = decode(message, self._pictures)
        self.frames.append(frame)
        self.positions.append(self.position)
        return drawing


def decode(message: bytes, pictures: Mapping[int, bytes] | None = None) -> tuple[int, Drawing, dict[int, bytes]]:
    """Read a message.

    Args:
        message: What came.
        pictures: Files by key, as the message before has left them.

    Returns:
        The frame; the drawing, its pictures as JPEG has left them; the files by key for reading the next message.
    """
    magic, length = START.unpack_from(message)
    assert magic == MAGIC
    base = START.size + length
    head = json.loads(message[START.size : base])
    held = dict(pictures or {}) | _records(message, base + head["arrays"])
    shown = {item.pop("name"): _primitive(item, message, base, held) for item in head["primitives"]}
    worlds = tuple(_world(each, message, base) for each in head["worlds"])
    keys = {item["image_rgb"]["key"] for item in head["primitives"] if item["kind"] == "picture"}
    legend = tuple((key["layer"], Key(key["colour"], key["meaning"])) for key in head["legend"])
    result = Drawing(head["width"], head["height"], shown, head["caption"], worlds, legend)
    return head["frame"], result, {key: held[key] for key in keys}


def _world(head: Mapping[str, Any], message: bytes, base: int) -> WorldDrawing:
    primitives = {item.pop("name"): _primitive(item, message, base, {}) for item in head["primitives"]}
    declared = {name: value for name, value in head["world"].items() if name != "ruler"}
    return WorldDrawing(WORLDS.validate_python(declared), primitives)


def _records(message: bytes, at: int) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    while at < len(message):
        key, length = RECORD.unpack_from(message, at)
        at += RECORD.size
        found[key] = message[at : at + length]
        assert len(found[key]) == length
        at += length + -length % ALIGNMENT
    return found


def _primitive(head: Mapping[str, Any], message: bytes, base: int, pictures: Mapping[int, bytes]) -> Primitive:
    values: dict[str, Any] = {}
    for name, value in head.items():
        match value:
            case {"key": key}:
                file = np.frombuffer(pictures[key], np.uint8)
                image = cv2.imdecode(file, cv2.IMREAD_COLOR)
                assert image is not None
                values[name] = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
            case {"type": kind, "at": at, "shape": shape}:
                count = int(np.prod(shape, dtype=np.int64))
                values[name] = np.frombuffer(message, f"<{kind}", count, base + at).reshape(shape)
            case list():
                values[name] = tuple(value)
            case _:
                values[name] = value
    return KINDS[values.pop("kind")](**values)
