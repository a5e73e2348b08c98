"""Writing results: boxes in common forms; and reading and writing the forms COCO and CVAT.

- COCO has JSON for videos: images with their frame, and boxes with a track's number. Three variants exist: `images` and
  `annotations`, as COCO-VID has them; a bare list of results, which name only their image; and `videos` with `bboxes`,
  a list per target with one box or null for each frame (YouTube-VIS).
- CVAT has XML for video: `<track id label>` with `<box frame outside keyframe xtl ytl xbr ybr>`, from 0.
"""

import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

from pftrack.core.refusal import RefusedError
from pftrack.sources import cells
from pftrack.sources.cells import decode
from pftrack.sources.images import missing_numbers
from pftrack.sources.limits import HEAD_BYTES, natural_order
from pftrack.sources.results import table

Sides: TypeAlias = tuple[float, float, float, float]
NOWHERE: Sides = (math.nan, math.nan, math.nan, math.nan)

Write = Callable[[Sequence[table.Box], int, tuple[int, int], float], str]


def write_results(
    form: table.Form, boxes: Sequence[table.Box], *, frames: int, size: tuple[int, int], rate_hz: float
) -> bytes:
    """Return the content of a file.

    Args:
        form: Its form; OTB and VOT have room for the first target alone.
        boxes: By ascending frame.
        frames: Number of frames.
        size: Width and height of the picture, px.
        rate_hz: Frames a second.
    """
    return _WRITERS[form](boxes, frames, size, rate_hz).encode()


def _mot(boxes: Sequence[table.Box], _frames: int, _size: tuple[int, int], _rate: float) -> str:
    def line(box: table.Box) -> str:
        score = 1.0 if math.isnan(box.score) else box.score
        place = ",".join(_text(side) for side in (box.x + 1, box.y + 1, box.w, box.h, score))
        return f"{box.frame + 1},{box.target},{place},-1,-1,-1\n"

    return "".join(map(line, boxes))


def _rows(boxes: Sequence[table.Box], frames: int, origin: int, without: str) -> str:
    chosen = boxes[0].target if boxes else 0
    known: Mapping[int, table.Box] = {box.frame: box for box in boxes if box.target == chosen}

    def line(frame: int) -> str:
        if frame not in known:
            return without
        box = known[frame]
        return ",".join(_text(side) for side in (box.x + origin, box.y + origin, box.w, box.h))

    return "".join(f"{line(frame)}\n" for frame in range(frames))


def _otb(boxes: Sequence[table.Box], frames: int, _size: tuple[int, int], _rate: float) -> str:
    return _rows(boxes, frames, 1, "NaN,NaN,NaN,NaN")


def _vot(boxes: Sequence[table.Box], frames: int, _size: tuple[int, int], _rate: float) -> str:
    return _rows(boxes, frames, 0, "0")


def _cvat(boxes: Sequence[table.Box], frames: int, size: tuple[int, int], _rate: float) -> str:
    """Write what CVAT takes up for a video: every box is a keyframe, and one outside ends each stretch of frames."""
    shape = "<original_size><width>{}</width><height>{}</height></original_size>".format(*size)
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        "<annotations>",
        "  <version>1.1</version>",
        f"  <meta><task><size>{frames}</size><mode>interpolation</mode>{shape}</task></meta>",
    ]
    for target in sorted({box.target for box in boxes}):
        own = [box for box in boxes if box.target == target]
        lines.append(f'  <track id="{target}" label={quoteattr(own[0].label or "target")} source="file">')
        for box, following in zip(own, [*own[1:], None], strict=True):
            lines.append(_cvat_box(box, box.frame, outside=0))
            ends = box.frame + 1 < frames and (following is None or following.frame > box.frame + 1)
            if ends:
                lines.append(_cvat_box(box, box.frame + 1, outside=1))
        lines.append("  </track>")
    return "\n".join([*lines, "</annotations>", ""])


def _cvat_box(box: table.Box, frame: int, *, outside: int) -> str:
    edges = (box.x, box.y, box.x + box.w, box.y + box.h)
    said = " ".join(f'{name}="{side:.4f}"' for name, side in zip(("xtl", "ytl", "xbr", "ybr"), edges, strict=True))
    return f'    <box frame="{frame}" outside="{outside}" occluded="0" keyframe="1" {said} z_order="0"></box>'


def _coco(boxes: Sequence[table.Box], frames: int, size: tuple[int, int], rate_hz: float) -> str:
    width, height = size
    labels = list(dict.fromkeys(box.label or "target" for box in boxes))
    annotations = []
    for number, box in enumerate(boxes, 1):
        one: dict[str, object] = {
            "id": number,
            "image_id": box.frame + 1,
            "video_id": 1,
            "category_id": labels.index(box.label or "target") + 1,
            "track_id": box.target,
            "bbox": [round(side, 4) for side in box[2:6]],
            "area": round(box.w * box.h, 4),
            "iscrowd": 0,
        }
        annotations.append(one if math.isnan(box.score) else {**one, "score": box.score})
    images = [
        {
            "id": frame + 1,
            "video_id": 1,
            "frame_id": frame,
            "file_name": f"{frame:06d}.jpg",
            "width": width,
            "height": height,
        }
        for frame in range(frames)
    ]
    return json.dumps(
        {
            "info": {"description": "boxes by pftrack", "fps": rate_hz},
            "videos": [{"id": 1, "name": "clip", "width": width, "height": height, "length": frames}],
            "categories": [{"id": number, "name": label} for number, label in enumerate(labels, 1)],
            "images": images,
            "annotations": annotations,
        }
    )


def _text(number: float) -> str:
    return f"{number:.4f}".rstrip("0").rstrip(".")


_WRITERS: Mapping[table.Form, Write] = {
    "mot": _mot,
    "otb": _otb,
    "vot": _vot,
    "cvat": _cvat,
    "coco": _coco,
}

TRACK = ("track_id", "instance_id", "object_id")
FRAME = ("frame_id", "frame_index", "mot_frame_id")


def read_coco(data: bytes) -> table.ResultTable:
    """Read a file; of several videos the first.

    Raises:
        RefusedError: It is none.
    """
    try:
        raw = json.loads(decode(data))
    except (ValueError, RecursionError) as error:
        raise RefusedError(f"the JSON cannot be read ({error})") from None
    try:
        return _read(raw)
    except RefusedError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise RefusedError("expected COCO's images and annotations with bbox and track_id") from None


def _read(raw: Any) -> table.ResultTable:  # noqa: ANN401 - JSON
    listed = isinstance(raw, list)
    annotations: Sequence[Mapping[str, Any]] = raw if listed else raw["annotations"]
    images = [] if listed else list(raw.get("images", []))
    names = {} if listed else {int(one["id"]): str(one.get("name", ""))[:80] for one in raw.get("categories", [])}
    told: list[str] = []
    if any("bboxes" in one for one in annotations):
        return table.table_of("coco", list(_by_video(annotations, names, told)), remarks=told)
    videos = list(dict.fromkeys(one.get("video_id") for one in images))
    if len(videos) > 1:
        told.append(f"It has {len(videos)} videos; the first was taken.")
        images = [one for one in images if one.get("video_id") == videos[0]]
    frames = _frames(images or annotations, told, listed=not images)
    key = "id" if images else "image_id"
    place = {one[key]: frame for one, frame in zip(images or annotations, frames, strict=True)}
    tracks = _tracks([one for one in annotations if one["image_id"] in place], told)
    boxes = []
    for number, one in enumerate(annotations):
        if one["image_id"] in place:
            sides = _turned(_sides(one.get("bbox"), one.get("segmentation")), one.get("attributes"))
            target = next(tracks)
            boxes.append(
                (
                    f"annotation {one.get('id', number)}",
                    table.Box(place[one["image_id"]], target, *sides, _score(one), _label(one, names)),
                )
            )
    return table.table_of("coco", boxes, remarks=told, frames=len(images))


def _sides(bbox: Any, polygons: Any = None) -> Sides:  # noqa: ANN401 - JSON
    """Return x, y, w, h of an annotation, around its polygons if it has no box; NaN without both."""
    try:
        x, y, w, h = map(float, bbox or table.around(number for polygon in polygons for number in polygon))
    except (TypeError, ValueError):
        return NOWHERE
    return x, y, w, h


def _turned(sides: Sides, said: Mapping[str, Any] | None) -> Sides:
    """Return the smallest upright box around a box that may be turned, by degrees clockwise about its middle."""
    x, y, across, down = sides
    angle = math.radians(float((said or {}).get("rotation") or 0))
    if not angle:
        return sides
    cos, sin = abs(math.cos(angle)), abs(math.sin(angle))
    w, h = across * cos + down * sin, across * sin + down * cos
    return x + (across - w) / 2, y + (down - h) / 2, w, h


def _score(one: Mapping[str, Any]) -> float:
    return float(one.get("score", math.nan))


def _label(one: Mapping[str, Any], names: Mapping[int, str]) -> str:
    return names.get(one.get("category_id", -1), "")


def _track(one: Mapping[str, Any]) -> int | None:
    """Return the number of an annotation's track: its own, or from its attributes, as in CVAT."""
    found = next((said[name] for said in (one, one.get("attributes") or {}) for name in TRACK if name in said), None)
    return None if found is None else int(found)


def _tracks(annotations: Sequence[Mapping[str, Any]], told: list[str]) -> Iterator[int]:
    """Yield the target of each annotation; without numbers of tracks, all are of one if no image has two."""
    tracks = [_track(one) for one in annotations]
    images = [one["image_id"] for one in annotations]
    if all(track is None for track in tracks) and len(set(images)) == len(images):
        told.append("Annotations have no track_id: all are of one target, as no image has two.")
        return iter([1] * len(images))
    if None in tracks:
        told.append("Each annotation without a track_id has its own target.")
    free = itertools.count(max((track for track in tracks if track is not None), default=0) + 1)
    return iter([next(free) if track is None else track for track in tracks])


def _frames(images: Sequence[Mapping[str, Any]], told: list[str], *, listed: bool) -> list[int]:
    """Return the frame of each image: its stated frame, or else in the order of their numbers."""
    name = next((name for name in FRAME if images and all(name in one for one in images)), None)
    if name is None:
        ids = [one["image_id" if listed else "id"] for one in images]
        names = dict.fromkeys(str(one.get("file_name", "")) for one in images)
        if "" in names or len(names) < len(ids):
            places = {one: place for place, one in enumerate(sorted(set(ids)))}
            told.append("Images do not say their frame: it was taken from the order of their numbers.")
            return [places[one] for one in ids]
        ordered = sorted(names, key=natural_order)
        told.append("Images do not say their frame: it was taken from the order of their names.")
        told += (f"In the order of names, {gap}." for gap in missing_numbers([Path(one).stem for one in ordered]))
        places = {one: place for place, one in enumerate(ordered)}
        return [places[one] for one in names]
    numbers = [int(one[name]) for one in images]
    first = min(1, *numbers)
    if first:
        told.append(f"Its first frame was taken as {first}.")
    return [number - first for number in numbers]


def _by_video(
    annotations: Sequence[Mapping[str, Any]], names: Mapping[int, str], told: list[str]
) -> Iterator[tuple[str, table.Box]]:
    videos = list(dict.fromkeys(one["video_id"] for one in annotations))
    if len(videos) > 1:
        told.append(f"It has {len(videos)} videos; the first was taken.")
    for number, one in enumerate(annotations):
        if one["video_id"] != videos[0]:
            continue
        track = one.get("id") if _track(one) is None else _track(one)
        for frame, box in enumerate(one["bboxes"]):
            if box is not None:
                said = table.Box(
                    frame, number + 1 if track is None else int(track), *_sides(box), _score(one), _label(one, names)
                )
                yield f"annotation {one.get('id', number)}, frame {frame}", said


MOST_DIGITS = 9
SIDES = {
    "box": ("xtl", "ytl", "xbr", "ybr"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "mask": ("left", "top", "width", "height"),
}
SHAPES = (*SIDES, "polygon", "polyline", "points")
"""Shapes of CVAT that have a bounding box."""


def read_cvat(data: bytes) -> table.ResultTable:
    """Read a file; a target that is `outside` has no box, and shapes other than `SHAPES` are skipped.

    Raises:
        RefusedError: It is none.
    """
    text = decode(data)  # the parsed text is the searched text, whatever encoding the XML declares
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RefusedError("the XML declares entities, which CVAT never does")
    try:
        root = ET.fromstring(text)  # noqa: S314 - it declares no entities
    except ET.ParseError as error:
        raise RefusedError(f"the XML cannot be read ({error})") from None
    tracks = root.findall("track")
    if root.tag != "annotations" or not tracks:
        raise RefusedError("expected CVAT's annotations of a video, with tracks; those for images have none")
    size = root.find(".//task/size")
    told_size = "" if size is None else size.text or ""
    frames = int(told_size) if _is_whole(told_size) else 0
    boxes, passed = [], 0
    ids = [_whole(track, "id") for track in tracks]
    repeated = len(set(ids)) < len(ids)  # as of several tasks in one file
    for number, track in enumerate(tracks):
        target, label = number if repeated else ids[number], str(track.get("label", ""))[:80]
        for shape in track:
            if shape.tag not in SHAPES:
                passed += 1
            elif shape.get("outside") != "1":
                frame = _whole(shape, "frame")
                box = table.Box(frame, target, *_shape(shape), label=label)
                boxes.append((f"track {target}, frame {frame}", box))
    told = [f"{passed} shapes of other kinds than {', '.join(SHAPES)} were passed over."] if passed else []
    if repeated:
        told.append("Tracks have the same id: they were numbered as they come.")
    return table.table_of("cvat", boxes, remarks=told, frames=min(frames, 10_000_000))


def _shape(element: Any) -> Sides:  # noqa: ANN401 - as below
    """Return the smallest upright box around a shape; NaN if it is broken."""
    try:
        if element.tag not in SIDES:
            numbers = [float(number) for point in element.get("points", "").split(";") for number in point.split(",")]
            return table.around(numbers) if len(numbers) % 2 == 0 else NOWHERE
        x, y, across, down = (float(element.get(name, "")) for name in SIDES[element.tag])
    except ValueError:
        return NOWHERE
    if element.tag == "ellipse":
        x, y, across, down = x - across, y - down, 2 * across, 2 * down
    elif element.tag == "box":
        across, down = across - x, down - y
    return _turned((x, y, across, down), element.attrib)


def _whole(element: Any, name: str) -> int:  # noqa: ANN401 - an element has no public type that all Pythons share
    text = element.get(name, "")
    if not _is_whole(text):
        raise RefusedError(f"<{element.tag}> must have a whole number {name}, got {text[:40]!r}")
    return int(text)


def _is_whole(text: str) -> bool:
    return text.isdecimal() and len(text) <= MOST_DIGITS


# Reading results: the content shows the form of a file; guesses are reported.

LARGEST_FILE_BYTES = 64 * 1024 * 1024


def read_results(
    data: bytes, *, form: table.Form | None = None, first_frame: int | None = None, first_pixel: int | None = None
) -> table.ResultTable:
    """Read the content of a file.

    Args:
        data: The content.
        form: Its form; recognised by default.
        first_frame: Number of the first frame in MOTChallenge text; recognised by default.
        first_pixel: Number of the first pixel in text of numbers; as the form has it if not given.

    Raises:
        RefusedError: It is not a file of results, a line of it is wrong, or it is too large.
    """
    if len(data) > LARGEST_FILE_BYTES:
        raise RefusedError(f"results may have at most {LARGEST_FILE_BYTES // 1024**2} MiB")
    found = form or table.form_of(data)
    if found in {"mot", "otb", "vot"}:
        cells.check_decimals(decode(data))
    if found == "mot":
        return table.read_mot(data, first_frame, first_pixel, surely=form is not None)
    if found in {"otb", "vot"}:
        # Only the whole file shows whether all of its numbers are whole.
        whole = form or table.form_of_lines(decode(data).splitlines()) or found
        return table.read_rows(data, whole, first_pixel, surely=form is not None)
    readers: dict[str, Callable[[bytes], table.ResultTable]] = {
        "cvat": read_cvat,
        "coco": read_coco,
        "csv": lambda data: table.read_csv(data, first_frame),
    }
    if found is None and len(cells.read_table(decode(data[:HEAD_BYTES])).header) >= table.FEWEST_COLUMNS:
        return table.read_csv(data)  # which says the columns that it has
    if found is None:
        raise RefusedError(f"the file does not hold results; expected {', '.join(table.FORMS.values())}")
    return readers[found](data)


def read_results_file(
    path: Path, *, form: table.Form | None = None, first_frame: int | None = None, first_pixel: int | None = None
) -> table.ResultTable:
    """Read a file; see `read_results`.

    Raises:
        RefusedError: It cannot be read, or is not a file of results; the sentence begins with its name.
    """
    data = cells.content_of(path, LARGEST_FILE_BYTES)
    try:
        return read_results(data, form=form, first_frame=first_frame, first_pixel=first_pixel)
    except RefusedError as error:
        raise RefusedError(f"{path.name}: {error}") from None
