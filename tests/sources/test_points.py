import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.sources.points import PointsError, read_points

MARKS = {"nose": (203.5, 148.0), "leye": (230.0, 120.0)}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.json", json.dumps(MARKS)),
        ("b.JSON", json.dumps([{"name": name, "x": x, "y": y} for name, (x, y) in MARKS.items()])),
        ("c.csv", "name,x,y\nnose,203.5,148\nleye, 230, 120\n"),
        ("d.csv", "y,note,name,x\n148,,nose,203.5\n120,?,leye,230\n"),
    ],
)
def test_points_are_read_from_json_and_tables(tmp_path: Path, name: str, text: str) -> None:
    """Both forms of JSON and a table with columns in any order give the same points."""
    (tmp_path / name).write_text(text)
    assert read_points(tmp_path / name) == MARKS


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.json", "[1, 2]", "does not list points"),
        ("a.json", '{"nose": 3}', "does not list points"),
        ("a.json", "{", "does not list points"),
        ("a.csv", "nose,1,2\n", "lists no points"),
        ("a.csv", "name,x,y\nnose,one,2\n", "does not list points"),
        ("a.csv", "name,x,y\nnose,1,2\nnose,3,4\n", "nose is listed twice"),
        ("a.json", '{"nose": [NaN, 1]}', "nose must be at two finite numbers"),
        ("a.json", "{}", "lists no points"),
    ],
)
def test_what_is_no_list_of_points_is_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    """The message names the file and what was wrong with it."""
    (tmp_path / name).write_text(text)
    with pytest.raises(PointsError, match=message) as caught:
        read_points(tmp_path / name)
    assert name in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """A file that is not there, or is a folder, is said to be so."""
    with pytest.raises(PointsError, match=r"there is no file .*none\.csv"):
        read_points(tmp_path / "none.csv")
    with pytest.raises(PointsError, match="cannot be read: Is a directory"):
        read_points(tmp_path)


@given(content=st.binary(max_size=120), kind=st.sampled_from(["json", "csv"]))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes, kind: str) -> None:
    """Whatever a file holds, reading it ends in points or in a `PointsError`."""
    path = tmp_path_factory.mktemp("points") / f"points.{kind}"
    path.write_bytes((b"name,x,y\n" if kind == "csv" else b"") + content)
    with suppress(PointsError):
        read_points(path)
