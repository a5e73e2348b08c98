"""Tables as CSV that a spreadsheet shows and does not compute.

Names in tables come from files of anybody. A spreadsheet takes a cell that begins with one of a few characters for a
formula, which may ask other machines and read other cells. So an apostrophe stands before such a text: a spreadsheet
shows what follows it, and other programs see it. Numbers stay as they are, whatever their sign.
"""

import csv
import io
import re
from collections.abc import Iterable
from typing import Final

__all__ = ["csv_text", "literal"]

BEGINNING: Final = re.compile(r"(^\s*|[;\t\r\n])(?=[=+\-@＝＋－＠])")  # noqa: RUF001 - wide forms stand for the others
"""Where a formula begins: with the cell, or where a spreadsheet of another language cuts it."""
FIGURE: Final = r"[-+]?[\d.,]+(?:e[-+]?\d+)?"
NUMBERS: Final = re.compile(rf"(?:{FIGURE}|[-+]?(?:inf|nan))(?: \({FIGURE} to {FIGURE}\))?")
"""A number, and one with its interval."""


def literal(text: str) -> str:
    """Return the text of a cell that every spreadsheet shows as it is."""
    return text if NUMBERS.fullmatch(text) else BEGINNING.sub(r"\1'", text)


def csv_text(rows: Iterable[Iterable[str]]) -> str:
    """Return rows of cells as CSV, quoted where needed."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([literal(cell) for cell in row] for row in rows)
    return file.getvalue()
