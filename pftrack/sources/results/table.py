"""What a file of results says: boxes by frame and target."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

from pftrack.sources.errors import SourceError

__all__ = ["FORMS", "Box", "Form", "ResultTable", "around", "table_of"]

Form: TypeAlias = Literal["mot", "otb", "vot", "cvat", "coco", "csv"]

FORMS: dict[Form, str] = {
    "mot": "MOTChallenge text",
    "otb": "OTB text",
    "vot": "VOT text",
    "cvat": "CVAT video XML",
    "coco": "COCO video JSON",
    "csv": "table of boxes (CSV)",
}
"""Names of the forms, and what people call them."""

MOST_BOXES = 250_000
LARGEST_FRAME = 10_000_000
LARGEST_NUMBER = 1_000_000
FURTHEST_PX = 1e6


class Box(NamedTuple):
    """A box in a frame.

    Attributes:
        frame: Its number, from 0.
        target: Number of the target.
        x: Left edge, px; the first pixel begins at 0.
        y: Upper edge, px.
        w: Width, px.
        h: Height, px.
        score: How sure the tracker says it is; NaN if it does not say.
    """

    frame: int
    target: int
    x: float
    y: float
    w: float
    h: float
    score: float = math.nan


@dataclass(frozen=True)
class ResultTable:
    """What a file of results says.

    Attributes:
        form: What kind of file it is.
        boxes: By ascending frame and target, one of a target in a frame.
        frames: How many frames it speaks of, those without a box included.
        names: Names of targets that have one, by number.
        remarks: How it was read and what was passed over, a sentence each.
    """

    form: Form
    boxes: tuple[Box, ...]
    frames: int
    names: dict[int, str]
    remarks: tuple[str, ...]

    @property
    def targets(self) -> tuple[int, ...]:
        """Numbers of all targets, in rising order."""
        return tuple(sorted({box.target for box in self.boxes}))


def around(corners: Iterable[float]) -> tuple[float, float, float, float]:
    """Return the smallest upright box (x, y, w, h) around corners x1, y1, x2, y2, ..."""
    numbers = list(corners)
    across, down = numbers[::2], numbers[1::2]
    return min(across), min(down), max(across) - min(across), max(down) - min(down)


def table_of(
    form: Form,
    boxes: Iterable[Box],
    *,
    remarks: Iterable[str] = (),
    frames: int = 0,
    names: dict[int, str] | None = None,
) -> ResultTable:
    """Return the table of boxes as they come; those without an area, or that are not finite, are left out.

    Raises:
        SourceError: There are none or too many, or a target has two in a frame.
    """
    found: dict[tuple[int, int], Box] = {}
    empty = 0
    for box in boxes:
        if not (0 <= box.frame <= LARGEST_FRAME and 0 <= box.target <= LARGEST_NUMBER):
            raise SourceError(
                f"frames count from 0 to {LARGEST_FRAME:,} and targets to {LARGEST_NUMBER:,}; "
                f"got frame {box.frame} and target {box.target}"
            )
        sides = (box.x, box.y, box.w, box.h)
        if not all(math.isfinite(side) for side in sides) or box.w <= 0 or box.h <= 0:
            empty += 1
            continue
        if max(map(abs, sides)) > FURTHEST_PX:
            raise SourceError(f"frame {box.frame} has a box at {box.x:g}, {box.y:g}, which is no pixel of a picture")
        if (box.frame, box.target) in found:
            raise SourceError(f"target {box.target} has two boxes in frame {box.frame}; one is allowed")
        found[box.frame, box.target] = box
        if len(found) > MOST_BOXES:
            raise SourceError(f"there are more than the {MOST_BOXES:,} boxes that are allowed")
    if not found:
        raise SourceError(f"the {FORMS[form]} has no box with an area")
    told = [*remarks]
    if empty:
        told.append(f"{empty} {'line has' if empty == 1 else 'lines have'} no box with an area.")
    ordered = tuple(found[key] for key in sorted(found))
    return ResultTable(form, ordered, max(frames, ordered[-1].frame + 1), names or {}, tuple(told))
