"""Text of nothing but numbers: MOTChallenge, OTB and VOT, told apart by how many there are in a line.

Which form a file of results has is told by its beginning.
"""

import math
import re
from collections.abc import Sequence

from pftrack.sources.cells import decode, read_table
from pftrack.sources.limits import HEAD_BYTES, SourceError
from pftrack.sources.results.table import Box, Form, ResultTable, around, columns_in, table_of

SEPARATORS = re.compile(r"[,;\s]+")
MOT_TRUTH_COLUMNS = 9
"""Of the ground truth of MOT16 and later: ..., whether it counts, class, visibility."""


def numbers_of(line: str) -> list[float] | None:
    """Return the numbers of a line, by commas, semicolons, tabs or spaces; None if it has anything else."""
    try:
        return [float(part) for part in SEPARATORS.split(line.strip()) if part]
    except ValueError:
        return None


def form_of_lines(lines: Sequence[str]) -> Form | None:
    """Return what lines are; None if they are not text of numbers in one of these forms."""
    rows = [numbers_of(line) for line in lines if line.strip()]
    if not rows or any(row is None for row in rows):
        return None
    known = [row for row in rows if row is not None and len(row) > 1]
    counts = {len(row) for row in known}
    if not known or len(counts) > 2:
        return None
    whole = all(row[0] == int(row[0]) >= 0 and row[1] == int(row[1]) for row in known if _finite(row[:2]))
    if (
        min(counts) >= 6
        and whole
        and all(map(_finite, (row[:2] for row in known)))
        and (8 not in counts or _rises(known))
    ):
        return "mot"
    if counts <= {4, 8}:
        plain = counts == {4} and all(value == int(value) >= 1 for row in known if _finite(row) for value in row[:2])
        return "otb" if plain and len(known) == len(rows) else "vot"
    return None


def read_rows(data: bytes, form: Form, first_pixel: int | None = None) -> ResultTable:
    """Read OTB or VOT text: a line is a frame of the one target."""
    origin = first_pixel if first_pixel is not None else int(form == "otb")
    lines = [line for line in decode(data).splitlines() if line.strip()]
    boxes = []
    for frame, line in enumerate(lines):
        x, y, w, h = rectangle(f"line {frame + 1}", line)
        boxes.append(Box(frame, 1, x - origin, y - origin, w, h))
    guess = "Its first pixel was taken as {}; say so if it is {}."
    told = [] if first_pixel is not None else [guess.format(origin, 1 - origin)]
    return table_of(form, boxes, remarks=told, frames=len(lines))


def rectangle(place: str, line: str) -> tuple[float, float, float, float]:
    """Return x, y, w, h of a line with these or four corners; NaN for one number, with which VOT says that none is.

    Raises:
        SourceError: It has other numbers, or anything else; the sentence names the place.
    """
    numbers = numbers_of(line)
    if numbers is None:
        raise SourceError(f"{place}: expected numbers, got {line.strip()[:40]!r}")
    if len(numbers) == 1:
        return math.nan, math.nan, math.nan, math.nan
    if len(numbers) == 4:
        return numbers[0], numbers[1], numbers[2], numbers[3]
    if len(numbers) == 8:
        return around(numbers)
    raise SourceError(f"{place}: expected 4 numbers (x, y, w, h) or 8 (four corners), got {len(numbers)}")


def read_mot(data: bytes, first_frame: int | None = None, first_pixel: int | None = None) -> ResultTable:
    """Read MOTChallenge text; of ground truth, what does not count is left out."""
    rows: list[list[float]] = []
    for number, line in enumerate(decode(data).splitlines(), 1):
        if not line.strip():
            continue
        numbers = numbers_of(line)
        if numbers is None or len(numbers) < 6 or not _finite(numbers[:2]):
            raise SourceError(f"line {number}: expected frame, id, x, y, w, h and more, got {line.strip()[:40]!r}")
        rows.append(numbers)
    told = []
    begin = first_frame
    if begin is None:
        begin = 0 if any(row[0] == 0 for row in rows) else 1
        told.append(f"Its first frame was taken as {begin}{', as there is a frame 0' if begin == 0 else ''}.")
    origin = 1 if first_pixel is None else first_pixel
    truth = bool(rows) and all(len(row) == MOT_TRUTH_COLUMNS for row in rows)
    left_out = sum(row[6] == 0 for row in rows) if truth else 0
    if left_out:
        told.append(f"{left_out} boxes that the truth marks as not to be counted were left out.")
    boxes = []
    unnumbered = 0
    for row in rows:
        if truth and row[6] == 0:
            continue
        target = int(row[1])
        if target < 0:  # detections have -1
            unnumbered += 1
            target = unnumbered
        score = row[6] if len(row) > 6 and not truth and row[6] != -1 else math.nan
        boxes.append(Box(int(row[0]) - begin, target, row[2] - origin, row[3] - origin, row[4], row[5], score))
    if unnumbered:
        told.append("Boxes without a target's number have one each: they are detections, not tracks.")
    return table_of("mot", boxes, remarks=told)


def _finite(numbers: Sequence[float]) -> bool:
    return all(map(math.isfinite, numbers))


def _rises(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether the first numbers are those of frames: from 0 or 1 on, and never far apart."""
    frames = [row[0] for row in rows]
    return min(frames) in {0.0, 1.0} and frames == sorted(frames)


def form_of(data: bytes) -> Form | None:
    """Return the form of a file by its beginning; None if it is none of results."""
    text = decode(data[:HEAD_BYTES]).lstrip()
    if not text.isprintable() and any(ord(letter) < 32 and not letter.isspace() for letter in text):
        return None  # no text
    if text.startswith("<"):
        return "cvat" if "<annotations" in text else None
    if text.startswith(("{", "[")):
        return (
            "coco" if any(f'"{name}"' in text for name in ("images", "annotations", "bbox", "info", "videos")) else None
        )
    lines = text.splitlines()
    # The last line of a beginning may be cut short.
    whole = lines[:-1] if len(data) >= HEAD_BYTES and len(lines) > 1 else lines
    if (found := form_of_lines(whole)) is not None:
        return found
    return "csv" if lines and columns_in(read_table(text).header) is not None else None
