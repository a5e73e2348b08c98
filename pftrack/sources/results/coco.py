"""COCO's JSON for videos: images with their frame, and boxes with a track's number.

Three forms are about: `images` and `annotations`, as COCO-VID has them; a bare list of results, which name only their
image; and `videos` with `bboxes`, a list a target with one box or null for each frame (YouTube-VIS).
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pftrack.sources.errors import SourceError
from pftrack.sources.results.table import Box, ResultTable, table_of
from pftrack.sources.text import decode

__all__ = ["read_coco"]

TRACK = ("track_id", "instance_id", "id")
FRAME = ("frame_id", "frame_index", "mot_frame_id")


def read_coco(data: bytes) -> ResultTable:
    """Read a file; of several videos the first.

    Raises:
        SourceError: It is none.
    """
    try:
        raw = json.loads(decode(data))
    except (ValueError, RecursionError) as error:
        raise SourceError(f"the JSON cannot be read ({error})") from None
    try:
        return _read(raw)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        if isinstance(error, SourceError):
            raise
        raise SourceError("expected COCO's images and annotations with bbox and track_id") from None


def _read(raw: Any) -> ResultTable:  # noqa: ANN401 - JSON
    listed = isinstance(raw, list)
    annotations: Sequence[Mapping[str, Any]] = raw if listed else raw["annotations"]
    images = [] if listed else list(raw.get("images", []))
    names = {} if listed else {int(one["id"]): str(one.get("name", ""))[:80] for one in raw.get("categories", [])}
    told: list[str] = []
    if any("bboxes" in one for one in annotations):
        boxes = list(_by_video(annotations, told))
        return table_of("coco", boxes, remarks=told, names=_called(annotations, names))
    videos = list(dict.fromkeys(one.get("video_id") for one in images))
    if len(videos) > 1:
        told.append(f"It has {len(videos)} videos; the first was taken.")
        images = [one for one in images if one.get("video_id") == videos[0]]
    frames = _frames(images or annotations, told, listed=not images)
    key = "id" if images else "image_id"
    place = {one[key]: frame for one, frame in zip(images or annotations, frames, strict=True)}
    boxes = []
    for number, one in enumerate(annotations):
        if one["image_id"] in place:
            track = next((one[name] for name in TRACK if name in one), number + 1)
            x, y, w, h = (float(side) for side in one["bbox"])
            boxes.append(Box(place[one["image_id"]], int(track), x, y, w, h, float(one.get("score", math.nan))))
    if not any("track_id" in one or "instance_id" in one for one in annotations):
        told.append("Annotations have no track_id: each box has a number of its own.")
    return table_of("coco", boxes, remarks=told, frames=len(images), names=_called(annotations, names))


def _frames(images: Sequence[Mapping[str, Any]], told: list[str], *, listed: bool) -> list[int]:
    """Return the frame of each image: as it says, or else in the order of their numbers."""
    name = next((name for name in FRAME if images and all(name in one for one in images)), None)
    if name is None:
        ids = [one["image_id" if listed else "id"] for one in images]
        places = {one: place for place, one in enumerate(sorted(set(ids)))}
        told.append("Images do not say their frame: it was taken from the order of their numbers.")
        return [places[one] for one in ids]
    numbers = [int(one[name]) for one in images]
    first = min(1, *numbers)
    if first:
        told.append(f"Its first frame was taken as {first}.")
    return [number - first for number in numbers]


def _by_video(annotations: Sequence[Mapping[str, Any]], told: list[str]) -> Iterator[Box]:
    videos = list(dict.fromkeys(one["video_id"] for one in annotations))
    if len(videos) > 1:
        told.append(f"It has {len(videos)} videos; the first was taken.")
    for number, one in enumerate(annotations):
        if one["video_id"] != videos[0]:
            continue
        track = int(next((one[name] for name in TRACK if name in one), number + 1))
        for frame, box in enumerate(one["bboxes"]):
            if box is not None:
                x, y, w, h = (float(side) for side in box)
                yield Box(frame, track, x, y, w, h, float(one.get("score", math.nan)))


def _called(annotations: Sequence[Mapping[str, Any]], names: Mapping[int, str]) -> dict[int, str]:
    """Return the name of the category of each track that has one."""
    called: dict[int, str] = {}
    for one in annotations:
        track = next((one[name] for name in TRACK if name in one), None)
        if track is not None and one.get("category_id") in names:
            called[int(track)] = names[one["category_id"]]
    return called
