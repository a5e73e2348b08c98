"""CVAT's XML for video: `<track id label>` with `<box frame outside keyframe xtl ytl xbr ybr>`, from 0."""

from typing import Any
from xml.etree import ElementTree as ET

from pftrack.sources.errors import SourceError
from pftrack.sources.results.table import Box, ResultTable, table_of
from pftrack.sources.text import decode

__all__ = ["read_cvat"]

MOST_DIGITS = 9


def read_cvat(data: bytes) -> ResultTable:
    """Read a file; where a target is `outside`, it has no box, and polygons and others are passed over.

    Raises:
        SourceError: It is none.
    """
    text = decode(data)  # what is parsed is what was searched, whatever encoding the XML declares
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise SourceError("the XML declares entities, which CVAT never does")
    try:
        root = ET.fromstring(text)  # noqa: S314 - it declares no entities
    except ET.ParseError as error:
        raise SourceError(f"the XML cannot be read ({error})") from None
    tracks = root.findall("track")
    if root.tag != "annotations" or not tracks:
        raise SourceError("expected CVAT's annotations of a video, with tracks; those for images have none")
    size = root.find(".//task/size")
    told_size = "" if size is None else size.text or ""
    frames = int(told_size) if _is_whole(told_size) else 0
    boxes, names, passed = [], {}, 0
    for track in tracks:
        target = _whole(track, "id")
        names[target] = str(track.get("label", ""))[:80]
        passed += sum(shape.tag != "box" for shape in track)
        for box in track.findall("box"):
            if box.get("outside") == "1":
                continue
            left, top, right, bottom = (_number(box, name) for name in ("xtl", "ytl", "xbr", "ybr"))
            boxes.append(Box(_whole(box, "frame"), target, left, top, right - left, bottom - top))
    told = [f"{passed} shapes that are no boxes were passed over."] if passed else []
    return table_of("cvat", boxes, remarks=told, frames=min(frames, 10_000_000), names=names)


def _whole(element: Any, name: str) -> int:  # noqa: ANN401 - an element has no public type that all Pythons share
    text = element.get(name, "")
    if not _is_whole(text):
        raise SourceError(f"<{element.tag}> must have a whole number {name}, got {text[:40]!r}")
    return int(text)


def _is_whole(text: str) -> bool:
    return text.isdecimal() and len(text) <= MOST_DIGITS


def _number(element: Any, name: str) -> float:  # noqa: ANN401
    text = element.get(name, "")
    try:
        return float(text)
    except ValueError:
        raise SourceError(f"<{element.tag}> must have a number {name}, got {text[:40]!r}") from None
