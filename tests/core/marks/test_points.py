"""Marks: boxes, long bodies and named points are read, checked against a picture and drawn."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.marks import Box, LongBody, read_mark
from pftrack.core.model.source import Landmarks, Target
from pftrack.core.refusal import ParameterError
from pftrack.experiments.head.recording import FaceBox, FacePoints

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
        ("a.json", "{", "does not list points"),
        ("a.csv", "nose,1,2\n", "lists no points"),
        ("a.csv", "name,x,y\nnose,one,2\n", "does not list points"),
        ("a.csv", "name,x,y\nnose,1,2\nnose,3,4\n", "nose is listed twice"),
        ("a.json", '{"nose": [NaN, 1]}', "mark.points.nose.0 must be"),
        ("none.csv", None, r"the file .*none\.csv does not exist"),
        ("", None, "cannot be read: Is a directory"),
    ],
)
def test_what_is_no_list_of_points_is_refused(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    """The message names the file and what was wrong with it, also if it is not there, or a folder."""
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        FacePoints.parse(str(tmp_path / name))


def test_they_are_drawn_with_the_lines_between_them() -> None:
    """All points are drawn, and the lines with two marked ends."""
    drawn = FacePoints(points={"nose": (5, 6), "lmc": (7, 8), "lmou": (1, 2)}).draw()
    assert drawn["points"].positions[:, :2].tolist() == [[5, 6], [7, 8], [1, 2]]
    assert drawn["links"].segments[:, :, :2].tolist() == [[[5, 6], [7, 8]]]
    assert set(FacePoints(points={"nose": (5, 6)}).draw()) == {"points"}


def test_the_points_of_a_target_are_its_landmarks() -> None:
    """Those of the names that the kind knows; of a target without any there is no such mark."""
    names = ("nose", "tail", "leye")
    known = Landmarks(np.array([[1.5, 2.0], [9.0, 9.0], [3.0, 4.0]]), np.ones(3, np.bool_), np.zeros((3, 3)), names)
    mark = FacePoints.of_target(Target(np.zeros(3), landmarks=known))
    assert mark.points == {"nose": (1.5, 2.0), "leye": (3.0, 4.0)}
    assert [kind.of_target(Target(np.zeros(2), 5.0)) for kind in (FacePoints, FaceBox)] == [None, None]


# Boxes: read from text and JSON, checked against a picture, drawn around their pixels.


def test_a_box_is_read_from_text_and_json() -> None:
    """Four numbers, and the JSON that a box writes, give the same box."""
    box = Box.parse("1,2.5,30,40")
    assert box.corner_and_size == (1, 2.5, 30, 40)
    assert read_mark([Box], json.loads(box.model_dump_json())) == box
    assert json.loads(box.model_dump_json())["kind"] == "box"


@pytest.mark.parametrize("text", ["1,2,3", "nan,2,3,4"])
def test_what_is_no_box_is_refused(text: str) -> None:
    """The message says what was expected."""
    with pytest.raises(ValueError, match=rf"expected 4 finite numbers \(x,y,w,h\), got '{text}'"):
        Box.parse(text)


@pytest.mark.parametrize("box", [(310, 5, 20, 10), (-1, 0, 9, 9), (5, 5, 3, 0.5)])
def test_a_box_has_to_fit_the_picture(box: tuple[float, float, float, float]) -> None:
    """A box without area or beyond the picture is refused with both sizes; one that fills it is not."""
    with pytest.raises(ParameterError, match="within the picture of 320 x 120 px, got 'x = "):
        Box.of(*box).check((320, 120))
    Box.of(0, 0, 320, 120).check((320, 120))


def test_it_is_drawn_around_its_pixels() -> None:
    """The outline of a box of one pixel is half a pixel from the pixel's centre."""
    outline = Box.of(3, 4, 1, 1).draw()["box"]
    assert outline.positions[:, :2].tolist() == [[2.5, 3.5], [3.5, 3.5], [3.5, 4.5], [2.5, 4.5], [2.5, 3.5]]


def test_the_box_of_a_target_is_around_it() -> None:
    """For a disc it is the square of whole pixels that holds it, for a solid the box around its landmarks."""
    disc = Box.of_target(Target(np.array([50.5, 40.0]), 11.0))
    assert disc.corner_and_size == (45.0, 35.0, 12.0, 11.0)
    points = np.array([[10.2, 20.0], [30.0, 25.9]])
    known = Landmarks(points, np.ones(2, np.bool_), np.zeros((2, 3)), ("a", "b"))
    solid = Box.of_target(Target(np.zeros(3), landmarks=known))
    assert solid.corner_and_size == (10.0, 20.0, 21.0, 7.0)
    assert Box.of_target(Target(np.zeros(1))) is None


# A long body: head, root and tip of the tail, and half width.

SIZE = (320, 240)
GOOD = {"head": [120, 100], "root": [80, 100], "tip": [60, 100], "half_width": 8}


def body(**changes: object) -> LongBody:
    return LongBody.read({**GOOD, **changes})


def test_it_reads_lengths_and_angles_from_its_points() -> None:
    """Head to the right of the root: a heading of 0, half of 40 px, and a straight tail of 20 px.

    A command line writes them as seven numbers: head, root and tip, and the half width.
    """
    mark = body()
    assert (mark.heading, mark.bend, mark.half_length, mark.tail_length) == (0.0, 0.0, 20.0, 20.0)
    assert mark.centre.tolist() == [100.0, 100.0]
    assert body(tip=[80, 80]).bend == pytest.approx(math.pi / 2)
    assert body(tip=[80, 120]).bend == pytest.approx(-math.pi / 2)
    assert body(head=[80, 60], tip=[80, 130]).heading == pytest.approx(-math.pi / 2)
    assert LongBody.parse("120,100,80,100,60,100,8") == mark
    for text in ("120,100", "1,2,3,4,5,6,nan"):
        with pytest.raises(ValueError, match="expected 7 finite numbers"):
            LongBody.parse(text)


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5))
def test_the_bend_does_not_depend_on_the_heading(heading: float, bend: float) -> None:
    """Turned anywhere, a body has the bend that it has."""
    ahead = np.array([math.cos(heading), math.sin(heading)])
    tail = np.array([math.cos(heading + bend), math.sin(heading + bend)])
    points = {"head": 100 + 20 * ahead, "root": 100 - 20 * ahead, "tip": 100 - 20 * ahead - 15 * tail}
    mark = body(**{name: point.tolist() for name, point in points.items()})
    assert mark.bend == pytest.approx(bend, abs=1e-9)
    assert math.remainder(mark.heading - heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"head": [330, 100]}, r"mark.head must be within the picture of 320 x 240 px"),
        ({"root": [119, 100]}, r"mark.root must be at least 4 px from the head"),
        ({"half_width": 50}, r"mark.half_width must be at most the 40 px"),
        ({"tip": [110, 101]}, r"mark.tip must be behind the body"),
    ],
)
def test_what_is_no_body_is_refused(changes: dict[str, object], message: str) -> None:
    """Outside the picture, without length, wider than long, or with a tail folded to the front."""
    with pytest.raises(ParameterError, match=message):
        body(**changes).check(SIZE)
