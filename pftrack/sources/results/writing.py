"""Writing results: boxes in the forms that others read."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from xml.sax.saxutils import quoteattr

from pftrack.sources.results.table import Box, Form

__all__ = ["write_results"]

Write = Callable[[Sequence[Box], int, tuple[int, int], float], str]


def write_results(form: Form, boxes: Sequence[Box], *, frames: int, size: tuple[int, int], rate_hz: float) -> bytes:
    """Return the content of a file.

    Args:
        form: What it shall be; OTB and VOT have room for the first target alone.
        boxes: By ascending frame.
        frames: How many frames there are.
        size: Width and height of the picture, px.
        rate_hz: Frames a second.
    """
    return _WRITERS[form](boxes, frames, size, rate_hz).encode()


def _mot(boxes: Sequence[Box], _frames: int, _size: tuple[int, int], _rate: float) -> str:
    def line(box: Box) -> str:
        score = 1.0 if math.isnan(box.score) else box.score
        place = ",".join(_text(side) for side in (box.x + 1, box.y + 1, box.w, box.h, score))
        return f"{box.frame + 1},{box.target},{place},-1,-1,-1\n"

    return "".join(map(line, boxes))


def _rows(boxes: Sequence[Box], frames: int, origin: int, without: str) -> str:
    chosen = boxes[0].target if boxes else 0
    known: Mapping[int, Box] = {box.frame: box for box in boxes if box.target == chosen}

    def line(frame: int) -> str:
        if frame not in known:
            return without
        box = known[frame]
        return ",".join(_text(side) for side in (box.x + origin, box.y + origin, box.w, box.h))

    return "".join(f"{line(frame)}\n" for frame in range(frames))


def _otb(boxes: Sequence[Box], frames: int, _size: tuple[int, int], _rate: float) -> str:
    return _rows(boxes, frames, 1, "NaN,NaN,NaN,NaN")


def _vot(boxes: Sequence[Box], frames: int, _size: tuple[int, int], _rate: float) -> str:
    return _rows(boxes, frames, 0, "0")


def _csv(boxes: Sequence[Box], _frames: int, _size: tuple[int, int], _rate: float) -> str:
    lines = ["frame,target,x,y,w,h,score"]
    for box in boxes:
        score = "" if math.isnan(box.score) else _text(box.score)
        lines.append(f"{box.frame},{box.target},{','.join(_text(side) for side in box[2:6])},{score}")
    return "\n".join([*lines, ""])


def _cvat(boxes: Sequence[Box], frames: int, size: tuple[int, int], _rate: float) -> str:
    """Write what CVAT takes up for a video: every box is a keyframe, and one outside ends each stretch of frames."""
    shape = "<original_size><width>{}</width><height>{}</height></original_size>".format(*size)
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        "<annotations>",
        "  <version>1.1</version>",
        f"  <meta><task><size>{frames}</size><mode>interpolation</mode>{shape}</task></meta>",
    ]
    for target in sorted({box.target for box in boxes}):
        lines.append(f'  <track id="{target}" label={quoteattr("target")} source="file">')
        own = [box for box in boxes if box.target == target]
        for box, following in zip(own, [*own[1:], None], strict=True):
            lines.append(_cvat_box(box, box.frame, outside=0))
            ends = box.frame + 1 < frames and (following is None or following.frame > box.frame + 1)
            if ends:
                lines.append(_cvat_box(box, box.frame + 1, outside=1))
        lines.append("  </track>")
    return "\n".join([*lines, "</annotations>", ""])


def _cvat_box(box: Box, frame: int, *, outside: int) -> str:
    edges = (box.x, box.y, box.x + box.w, box.y + box.h)
    said = " ".join(f'{name}="{side:.4f}"' for name, side in zip(("xtl", "ytl", "xbr", "ybr"), edges, strict=True))
    return f'    <box frame="{frame}" outside="{outside}" occluded="0" keyframe="1" {said} z_order="0"></box>'


def _coco(boxes: Sequence[Box], frames: int, size: tuple[int, int], rate_hz: float) -> str:
    width, height = size
    annotations = []
    for number, box in enumerate(boxes, 1):
        one: dict[str, object] = {
            "id": number,
            "image_id": box.frame + 1,
            "video_id": 1,
            "category_id": 1,
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
            "categories": [{"id": 1, "name": "target"}],
            "images": images,
            "annotations": annotations,
        }
    )


def _text(number: float) -> str:
    return f"{number:.4f}".rstrip("0").rstrip(".")


_WRITERS: Mapping[Form, Write] = {
    "mot": _mot,
    "otb": _otb,
    "vot": _vot,
    "cvat": _cvat,
    "coco": _coco,
    "csv": _csv,
}
