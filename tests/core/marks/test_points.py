"""Named points: read from files, checked against a picture, drawn, described to an editor."""

import json
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.source import Landmarks, Target
from pftrack.experiments.head.recording import FaceBox, FacePoints
from pftrack.vision.face import FEATURES, mean_model

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
    assert FacePoints.parse(str(tmp_path / name)).points == MARKS


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.json", "[1, 2]", "does not list points"),
        ("a.json", '{"nose": 3}', "does not list points"),
        ("a.json", "{", "does not list points"),
        ("a.csv", "nose,1,2\n", "lists no points"),
        ("a.csv", "name,x,y\nnose,one,2\n", "does not list points"),
        ("a.csv", "name,x,y\nnose,1,2\nnose,3,4\n", "nose is listed twice"),
        ("a.json", '{"nose": [NaN, 1]}', "mark.points.nose.0 must be"),
        ("a.json", "{}", "lists no points"),
    ],
)
def test_what_is_no_list_of_points_is_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    """The message names the file and what was wrong with it."""
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        FacePoints.parse(str(tmp_path / name))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """A file that is not there, or is a folder, is said to be so."""
    with pytest.raises(ValueError, match=r"the file .*none\.csv does not exist"):
        FacePoints.parse(str(tmp_path / "none.csv"))
    with pytest.raises(ValueError, match="cannot be read: Is a directory"):
        FacePoints.parse(str(tmp_path))


@given(content=st.binary(max_size=120), kind=st.sampled_from(["json", "csv"]))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes, kind: str) -> None:
    """Whatever a file holds, reading it ends in points or in a `ValueError`."""
    path = tmp_path_factory.mktemp("points") / f"points.{kind}"
    path.write_bytes((b"name,x,y\n" if kind == "csv" else b"") + content)
    with suppress(ValueError):
        FacePoints.parse(str(path))


def test_they_are_drawn_with_the_lines_between_them() -> None:
    """All points are drawn, and those lines of which both ends are marked."""
    drawn = FacePoints(points={"nose": (5, 6), "lmc": (7, 8), "lmou": (1, 2)}).draw()
    assert drawn["points"].positions[:, :2].tolist() == [[5, 6], [7, 8], [1, 2]]
    assert drawn["links"].segments[:, :, :2].tolist() == [[[5, 6], [7, 8]]]
    assert set(FacePoints(points={"nose": (5, 6)}).draw()) == {"points"}


def test_the_points_of_a_target_are_its_landmarks() -> None:
    """Those of the names that the kind knows; of a target without any there is no such mark."""
    names = ("nose", "tail", "leye")
    known = Landmarks(np.array([[1.5, 2.0], [9.0, 9.0], [3.0, 4.0]]), np.ones(3, np.bool_), np.zeros((3, 3)), names)
    mark = FacePoints.of_target(Target(np.zeros(3), landmarks=known))
    assert mark is not None
    assert mark.points == {"nose": (1.5, 2.0), "leye": (3.0, 4.0)}
    assert FacePoints.of_target(Target(np.zeros(2), 5.0)) is None
    assert FaceBox.of_target(Target(np.zeros(2), 5.0)) is None


def test_the_box_of_a_face_is_larger_than_its_features() -> None:
    """Hair, chin and ears are in it, and its middle is that of the features."""
    points = mean_model().points_mm[:, :2] * 2 + [300.0, 200.0]
    target = Target(np.zeros(3), landmarks=Landmarks(points, np.ones(11, np.bool_), np.zeros((11, 3)), FEATURES))
    box = FaceBox.of_target(target)
    assert box is not None
    low, high = points.min(axis=0), points.max(axis=0)
    assert box.width == box.height == pytest.approx(1.5 * (high - low).max())
    assert [box.x + box.width / 2, box.y + box.height / 2] == pytest.approx((low + high) / 2)
