"""Files that appear whole, and tables whose cells nothing computes."""

import re
from pathlib import Path
from unittest.mock import Mock

import pytest

from pftrack.core.files import csv_text, literal, part_of, read_source, read_text, settle, write_whole
from pftrack.core.refusal import RefusedError


def test_a_file_of_python_is_read_as_python_reads_it(tmp_path: Path) -> None:
    """By its byte order mark or its coding comment, whatever ends its lines; else it is refused by name."""
    path = tmp_path / "mine.py"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\nb = 2\r\n")
    assert read_source(path) == "a = 1\nb = 2\n"
    path.write_bytes(b"# -*- coding: latin-1 -*-\na = '\xe9'\n")
    assert read_source(path).endswith("a = 'é'\n")
    path.write_bytes(b"# -*- coding: none-such -*-\n")
    with pytest.raises(RefusedError, match=r"mine\.py cannot be read as Python"):
        read_source(path)


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has the new content, or on a full disk the old one, and nothing is left beside it."""
    path = tmp_path / "x"
    write_whole(path, b"old")
    write_whole(path, b"new")
    monkeypatch.setattr("os.fsync", Mock(side_effect=OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        write_whole(path, b"newer")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_parts_have_names_of_their_own(tmp_path: Path) -> None:
    """Two who write the same file at once do not write into each other's part; the last one settled is there."""
    path = tmp_path / "x.pft"
    parts = {part_of(path): b"first", part_of(path): b"second"}
    for part, content in parts.items():
        part.write_bytes(content)
    for part in reversed(parts):
        settle(part, path)
    assert path.read_bytes() == b"first"


def test_a_text_is_read_up_to_a_size(tmp_path: Path) -> None:
    """A mark of byte order is left out; a file that is larger, or not a text, is refused."""
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf" + b"a" * 1021)
    assert read_text(path, 1024) == "a" * 1021
    with pytest.raises(ValueError, match=r"^a\.txt is larger than the 0 KiB allowed$"):
        read_text(path, 1023)
    path.write_bytes(b"\xff\xfe\xfd")
    with pytest.raises(ValueError, match=r"^a\.txt is not a UTF-8 text file$"):
        read_text(path, 1024)


# Cells of tables: what a spreadsheet would compute is shown, and numbers stay numbers.

ROOT = Path(__file__).parents[2]
WRITERS = {
    "pftrack/core/files.py": "the one place",
    "pftrack/output/exports/files.py": "numbers alone, under names of letters",
    "pftrack/sweep/journal.py": "Arrow's, with its texts as `literal`",
    "pftrack/sources/results/writing.py": "numbers alone",
    "pftrack/sweep/work.py": "options of a command, no table",
    "server/pftrack_server/sessions/worker/codec.py": "messages within a drawing, no table",
}


COMPUTED = ['=HYPERLINK("http://a.example")', "+1+1", "-2+3", "@SUM(A1)", "\t=1", " =1", "\uff1d1", "-1 (cmd)"]


@pytest.mark.parametrize("text", [*COMPUTED, "left;=1", "a\n=1"])
def test_what_would_be_computed_is_shown(text: str) -> None:
    """An apostrophe stands before the character with which a formula begins, and nothing else changes."""
    shown = literal(text)
    assert shown.replace("'", "") == text
    assert not re.search(r"(^\s*|[;\t\r\n])[=+\-@\uff1d]", shown)


@pytest.mark.parametrize("text", ["", "nose", "-3", "+0.5", "-1.2e-07", "-inf", "-0.5 (-1 to +2)", "a=b", "a, -b"])
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
    assert found - {"pftrack/sources/decoder.py"} == WRITERS.keys()
