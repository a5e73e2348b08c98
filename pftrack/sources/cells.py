"""Tables as text: how a program saved one, its header, and its lines; what is wrong is told by line.

Cells are separated by commas, semicolons or tabs, whichever the first line has most of. Names of columns are compared
in small letters, with _ for spaces. Blank lines are passed over.
"""

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict

from pftrack.core.refusal import RefusedError
from pftrack.core.texts import read_whole

LARGEST_FRAME = 10_000_000
MOST_COLUMNS = 16_384
"""As many as a spreadsheet can have."""
UNKNOWN = {"", "na", "n/a", "none", "null", "-"}
"""Cells without a number."""


class Asked(BaseModel):
    """A column of boxes.

    Attributes:
        asks: What a person is asked.
        named: How programs name it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    asks: str
    named: tuple[str, ...]


class ColumnNames(BaseModel):
    """What `columns.yaml` declares, by what a column is.

    Attributes:
        boxes: Columns of a table of boxes.
        tracks: Names of the columns of a table of tracks.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    boxes: dict[str, Asked]
    tracks: dict[str, tuple[str, ...]]


COLUMN_NAMES = read_whole(ColumnNames, Path(__file__).with_name("columns.yaml"))
BOX_NAMES = {what: column.named for what, column in COLUMN_NAMES.boxes.items()}
"""How programs name the columns of boxes; the first name of several counts."""


def places_of(header: Sequence[str]) -> dict[str, int]:
    """Return where each column is, by name, the first of several; a list takes minutes where there are many."""
    return {name: place for place, name in reversed(tuple(enumerate(header)))}


def find_columns(places: Mapping[str, int], names: Mapping[str, Sequence[str]], prefix: str = "") -> dict[str, int]:
    """Return where columns are, by what they are, of those that there are.

    Args:
        places: Of all columns, as of `places_of`.
        names: How programs name them, by what they are; the first name counts.
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
        header: Names of the columns.
        rows: Number of the line, from 1, and cells of each line after the header; may raise RefusedError.
        delimiter: What separates the cells.
    """

    header: list[str]
    rows: Iterator[tuple[int, list[str]]]
    delimiter: str


def decode(data: bytes) -> str:
    """Return text, by its mark of byte order, as UTF-8, or else as Windows has it in Western Europe."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return data.decode(encoding, "replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def delimiter_of(line: str) -> str:
    """Return what separates the cells of a table's header: the most frequent of comma, semicolon and tab."""
    return max(",;\t", key=line.count)


def read_table(text: str) -> Table:
    """Return the header of a table and its lines; no names if the header is not one.

    Raises:
        RefusedError: It has more than `MOST_COLUMNS` columns.
    """
    first = text.partition("\n")[0]
    delimiter = delimiter_of(first)
    if (count := first.count(delimiter) + 1) > MOST_COLUMNS:
        raise RefusedError(f"expected a table with at most {MOST_COLUMNS:,} columns, got {count:,}")
    lines = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    try:
        names = next(lines, [])
    except csv.Error:
        names = []
    header = [name.strip().strip("\ufeff").lower().replace(" ", "_") for name in names]
    return Table(header, _rows(lines), delimiter)


def _rows(lines: Iterator[list[str]]) -> Iterator[tuple[int, list[str]]]:
    try:
        for line, cells in enumerate(lines, start=2):
            if any(cell.strip() for cell in cells):
                yield line, cells
    except csv.Error as error:
        raise RefusedError(f"the table cannot be read ({error})") from None


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


def number_in(line: int, what: str, text: str, *, unit: str = "", delimiter: str = ",") -> float:
    """Return a number, NaN for a cell without one; where commas do not separate cells, they may separate decimals.

    Raises:
        RefusedError: It is another text.
    """
    bare = text.strip()
    if bare.lower() in UNKNOWN:
        return math.nan
    try:
        return float(bare if delimiter == "," else bare.replace(",", "."))
    except ValueError:
        raise RefusedError(f"line {line}: {what} must be a number{unit and f' of {unit}'}, got {bare[:40]!r}") from None
