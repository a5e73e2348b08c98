"""True boxes that cannot be of the pictures that they are given for."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import pftrack
from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack.sources.results.parts import open_parts
from pftrack.sources.truth import boxes_outside

INSIDE = (10.0, 20.0, 30.0, 40.0)
PARTLY = (-29.5, 118.0, 30.0, 40.0)
RIGHT, ABOVE = (160.0, 20.0, 30.0, 40.0), (10.0, -40.0, 30.0, 40.0)


def told(*boxes: tuple[float, ...]) -> tuple[str, ...]:
    return boxes_outside(enumerate(boxes), 160, 120)


@pytest.mark.parametrize(
    "boxes", [(), (INSIDE,), (PARTLY,) * 9, (INSIDE, RIGHT), (PARTLY, PARTLY, ABOVE, RIGHT)], ids=len
)
def test_a_target_may_leave_the_picture(boxes: tuple[tuple[float, ...], ...]) -> None:
    """Nothing is said of boxes that are partly in the picture, nor where half of them or fewer are outside."""
    assert told(*boxes) == ()


def test_boxes_of_another_picture_are_told_by_frame() -> None:
    """The sentence has their number, their frames, the first of them, and what to do."""
    (sentence,) = told(INSIDE, RIGHT, RIGHT, ABOVE, INSIDE, RIGHT)
    assert sentence == (
        "4 of 6 true boxes lie wholly outside the picture of 160 x 120 px: frames 1 to 3 and 5; that of frame 1 is "
        "160, 20, 30, 40. If they were drawn on a clip of another size, scale them to this one, and check the order of "
        "the columns: x, y, w, h."
    )
    (sentence,) = told(ABOVE)
    assert sentence.startswith("The only true box lies wholly outside the picture of 160 x 120 px: frame 0; that of ")
    (sentence,) = told(*(RIGHT, INSIDE, RIGHT, RIGHT) * 5)
    assert ": frames 0, 2 to 4, 6 to 8 and 8 more; " in sentence


def test_a_recording_of_a_loop_tells_it(tmp_path: Path) -> None:
    """Of its own pictures, by their numbers in the sequence; on paper, boxes are nowhere outside."""
    for name, pictures in (("seen", np.zeros((6, 120, 160), np.uint8)), ("paper", None)):
        with pftrack.record(tmp_path / f"{name}.pft", source=pictures) as rec:
            for t in range(6):
                rec(t, box=INSIDE, true_box=RIGHT if t > 1 else INSIDE)
        told = "4 of 6 true boxes lie wholly outside the picture of 160 x 120 px: frames 2 to 5"
        with closing(open_parts({"results": tmp_path / f"{name}.pft"}, DEFAULT_LIMITS)) as sequence:
            assert [one.partition(";")[0] for one in sequence.index.warnings] == ([told] if name == "seen" else [])
