"""A long body: head, root and tip of the tail, and half width."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.marks import LongBody
from pftrack.core.refusal import ParameterError

SIZE = (320, 240)
GOOD = {"head": [120, 100], "root": [80, 100], "tip": [60, 100], "half_width": 8}


def body(**changes: object) -> LongBody:
    return LongBody.read({**GOOD, **changes})


def test_it_reads_lengths_and_angles_from_its_points() -> None:
    """Head to the right of the root: a heading of 0, half of 40 px, and a straight tail of 20 px."""
    mark = body()
    assert (mark.heading, mark.bend, mark.half_length, mark.tail_length) == (0.0, 0.0, 20.0, 20.0)
    assert mark.centre.tolist() == [100.0, 100.0]
    assert body(tip=[80, 80]).bend == pytest.approx(math.pi / 2)
    assert body(tip=[80, 120]).bend == pytest.approx(-math.pi / 2)
    assert body(head=[80, 60], tip=[80, 130]).heading == pytest.approx(-math.pi / 2)


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5))
def test_the_bend_does_not_depend_on_the_heading(heading: float, bend: float) -> None:
    """Turned anywhere, a body has the bend that it has."""
    ahead = (math.cos(heading), math.sin(heading))
    tail = (math.cos(heading + bend), math.sin(heading + bend))
    root = (100 - 20 * ahead[0], 100 - 20 * ahead[1])
    mark = LongBody(
        head=(100 + 20 * ahead[0], 100 + 20 * ahead[1]),
        root=root,
        tip=(root[0] - 15 * tail[0], root[1] - 15 * tail[1]),
        half_width=5,
    )
    assert mark.bend == pytest.approx(bend, abs=1e-9)
    assert math.remainder(mark.heading - heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_the_command_line_writes_seven_numbers() -> None:
    """Head x,y, root x,y, tip x,y and the half width."""
    assert LongBody.parse("120,100,80,100,60,100,8") == body()
    for text in ("120,100", "1,2,3,4,5,6,many", "1,2,3,4,5,6,nan", ""):
        with pytest.raises(ValueError, match="expected 7 finite numbers"):
            LongBody.parse(text)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"head": [330, 100]}, r"mark.head must be within the picture of 320 x 240 px"),
        ({"tip": [-1, 100]}, r"mark.tip must be within the picture"),
        ({"root": [119, 100]}, r"mark.root must be at least 4 px from the head"),
        ({"half_width": 50}, r"mark.half_width must be at most the 40 px"),
        ({"tip": [110, 101]}, r"mark.tip must be behind the body"),
    ],
)
def test_what_is_no_body_is_refused(changes: dict[str, object], message: str) -> None:
    """Outside the picture, without length, wider than long, or with a tail folded to the front."""
    with pytest.raises(ParameterError, match=message):
        body(**changes).check(SIZE)
