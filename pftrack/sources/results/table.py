"""The content of a file of results: boxes by frame and target; and tables of boxes with a header (CSV).

Columns of a table are found by the names that programs use, or as the user states.
"""

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

from pftrack.core.refusal import RefusedError
from pftrack.sources import cells
from pftrack.sources.limits import HEAD_BYTES

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
LARGEST_NUMBER = 1_000_000
FURTHEST_PX = 1e6
PLACES_SHOWN = 5
"""Boxes without an area whose lines a message names, at most."""


class Box(NamedTuple):
    """A box in a frame.

    Attributes:
        frame: Its number, from 0.
        target: Number of the target.
        x: Left edge, px; the first pixel begins at 0.
        y: Upper edge, px.
        w: Width, px.
        h: Height, px.
        score: The tracker's confidence; NaN if not given.
        label: Name of the target; empty if not given.
    """

    frame: int
    target: int
    x: float
    y: float
    w: float
    h: float
    score: float = math.nan
    label: str = ""


@dataclass(frozen=True)
class ResultTable:
    """The content of a file of results.

    Attributes:
        form: Form of the file.
        boxes: By ascending frame and target, one of a target in a frame.
        frames: Number of its frames, including those without a box.
        remarks: Remarks on reading and on skipped parts, a sentence each.
    """

    form: Form
    boxes: tuple[Box, ...]
    frames: int
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
    form: Form, boxes: Iterable[tuple[str, Box]], *, remarks: Iterable[str] = (), frames: int = 0
) -> ResultTable:
    """Return the table of boxes; boxes without an area, or not finite, are left out and reported.

    Args:
        form: Form of the file.
        boxes: Location of each in the file, such as "line 3", and the box.
        remarks: Remarks on reading, a sentence each.
        frames: Least number of frames in the file.

    Raises:
        RefusedError: There are none or too many, one lies outside every picture, a target has two in a frame, or all
            are shares of the picture's size.
    """
    found: dict[tuple[int, int], Box] = {}
    empty: list[str] = []
    for place, box in boxes:
        if not (0 <= box.frame <= cells.LARGEST_FRAME and 0 <= box.target <= LARGEST_NUMBER):
            raise RefusedError(
                f"{place}: frames count from 0 to {cells.LARGEST_FRAME:,} and targets to {LARGEST_NUMBER:,}; "
                f"got frame {box.frame} and target {box.target}"
            )
        sides = (box.x, box.y, box.w, box.h)
        if not all(math.isfinite(side) for side in sides) or box.w <= 0 or box.h <= 0:
            empty.append(place)
            continue
        if max(map(abs, sides)) > FURTHEST_PX:
            raise RefusedError(f"{place}: the box at {box.x:g}, {box.y:g} is outside every picture")
        if (box.frame, box.target) in found:
            raise RefusedError(f"{place}: target {box.target} has two boxes in frame {box.frame}; one is allowed")
        found[box.frame, box.target] = box
        if len(found) > MOST_BOXES:
            raise RefusedError(f"there are more than the {MOST_BOXES:,} boxes that are allowed")
    if not found:
        raise RefusedError(f"the {FORMS[form]} has no box with an area")
    # Pixels that count from 1 lie one further to the left, and a target may leave the picture.
    if all(max(box[4:6]) <= 1 and max(map(abs, box[2:4])) <= 2 for box in found.values()):
        raise RefusedError(
            "all boxes lie between 0 and 1: they are shares of the picture's size; multiply x and w by its width, "
            "y and h by its height"
        )
    told = [*remarks]
    if empty:
        more = f" and {len(empty) - PLACES_SHOWN:,} more" if len(empty) > PLACES_SHOWN else ""
        told.append(f"No box with an area: {', '.join(empty[:PLACES_SHOWN])}{more}.")
    ordered = tuple(found[key] for key in sorted(found))
    return ResultTable(form, ordered, max(frames, ordered[-1].frame + 1), tuple(told))


@dataclass(frozen=True)
class ColumnMeaning:
    """Possible meanings of a column in a table of boxes; the title is the question to the user."""

    name: str
    title: str


MEANINGS = tuple(ColumnMeaning(what, column.asks) for what, column in cells.COLUMN_NAMES.boxes.items())

# Edges come first: next to edges, width and height may be those of the picture.
WAYS = (("x", "y", "right", "bottom"), ("x", "y", "w", "h"), ("centre_x", "centre_y", "w", "h"))
FEWEST_COLUMNS = 5
"""A frame and four numbers of a box."""
ROWS_SHOWN = 4


@dataclass(frozen=True)
class Preview:
    """Excerpt of a table that lets a user name its columns.

    Attributes:
        header: Names of its columns.
        rows: The first lines after it.
        guess: Place of the column of each meaning, as far as names show it.
        meanings: All that columns may mean.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    guess: Mapping[str, int]
    meanings: tuple[ColumnMeaning, ...]


def columns_in(header: Sequence[str]) -> dict[str, int] | None:
    """Return the columns by meaning; None if these are not columns of boxes."""
    places = cells.places_of(header)
    found = cells.find_columns(places, cells.BOX_NAMES)
    if "frame" not in found or {"x3", "y3"} <= places.keys() or not any(set(way) <= found.keys() for way in WAYS):
        polygon = "frame" in found and {"x1", "y1", "x2", "y2", "x3", "y3"} <= places.keys()
        return {"frame": found["frame"]} if polygon else None
    return found


def read_csv(data: bytes, first_frame: int | None = None) -> ResultTable:
    """Read a table.

    Args:
        data: Its content.
        first_frame: Number of its first frame, by default 0.

    Raises:
        RefusedError: It has other columns, or a line of it is wrong.
    """
    table = cells.read_table(cells.decode(data))
    header = table.header
    columns = columns_in(header)
    if columns is None:
        got = ", ".join(header)[:80] or "numbers without names"
        raise RefusedError(f"expected columns such as frame, id, x, y, w, h, got {got}")
    corners = {name: place for place, name in enumerate(header) if name[:1] in {"x", "y"} and name[1:].isdecimal()}
    rows = []
    for line, row in table.rows:
        if len(row) < len(header):
            raise RefusedError(f"line {line}: expected {len(header)} values, got {len(row)}")
        rows.append((line, row))
    if not rows:
        raise RefusedError("the table lists no frames")
    frames = [cells.frame_in(line, row[columns["frame"]]) - (first_frame or 0) for line, row in rows]
    targets = (
        _targets([row[columns["target"]].strip() for _, row in rows]) if "target" in columns else [(1, "")] * len(rows)
    )
    boxes = []
    for (line, row), frame, (target, label) in zip(rows, frames, targets, strict=True):
        sides = _sides(line, row, columns, corners if len(columns) == 1 else {})
        score = cells.number_in(line, "score", row[columns["score"]]) if "score" in columns else math.nan
        boxes.append((f"line {line}", Box(frame, target, *sides, score, label)))
    told = []
    if first_frame is None and min(frames) == 1:
        told.append("Its frames were taken to count from 0, and begin at 1; say so if the first frame is 1.")
    return table_of("csv", boxes, remarks=told)


def _targets(texts: Sequence[str]) -> list[tuple[int, str]]:
    """Return number and name of each line's target; names are numbered by appearance, unless all are numbers."""
    try:
        numbers = [cells.number_of(text) for text in texts]
    except ValueError:
        numbers = [math.nan]
    if all(number.is_integer() for number in numbers):
        return [(int(number), "") for number in numbers]
    places = {text: place for place, text in enumerate(dict.fromkeys(texts), start=1)}
    return [(places[text], text[:80]) for text in texts]


def _sides(
    line: int, row: Sequence[str], columns: Mapping[str, int], corners: Mapping[str, int]
) -> tuple[float, float, float, float]:
    """Return x, y, w, h of a line; NaN if its cells are empty."""
    way = next((way for way in WAYS if set(way) <= columns.keys()), ())
    named = [(what, row[place]) for what, place in (corners or {what: columns[what] for what in way}).items()]
    numbers = [cells.number_in(line, what, text, unit="px") for what, text in named]
    if all(map(math.isnan, numbers)):
        return math.nan, math.nan, math.nan, math.nan
    for number, (what, text) in zip(numbers, named, strict=True):
        if not math.isfinite(number):
            raise RefusedError(f"line {line}: {what} must be a number of px, got {text.strip()[:40]!r}")
    if corners:
        return around(numbers)
    first, second, third, fourth = numbers
    if "right" in way:
        return first, second, third - first, fourth - second
    if "centre_x" in way:
        return first - third / 2, second - fourth / 2, third, fourth
    return first, second, third, fourth


def preview(text: str) -> Preview:
    """Return an excerpt of a table that lets a user name its columns.

    Args:
        text: Its beginning.

    Raises:
        RefusedError: It is not a table, or has too few columns.
    """
    table = cells.read_table(text)
    header = table.header
    if len(header) < FEWEST_COLUMNS or not any(header):
        raise RefusedError(f"expected a table with {FEWEST_COLUMNS} columns or more, got {len(header)}", "text")
    rows = [tuple(row) for _, row in itertools.islice(table.rows, ROWS_SHOWN)]
    return Preview(tuple(header), tuple(rows), cells.find_columns(cells.places_of(header), cells.BOX_NAMES), MEANINGS)


def rename(data: bytes, columns: Mapping[str, int]) -> bytes:
    """Return a table whose columns are renamed to the meanings that the user gave.

    Args:
        data: The table.
        columns: Places of columns by meaning, such as {"frame": 0, "x": 3}.

    Raises:
        RefusedError: A column does not exist, or these columns do not make a box.
    """
    text = cells.decode(data)
    table = cells.read_table(text)
    count = len(table.header)
    unknown = [what for what, place in columns.items() if what not in cells.BOX_NAMES or not 0 <= place < count]
    if unknown:
        raise RefusedError(f"the table has no column for {', '.join(unknown)[:80]}; it has {count} columns")
    said = {place: what for what, place in columns.items()}
    renamed = [said.get(place, f"other_{place}") for place in range(len(table.header))]
    if columns_in(renamed) is None:
        raise RefusedError(
            "expected the frame, and of the box two edges or its middle, and its size or the other edges"
        )
    return f"{table.delimiter.join(renamed)}\n{text[table.start :]}".encode()


# Text of numbers only: MOTChallenge, OTB and VOT, distinguished by the number of values in a line.
#
# The beginning of a file of results shows its form.

MOT_TRUTH_COLUMNS = 9
"""Columns of the ground truth of MOT16 and later: ..., whether it counts, class, visibility."""
TWO_WAYS = (
    "its {0} whole numbers a line can be read in two ways, as {2} or decimals between commas; "
    "say that the form is {1}, or write the names of the columns above them"
)
MOT15_COLUMNS = 10
"""Columns of results, and of the ground truth of 2DMOT2015, where a flag replaces the score: whether a box counts."""


def numbers_of(line: str) -> list[float] | None:
    """Return the numbers of a line; None if it has other characters."""
    try:
        return [cells.number_of(cell) for cell in cells.cells_of(line)]
    except ValueError:
        return None


def form_of_lines(lines: Sequence[str]) -> Form | None:
    """Return the form of lines; None if they are not numbers in one of these forms."""
    rows = [numbers_of(line) for line in lines if line.strip() and not line.startswith(cells.COMMENT)]
    known = [row for row in rows if row is not None and len(row) > 1]
    # The reader names a broken line; most lines are complete, including the first one.
    if not known or rows[0] is None or 2 * rows.count(None) > len(rows):
        return None
    count = Counter(map(len, known)).most_common(1)[0][0]
    whole = [row for row in known if len(row) == count]
    counted = all(row[0] == int(row[0]) >= 0 and row[1] == int(row[1]) for row in whole if _finite(row[:2]))
    if count >= 6 and counted and all(_finite(row[:2]) for row in whole) and (count != 8 or _rises(whole)):
        return "mot"
    if count in {4, 8}:
        boxes = [row for row in whole if _finite(row) and any(row)]
        plain = count == 4 and all(value == int(value) >= 1 for row in boxes for value in row[:2])
        return "otb" if plain and all(row is None or len(row) > 1 for row in rows) else "vot"
    return None


def read_rows(data: bytes, form: Form, first_pixel: int | None = None, *, surely: bool = False) -> ResultTable:
    """Read OTB or VOT text, `surely` if the user says so: each line is a frame of the one target."""
    origin = first_pixel if first_pixel is not None else int(form == "otb")
    text = cells.decode(data)
    lines = list(cells.lines_of(text))
    if blank := next((n for n, line in enumerate(text.strip().splitlines(), lines[0][0]) if not line.strip()), None):
        raise RefusedError(f"line {blank} is blank, which may be a frame or not; write NaN,NaN,NaN,NaN, or take it out")
    corners = [numbers for _, line in lines if len(numbers := numbers_of(line) or []) == 8]
    if corners and not surely and "," in text and all(number.is_integer() for row in corners for number in row):
        raise RefusedError(TWO_WAYS.format(8, "vot", "corners"))
    boxes = []
    for frame, (number, line) in enumerate(lines):
        x, y, w, h = rectangle(f"line {number}", line)
        boxes.append((f"line {number}", Box(frame, 1, x - origin, y - origin, w, h)))
    guess = "Its first pixel was taken as {}; say so if it is {}."
    told = [] if first_pixel is not None else [guess.format(origin, 1 - origin)]
    if corners:
        told.append("Four corners were taken as the upright box around them.")
    return table_of(form, boxes, remarks=told, frames=len(lines))


def rectangle(place: str, line: str) -> tuple[float, float, float, float]:
    """Return x, y, w, h of a line with these or four corners; NaN for a single number, VOT's mark of a missing box.

    Raises:
        RefusedError: It has other numbers, or anything else; the sentence names the place.
    """
    numbers = numbers_of(line)
    if numbers is None:
        raise RefusedError(f"{place}: expected numbers, got {line.strip()[:40]!r}")
    if len(numbers) == 1:
        return math.nan, math.nan, math.nan, math.nan
    if len(numbers) == 4:
        return numbers[0], numbers[1], numbers[2], numbers[3]
    if len(numbers) == 8:
        return around(numbers)
    raise RefusedError(f"{place}: expected 4 numbers (x, y, w, h) or 8 (four corners), got {len(numbers)}")


def _mot_rows(text: str) -> Iterator[tuple[int, list[float]]]:
    """Yield line number and values of each line, all with as many values as the first."""
    wanted = range(6, MOT15_COLUMNS + 1)
    for number, line in cells.lines_of(text):
        numbers = numbers_of(line)
        if numbers is None or len(numbers) not in wanted or not _finite(numbers[:2]):
            many = f"{wanted[0]} to {wanted[-1]}" if len(wanted) > 1 else str(wanted[0])
            raise RefusedError(
                f"line {number}: expected {many} numbers, frame, id, x, y, w, h and more, got {len(numbers or '')} in "
                f"{line[:40]!r}"
            )
        wanted = range(len(numbers), len(numbers) + 1)
        yield number, numbers


def read_mot(
    data: bytes, first_frame: int | None = None, first_pixel: int | None = None, *, surely: bool = False
) -> ResultTable:
    """Read MOTChallenge text, `surely` if the user says so; ground-truth boxes that do not count are left out."""
    rows = list(_mot_rows(cells.decode(data)))
    if not surely and _reads_in_two_ways([row for _, row in rows]):
        raise RefusedError(TWO_WAYS.format(len(rows[0][1]), "mot", "results of MOTChallenge, corners"))
    told = []
    begin = first_frame
    if begin is None:
        begin = 0 if any(row[0] == 0 for _, row in rows) else 1
        told.append(f"Its first frame was taken as {begin}{', as there is a frame 0' if begin == 0 else ''}.")
    origin = 1 if first_pixel is None else first_pixel
    truth = _says_what_counts([row for _, row in rows])
    left_out = sum(row[6] == 0 for _, row in rows) if truth else 0
    if left_out:
        told.append(f"{left_out} boxes that the truth marks as not to be counted were left out.")
    boxes = []
    unnumbered = 0
    for number, row in rows:
        if truth and row[6] == 0:
            continue
        target = int(row[1])
        if target < 0:  # detections have -1
            unnumbered += 1
            target = unnumbered
        score = row[6] if len(row) > 6 and not truth and row[6] != -1 else math.nan
        box = Box(int(row[0]) - begin, target, row[2] - origin, row[3] - origin, row[4], row[5], score)
        boxes.append((f"line {number}", box))
    if unnumbered:
        told.append("Boxes without a target's number have one each: they are detections, not tracks.")
    return table_of("mot", boxes, remarks=told)


def _says_what_counts(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether column 7 flags the boxes that count, as ground truth does; truth of 2015 has 10 columns, too."""
    counts, flags = {len(row) for row in rows}, {row[6] for row in rows if len(row) > 6}
    return (counts == {MOT_TRUTH_COLUMNS} and flags <= {0.0, 1.0}) or (
        counts == {MOT15_COLUMNS} and flags == {0.0, 1.0}
    )


def _reads_in_two_ways(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether lines of whole numbers may hold corners, or decimals between commas: no score or flag is there."""
    if not 8 <= len(rows[0]) <= MOT15_COLUMNS or not all(row[6] > 1 and max(row[7:]) >= 0 for row in rows):
        return False
    return all(number.is_integer() for row in rows for number in row)


def _finite(numbers: Sequence[float]) -> bool:
    return all(map(math.isfinite, numbers))


def _rises(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether the first numbers are frames: from 0 or 1 on, and never far apart."""
    frames = [row[0] for row in rows]
    return min(frames) in {0.0, 1.0} and frames == sorted(frames)


def form_of(data: bytes) -> Form | None:
    """Return the form of a file by its beginning; None if it is not a file of results."""
    text = cells.decode(data[:HEAD_BYTES]).lstrip()
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
    return "csv" if lines and columns_in(cells.read_table(text).header) is not None else None
