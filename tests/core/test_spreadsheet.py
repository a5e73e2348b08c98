"""Cells of tables: what a spreadsheet would compute is shown, and numbers stay numbers."""

import re
from pathlib import Path

import pytest

from pftrack.core.files import csv_text, literal

ROOT = Path(__file__).parents[2]
WRITERS = {
    "pftrack/core/files.py": "the one place",
    "pftrack/output/exports/files.py": "numbers alone, under names of letters",
    "pftrack/sweep/journal.py": "Arrow's, with its texts as `literal`",
    "pftrack/sources/results/writing.py": "numbers alone",
    "pftrack/sweep/work.py": "options of a command, no table",
    "server/pftrack_server/sessions/worker/codec.py": "messages within a drawing, no table",
}


@pytest.mark.parametrize(
    "text",
    [
        '=HYPERLINK("http://a.example")',
        "+1+1",
        "-2+3",
        "@SUM(A1)",
        "\t=1",
        " =1",
        "\uff1d1",
        "-1 (cmd)",
        "left;=1",
        "a\n=1",
    ],
)
def test_what_would_be_computed_is_shown(text: str) -> None:
    """An apostrophe stands before the character with which a formula begins, and nothing else changes."""
    shown = literal(text)
    assert shown.replace("'", "") == text
    assert not re.search(r"(^\s*|[;\t\r\n])[=+\-@\uff1d]", shown)


@pytest.mark.parametrize(
    "text", ["", "nose", "-3", "+0.5", "-1.2e-07", "-inf", "-0.5 (-1 to +2)", "a=b", "1/2", "a, -b"]
)
def test_other_texts_and_numbers_stay(text: str) -> None:
    """A sign makes no formula of a number, nor of one with its interval."""
    assert literal(text) == text


def test_a_table_is_quoted_where_it_must_be() -> None:
    """Names that hold the separator come back whole."""
    assert csv_text([("a", "b"), ('x, "y"', "=1"), ()]) == 'a,b\n"x, ""y""",\'=1\n\n'


def test_tables_are_written_in_one_place() -> None:
    """Whatever writes CSV goes through it, or is named here with the reason."""
    found = {
        str(path.relative_to(ROOT))
        for room in ("pftrack", "server")
        for path in (ROOT / room).rglob("*.py")
        if re.search(r"csv\.writer|DictWriter|CSVWriter|write_csv|\",\"\.join", path.read_text(encoding="utf-8"))
    }
    assert found - {"pftrack/sources/video.py"} == WRITERS.keys()
