"""Truth for recorded clips: a table of boxes drawn by hand, one a frame.

The file is comma-separated text with a header that names at least `frame, x, y, w, h`: the frame's number from 0, the
left and upper edge of the box and its width and height, in px of the picture. Further columns are ignored. A frame that
is not listed, or whose `x` is empty, is a frame without truth: it counts neither for the tracker nor against it.
"""

import csv
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TextIO

import numpy as np

from pftrack.frame import Target

__all__ = ["TruthError", "TruthTable", "read_truth"]

COLUMNS = ("frame", "x", "y", "w", "h")
LARGEST_FILE_BYTES = 16 * 1024 * 1024
LARGEST_FRAME = 10_000_000
LARGEST_PX = 100_000.0


class TruthError(ValueError):
    """A table of truth that cannot be read; the message names the line and what is allowed."""


@dataclass(frozen=True)
class TruthTable:
    """The true boxes of a clip.

    Attributes:
        boxes: (x, y, w, h) in px by frame number; a frame without truth is missing.
        warnings: What was passed over in reading, one sentence each.
    """

    boxes: Mapping[int, tuple[float, float, float, float]]
    warnings: tuple[str, ...] = field(default=())

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame of the clip, or None where there is no truth.

        A box covers whole pixels and positions count from the centre of the first pixel, so the centre of a box of `w`
        pixels lies (w - 1) / 2 to the right of its first one.
        """
        box = self.boxes.get(frame)
        if box is None:
            return None
        x, y, w, h = box
        return Target(position=np.array([x + (w - 1) / 2, y + (h - 1) / 2]), size=max(w, h))


def read_truth(path: Path) -> TruthTable:
    """Read a table of true boxes.

    Args:
        path: A comma-separated file with the columns frame, x, y, w, h and any others.

    Raises:
        TruthError: The file is missing, is no such table, or a line of it is wrong.
    """
    name = path.name
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise TruthError(f"{name} is larger than the {LARGEST_FILE_BYTES // 1024**2} MiB allowed")
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _table(name, file)
    except FileNotFoundError:
        raise TruthError(f"there is no file {path}") from None
    except OSError as error:
        raise TruthError(f"{path} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error):
        raise TruthError(f"{name} is not comma-separated text with the columns {', '.join(COLUMNS)}") from None


def _table(name: str, file: TextIO) -> TruthTable:
    boxes: dict[int, tuple[float, float, float, float]] = {}
    seen: set[int] = set()
    repeated = 0
    rows = csv.reader(file)
    columns = _columns(name, next(rows, []))
    several = "object" in columns
    for line, row in _filled(rows):
        if len(row) <= max(columns[column] for column in COLUMNS):
            raise TruthError(f"{name}, line {line}: expected {len(columns)} values, got {len(row)}")
        frame, box = _row(f"{name}, line {line}", {column: row[index].strip() for column, index in columns.items()})
        if frame in seen:
            if not several:
                raise TruthError(f"{name}, line {line}: frame {frame} is listed twice; one box a frame")
            repeated += 1
            continue
        seen.add(frame)
        if box is not None:
            boxes[frame] = box
    if not seen:
        raise TruthError(f"{name} lists no frames")
    left_out = f"{name} has several objects; further boxes of the same frames were left out ({repeated})"
    return TruthTable(MappingProxyType(boxes), (left_out,) if repeated else ())


def _columns(name: str, header: list[str]) -> dict[str, int]:
    names = [column.strip().lower() for column in header]
    missing = [column for column in COLUMNS if column not in names]
    if missing:
        found = ", ".join(names)[:80] or "nothing"
        raise TruthError(f"{name}, line 1: expected the columns {', '.join(COLUMNS)}, got {found}")
    return {column: names.index(column) for column in (*COLUMNS, "object") if column in names}


def _filled(rows: Iterator[list[str]]) -> Iterator[tuple[int, list[str]]]:
    return ((line, row) for line, row in enumerate(rows, start=2) if any(value.strip() for value in row))


def _row(place: str, row: dict[str, str]) -> tuple[int, tuple[float, float, float, float] | None]:
    try:
        frame = int(row["frame"])
    except ValueError:
        frame = -1
    if not 0 <= frame <= LARGEST_FRAME:
        raise TruthError(f"{place}: frame must be a whole number from 0 on, got {row['frame'][:40]!r}")
    if not row["x"]:
        return frame, None
    x, y, w, h = (_number(place, column, row[column]) for column in ("x", "y", "w", "h"))
    if w <= 0 or h <= 0:
        raise TruthError(f"{place}: w and h must be above 0, got {w:g} and {h:g}")
    return frame, (x, y, w, h)


def _number(place: str, column: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST_PX:
        raise TruthError(f"{place}: {column} must be a number of px, got {text[:40]!r}")
    return value
