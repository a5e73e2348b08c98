"""Boxes: read from text and JSON, checked against a picture, drawn around their pixels."""

import json

import numpy as np
import pytest

from pftrack.core.model.marks import Box, read_mark
from pftrack.core.model.source import Landmarks, Target
from pftrack.core.refusal import ParameterError


def test_a_box_is_read_from_text_and_json() -> None:
    """Four numbers, and the JSON that a box writes, give the same box."""
    box = Box.parse("1,2.5,30,40")
    assert box.corner_and_size == (1, 2.5, 30, 40)
    assert read_mark([Box], json.loads(box.model_dump_json())) == box
    assert json.loads(box.model_dump_json())["kind"] == "box"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3", r"expected 4 finite numbers \(x,y,w,h\), got '1,2,3'"),
        ("a,b,c,d", "expected 4 finite numbers"),
        ("nan,2,3,4", "expected 4 finite numbers"),
    ],
)
def test_what_is_no_box_is_refused(text: str, message: str) -> None:
    """The message says what was expected."""
    with pytest.raises(ValueError, match=message):
        Box.parse(text)


@pytest.mark.parametrize("box", [(310, 5, 20, 10), (-1, 0, 9, 9), (0, 0, 0, 5), (5, 5, 3, 0.5), (1e5, 0, 9, 9)])
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
    """Of a disc it is the square of whole pixels that holds it; of a solid the box around its landmarks."""
    disc = Box.of_target(Target(np.array([50.5, 40.0]), 11.0))
    assert disc is not None
    assert disc.corner_and_size == (45.0, 35.0, 12.0, 11.0)
    points = np.array([[10.2, 20.0], [30.0, 25.9]])
    known = Landmarks(points, np.ones(2, np.bool_), np.zeros((2, 3)), ("a", "b"))
    solid = Box.of_target(Target(np.zeros(3), landmarks=known))
    assert solid is not None
    assert solid.corner_and_size == (10.0, 20.0, 21.0, 7.0)
    assert Box.of_target(Target(np.zeros(1))) is None
