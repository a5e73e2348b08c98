"""Truth for recorded clips: a table of numbers by frame, such as boxes drawn by hand.

Boxes are read in all forms of other trackers and of annotators (`pftrack.sources.results`). The shortest is a table
with the columns `frame, x, y, w, h`: the frame's number from 0, the left and upper edge of the box and its width and
height, in px of the picture. An experiment declares the columns of other tables by a `TruthKind`. Further columns are
ignored. A frame that is not listed, or whose values are empty, is a frame without truth and is not counted.

A user may also mark the target in pictures of the clip: a `TruthKind` gives the kind of mark, and the place of a
frame's values in it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from pftrack.core.files import csv_text
from pftrack.core.model.marks import Box, Mark
from pftrack.core.model.source import FrameSequence, Target, Truth
from pftrack.core.refusal import RefusedError
from pftrack.sources.cells import Table, content_of, decode, frame_in, number_in
from pftrack.sources.cells import read_table as read_cells
from pftrack.sources.results.writing import read_results_file

# A target may leave the picture, partly or for some frames entirely, and its true box with it. If most boxes lie wholly
# outside, they were drawn on a clip of another size, or their columns are mislabelled.

MOST = 0.5
"""A larger share of boxes outside is not explained by a target that has left the picture."""
LISTED = 3
"""Number of stretches of frames that are listed."""


def boxes_outside(boxes: Iterable[tuple[int, Sequence[float]]], width: int, height: int) -> tuple[str, ...]:
    """Return a warning if most boxes lie wholly outside the picture, a sentence; nothing otherwise.

    Args:
        boxes: (frame, (x, y, w, h)) of every box, px, of frames that the recording has.
        width: Width of the pictures, px.
        height: Height of the pictures, px.
    """
    known = list(boxes)
    outside = [
        (frame, box)
        for frame, box in known
        if not (-box[2] < box[0] < width and -box[3] < box[1] < height)  # it covers [x, x + w) and [y, y + h)
    ]
    if len(outside) <= MOST * len(known):
        return ()
    frame, box = min(outside, key=lambda one: one[0])
    these = "The only true box lies" if len(known) == 1 else f"{len(outside):,} of {len(known):,} true boxes lie"
    where = _frames({number for number, _ in outside})
    place = ", ".join(f"{value:g}" for value in box)
    sentences = (
        f"{these} wholly outside the picture of {width} x {height} px: {where}; that of frame {frame} is {place}. "
        "If they were drawn on a clip of another size, scale them to this one, and check the order of the columns: "
        "x, y, w, h."
    )
    return (sentences,)


def _frames(numbers: Iterable[int]) -> str:
    """Return numbers of frames in words, such as "frames 0 to 8 and 11"."""
    stretches = groupby(enumerate(sorted(numbers)), lambda one: one[1] - one[0])
    spans = [[number for _, number in stretch] for _, stretch in stretches]
    told = [f"{span[0]}" if len(span) == 1 else f"{span[0]} to {span[-1]}" for span in spans[:LISTED]]
    if more := sum(map(len, spans[LISTED:])):
        told.append(f"{more:,} more")
    words = told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"
    return f"{'frames' if sum(map(len, spans)) > 1 else 'frame'} {words}"


LARGEST_FILE_BYTES = 16 * 1024 * 1024


class Form(NamedTuple):
    """The form of a table.

    Attributes:
        columns: Their names, that of the frame's number first.
        one: Name of a frame's values.
        several: The same for several frames.
        largest: Largest value, in either direction.
        unit: Unit of the values.
        positive: Columns whose values must be above 0.
    """

    columns: tuple[str, ...]
    one: str
    several: str
    largest: float
    unit: str
    positive: tuple[str, ...] = ()

    def allows(self, values: Sequence[float]) -> bool:
        """Return whether these may be the values of a frame."""
        if len(values) != len(self.columns) - 1 or not all(abs(value) <= self.largest for value in values):
            return False
        return all(value > 0 for value in self.lengths(values))

    def lengths(self, values: Sequence[float]) -> tuple[float, ...]:
        """Return the values of a frame that must be above 0."""
        return tuple(values[self.columns.index(name) - 1] for name in self.positive)


BOX_FORM = Form(("frame", "x", "y", "w", "h"), "box", "boxes", 100_000.0, "px", positive=("w", "h"))


@dataclass(frozen=True)
class TruthTable:
    """The true boxes of a clip.

    Attributes:
        boxes: (x, y, w, h) in px by frame number; a frame without truth is missing.
        warnings: What was skipped in reading, one sentence each.
    """

    boxes: Mapping[int, tuple[float, float, float, float]]
    warnings: tuple[str, ...] = field(default=())

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The boxes."""
        return self.boxes

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame of the clip, or None without a truth.

        A box covers whole pixels and positions count from the centre of the first pixel, so the centre of a box of `w`
        pixels lies (w - 1) / 2 to the right of its first one.
        """
        box = self.boxes.get(frame)
        if box is None:
            return None
        x, y, w, h = box
        return Target(position=np.array([x + (w - 1) / 2, y + (h - 1) / 2]), size=max(w, h), extent=(w, h))


def read_truth(path: Path, first_frame: int | None = None) -> TruthTable:
    """Read true boxes in any form that results have; of several targets the first.

    Args:
        path: The file.
        first_frame: Number of its first frame; told by itself if not given.

    Raises:
        RefusedError: The file is missing, has no boxes, or has a wrong line.
    """
    found = read_results_file(path, first_frame=first_frame)
    first = found.boxes[0]
    boxes = {box.frame: (box.x, box.y, box.w, box.h) for box in found.boxes if box.target == first.target}
    others = len(found.targets) - 1
    left_out = f"It has {others + 1} targets; only {first.label or f'target {first.target}'} counts."
    return TruthTable(MappingProxyType(boxes), (*found.remarks, *([left_out] if others else [])))


class TruthKind(NamedTuple):
    """A kind of truth.

    Attributes:
        form: Form of its file.
        read: Reads a file, given the number of its first frame, or None to detect it.
        table: Makes its table of rows that were saved.
        mark: Kind of mark by which a user states the truth of a picture; None if no mark can.
        parts: Paths of a frame's values in the mark's JSON, in the order of the columns; dots join the names of a path.
        misfits: (frame and values of every row, width and height of the pictures, px) -> reasons to doubt that they
            belong to these pictures, a sentence each.
    """

    form: Form
    read: Callable[[Path, int | None], Truth]
    table: Callable[[Any], Truth]
    mark: type[Mark] | None = None
    parts: tuple[str, ...] = ()
    misfits: Callable[[Iterable[tuple[int, Sequence[float]]], int, int], tuple[str, ...]] = lambda *_: ()


BOXES = TruthKind(BOX_FORM, read_truth, TruthTable, Box, ("x", "y", "width", "height"), boxes_outside)


def within(
    kind: TruthKind, known: Truth, frames: int, size: tuple[int, int]
) -> tuple[dict[int, tuple[float, ...]], list[str]]:
    """Return the rows of a recording's frames, and remarks on them, a sentence each.

    Args:
        kind: Kind of the truth.
        known: All that is given.
        frames: Number of the recording's frames.
        size: Width and height of its pictures, px.

    Raises:
        RefusedError: None remain.
    """
    rows = {frame: row for frame, row in known.rows.items() if frame < frames}
    if not rows:
        least = min(known.rows, default=None)
        found = "lists none with any" if least is None else f"begins at frame {least}"
        raise RefusedError(
            f"expected {kind.form.several} of the recording's frames, 0 to {frames - 1}; the file {found}"
        )
    warnings = [*known.warnings]
    if beyond := len(known.rows) - len(rows):  # the table may be of a longer clip
        listed = "a frame" if beyond == 1 else f"{beyond:,} frames"
        warnings.append(f"The file lists {listed} after the last of the recording, {frames - 1}; they are left out.")
    return rows, [*warnings, *kind.misfits(rows.items(), *size)]


def remarks_on(sequence: FrameSequence, kind: TruthKind | None, truth: Truth | None) -> tuple[str, ...]:
    """Return what a person has to know of a recording and of a truth that was read for it, a sentence each."""
    if kind is None or truth is None:
        return sequence.index.warnings
    return (*sequence.index.warnings, *within(kind, truth, sequence.frame_count, sequence.size)[1])


def write_table(rows: Mapping[int, Sequence[float]], form: Form) -> str:
    """Return the text of a file of this form, which `read_table` reads to the same values.

    Args:
        rows: The values of each frame that has any, by its number.
        form: Form of the file.
    """
    lines = ((str(frame), *(_text(float(value)) for value in rows[frame])) for frame in sorted(rows))
    return csv_text((form.columns, *lines))


def _text(value: float) -> str:
    """Return a number in the fewest digits that are exact."""
    return str(int(value)) if value.is_integer() else repr(value)


def read_table(
    path: Path, form: Form, first_frame: int | None = None
) -> tuple[dict[int, list[float]], tuple[str, ...]]:
    """Read a file of this form: values by frame, which count from the first one, and warnings, one sentence each.

    Raises:
        RefusedError: The file is missing, is not such a table, or has a wrong line.
    """
    name, data = path.name, content_of(path, LARGEST_FILE_BYTES)
    try:
        found, left_out = _table(read_cells(decode(data)), form)
    except RefusedError as error:
        raise RefusedError(f"{name}, {error}") from None
    if found is None:
        raise RefusedError(f"{name} lists no frames")
    if min(found, default=0) < (first_frame or 0):
        raise RefusedError(f"{name} has a frame {min(found)}, before the first one, {first_frame}")
    return {frame - (first_frame or 0): row for frame, row in found.items()}, (left_out,) if left_out else ()


def _table(table: Table, form: Form) -> tuple[dict[int, list[float]] | None, str]:
    """Return values by frame, None if no frame is listed, and what was left out, a sentence."""
    wanted = form.columns
    found: dict[int, list[float]] = {}
    seen: set[int] = set()
    repeated = 0
    columns = _columns(table.header, wanted)
    several = "object" in columns
    for line, row in table.rows:
        if len(row) <= max(columns[column] for column in wanted):
            raise RefusedError(f"line {line}: expected {len(columns)} values, got {len(row)}")
        texts = {column: row[columns[column]].strip() for column in wanted}
        frame = frame_in(line, texts["frame"])
        values = None
        if texts[wanted[1]]:
            values = [_number(line, column, texts[column], form) for column in wanted[1:]]
            if not form.allows(values):
                got = " and ".join(f"{length:g}" for length in form.lengths(values))
                raise RefusedError(f"line {line}: {' and '.join(form.positive)} must be above 0, got {got}")
        if frame in seen:
            if not several:
                raise RefusedError(f"line {line}: frame {frame} is listed twice; one {form.one} a frame")
            repeated += 1
            continue
        seen.add(frame)
        if values is not None:
            found[frame] = values
    left_out = f"It has several objects; further {form.several} of the same frames were left out ({repeated})."
    return found if seen else None, left_out if repeated else ""


def _columns(names: list[str], wanted: tuple[str, ...]) -> dict[str, int]:
    if not set(wanted) <= set(names):
        found = ", ".join(names)[:80] or "nothing"
        raise RefusedError(f"line 1: expected the columns {', '.join(wanted)}, got {found}")
    return {column: names.index(column) for column in (*wanted, "object") if column in names}


def _number(line: int, column: str, text: str, form: Form) -> float:
    value = number_in(line, column, text, unit=form.unit)
    if not abs(value) <= form.largest:
        raise RefusedError(f"line {line}: {column} must be a number of {form.unit}, got {text[:40]!r}")
    return value
