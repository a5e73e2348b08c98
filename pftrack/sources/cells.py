"""Tables as text: their separators, header and lines; errors name the line.

Cells are separated by commas, semicolons or tabs, whichever the header has most of; a comma within a cell separates
decimals. Names of columns are compared in small letters, with _ for spaces. Blank lines and comments, which begin with
#, are skipped; a comment before the first line of numbers may be the header.

All lines before the first with a number are the header. Among several lines the first counts, except lines with fewer
cells: the others are titles and units, as in the tables of TrackMate. If the last two lines repeat names, they are
joined, as in the tables of DeepLabCut: `nose, nose` above `x, y` become `nose_x, nose_y`.
"""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from pydantic import BaseModel, ConfigDict

from pftrack.core.refusal import RefusedError
from pftrack.core.texts import read_whole

LARGEST_FRAME = 10_000_000
MOST_COLUMNS = 16_384
"""The limit of a spreadsheet."""
LONGEST_HEADER = 12
"""Lines before the first number that may be its header."""
COMMENT = "#"
DELIMITERS = ",;\t"
SEPARATORS = re.compile(r"[,;\t]")
Reader: TypeAlias = Any
"""The reader of csv, whose type is not public."""
THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(,[0-9]{3})+")
"""In a table whose cells are separated by commas, a comma in quotes may separate thousands or decimals."""
POINTED = re.compile(r"[+-]?[0-9]{1,3}(\.[0-9]{3})+")
"""In a table whose decimals are separated by commas, a point may separate thousands or decimals."""
DECIMAL_COMMA = re.compile(r"[0-9],[0-9]")
PIXELS = re.compile(r"_*[\[(](px|pix|pixels?)[\])]")
"""Unit behind the name of a column."""
UNKNOWN = {"", "na", "n/a", "none", "null", "-"}
"""Cells without a number."""


class Asked(BaseModel):
    """A column of boxes.

    Attributes:
        asks: Question to the user.
        named: Names that programs use.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    asks: str
    named: tuple[str, ...]


class ColumnNames(BaseModel):
    """The declarations of `columns.yaml`, by meaning of a column.

    Attributes:
        boxes: Columns of a table of boxes.
        tracks: Names of the columns of a table of tracks.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    boxes: dict[str, Asked]
    tracks: dict[str, tuple[str, ...]]


COLUMN_NAMES = read_whole(ColumnNames, Path(__file__).with_name("columns.yaml"))
BOX_NAMES = {what: column.named for what, column in COLUMN_NAMES.boxes.items()}
"""Names that programs use for the columns of boxes; the first of several counts."""


def places_of(header: Sequence[str]) -> dict[str, int]:
    """Return the place of each column by name, the first of several; a list would take minutes for many columns."""
    return {name: place for place, name in reversed(tuple(enumerate(header)))}


def find_columns(places: Mapping[str, int], names: Mapping[str, Sequence[str]], prefix: str = "") -> dict[str, int]:
    """Return the places of the existing columns, by their meaning.

    Args:
        places: Places of all columns, as from `places_of`.
        names: Names that programs use, by meaning; the first name counts.
        prefix: Before each name.
    """
    found = {
        what: next((places[prefix + word] for word in words if prefix + word in places), None)
        for what, words in names.items()
    }
    return {what: place for what, place in found.items() if place is not None}


class Table(NamedTuple):
    """A table that is being read.

    Attributes:
        header: Names of the columns; empty if it has none.
        rows: Number of the line, from 1, and cells of each line after the header; may raise RefusedError.
        delimiter: Separator of the cells.
        start: Start of the lines after the header in the text.
    """

    header: list[str]
    rows: Iterator[tuple[int, list[str]]]
    delimiter: str
    start: int


def content_of(path: Path, most_bytes: int) -> bytes:
    """Return the content of a file.

    Raises:
        RefusedError: It cannot be read, or is larger than allowed.
    """
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except FileNotFoundError:
        raise RefusedError(f"the file {path} does not exist") from None
    except OSError as error:
        raise RefusedError(f"{path.name} cannot be read: {error.strerror}") from None
    if len(data) > most_bytes:
        raise RefusedError(f"{path.name} is larger than the {most_bytes // 1024**2} MiB allowed")
    return data


def decode(data: bytes) -> str:
    """Return text, by its mark of byte order, as UTF-8, or else as Windows has it in Western Europe."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return data.decode(encoding, "replace")
    if data[1:4:2] == b"\0\0" and b"\0" not in data[:4:2]:
        return data.decode("utf-16-le", "replace")  # as Windows writes it without a mark
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def read_table(text: str) -> Table:
    """Return the header of a table and its lines.

    Raises:
        RefusedError: It has more than `MOST_COLUMNS` columns.
    """
    lines = io.StringIO(text, newline="")
    head: list[str] = []
    comments: list[str] = []
    start = before = 0
    for line in lines:
        if line.startswith(COMMENT):
            comments.append(line.removeprefix(COMMENT).strip())
        elif len(head) == LONGEST_HEADER or _has_number(line):
            break
        elif bare := line.strip():
            head.append(bare)
        start += len(line)
        before += 1
    head = head or comments[-1:]
    widest = max(head, key=lambda line: max(map(line.count, DELIMITERS)), default="")
    delimiter = max(DELIMITERS, key=widest.count) if any(mark in widest for mark in DELIMITERS) else " "
    if (count := widest.count(delimiter) + 1) > MOST_COLUMNS:
        raise RefusedError(f"expected a table with at most {MOST_COLUMNS:,} columns, got {count:,}")
    header = _header([line for line in head if line.count(delimiter) + 1 == count], delimiter)
    lines.seek(start)
    separated = THOUSANDS if delimiter == "," or not DECIMAL_COMMA.search(text, start) else POINTED
    return Table(header, _rows(_cells(lines, delimiter), before, separated, len(header)), delimiter, start)


def _has_number(line: str) -> bool:
    if any(mark in line for mark in DELIMITERS):
        return any(is_number(cell.strip().strip('"')) for cell in SEPARATORS.split(line))
    return bool(line.strip()) and all(map(is_number, line.split()))


def _cells(lines: Iterable[str], delimiter: str) -> Reader:
    return csv.reader(lines, delimiter=delimiter, skipinitialspace=True)


def _header(lines: Sequence[str], delimiter: str) -> list[str]:
    """Return the names of the columns from these lines of equal length."""
    try:
        named = [[_name(cell) for cell in cells] for cells in _cells(lines, delimiter)]
    except csv.Error:
        return []
    if len(named) > 1 and all(map(_repeats, named[-2:])):
        return ["frame", *(f"{above}_{name}" for above, name in zip(named[-2][1:], named[-1][1:], strict=False))]
    return named[0] if named else []


def _repeats(names: Iterable[str]) -> bool:
    known = [name for name in names if name]
    return len(set(known)) < len(known)


def _name(cell: str) -> str:
    return PIXELS.sub("", cell.strip().strip("\ufeff").lower().replace(" ", "_"))


def _rows(lines: Reader, before: int, separated: re.Pattern[str], count: int) -> Iterator[tuple[int, list[str]]]:
    try:
        for cells in lines:
            if any(cell.strip() for cell in cells) and not cells[0].startswith(COMMENT):
                line = before + lines.line_num
                refuse_two_readings(line, cells, separated)
                if count and any(map(str.strip, cells[count:])):
                    more = f"line {line}: expected {count} values, got {len(cells)}"
                    raise RefusedError(f"{more}; name every column, and put cells that hold a comma in quotes")
                yield line, cells
    except csv.Error as error:
        raise RefusedError(f"the table cannot be read ({error})") from None


def refuse_two_readings(line: int, cells: Iterable[str], separated: re.Pattern[str]) -> None:
    """Refuse a number in which a mark may separate thousands or decimals.

    Raises:
        RefusedError: A cell is one; the sentence names the line.
    """
    if found := next(filter(separated.fullmatch, map(str.strip, cells)), None):
        raise RefusedError(f"line {line}: {found} can be read in two ways; write it without thousands and with a point")


def lines_of(text: str) -> Iterator[tuple[int, str]]:
    """Yield number, from 1, and content of each line that is not blank and not a comment."""
    for number, line in enumerate(text.splitlines(), 1):
        if (bare := line.strip()) and not bare.startswith(COMMENT):
            yield number, bare


def cells_of(line: str) -> list[str]:
    """Return the cells of a line of numbers without a header; a separator at its end adds none.

    They are separated by semicolons or tabs. Without these, commas separate them; but if spaces separate cells and no
    comma is next to a space, commas separate decimals.
    """
    bare = line.strip()
    delimiter = next((mark for mark in ";\t" if mark in bare), None)
    if delimiter is None:
        cells = bare.split()
        spaced = len(cells) > 1 and not any(cell.startswith(",") or cell.endswith(",") for cell in cells)
        if spaced or "," not in bare:
            return cells
        delimiter = ","
    return [cell.strip() for cell in bare.removesuffix(delimiter).split(delimiter)]


def check_decimals(text: str) -> None:
    """Refuse lines of numbers in which a point may separate thousands, since commas separate decimals elsewhere.

    Raises:
        RefusedError: There is one; the sentence names it.
    """
    rows = [(number, cells_of(line)) for number, line in lines_of(text)]
    if any("," in cell for _, row in rows for cell in row):
        for number, row in rows:
            refuse_two_readings(number, row, POINTED)


def frame_in(line: int, text: str) -> int:
    """Return the number of a frame.

    Raises:
        RefusedError: It is not a whole number within bounds.
    """
    try:
        number = float(text)
        frame = int(number)
    except (ValueError, OverflowError):
        frame, number = -1, 0.0
    if frame != number or not 0 <= frame <= LARGEST_FRAME:
        raise RefusedError(
            f"line {line}: frame must be a whole number from 0 to {LARGEST_FRAME:,}, got {text.strip()[:40]!r}"
        )
    return frame


def number_in(line: int, what: str, text: str, *, unit: str = "") -> float:
    """Return a number, NaN for a cell without one; a comma in a cell separates decimals.

    Raises:
        RefusedError: It is another text.
    """
    bare = text.strip()
    if bare.lower() in UNKNOWN:
        return math.nan
    try:
        return number_of(bare)
    except ValueError:
        raise RefusedError(f"line {line}: {what} must be a number{unit and f' of {unit}'}, got {bare[:40]!r}") from None


def number_of(text: str) -> float:
    """Return the number in a cell; a comma separates decimals.

    Raises:
        ValueError: There is none, or it has a comma and a point.
    """
    return float(text if "." in text else text.replace(",", ".", 1))


def is_number(text: str) -> bool:
    """Return whether a cell has a number."""
    try:
        number_of(text)
    except ValueError:
        return False
    return True
