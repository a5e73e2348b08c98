"""Where to look when a target was lost."""

import pytest

from pftrack.runs.scoring import approach, before_loss, first_loss, loss_start, losses


def flags(*spans: tuple[int, int], frames: int = 100) -> list[bool]:
    return [any(first <= frame <= last for first, last in spans) for frame in range(frames)]


@pytest.mark.parametrize(
    ("lost", "hidden", "frame", "expected"),
    [
        ([], [], 50, None),
        ([(60, 70)], [], 99, 50),
        ([(60, 70)], [], 0, 50),
        ([(60, 70), (80, 99)], [], 79, 50),
        ([(60, 70), (80, 99)], [], 80, 71),
        ([(4, 9)], [], 50, 0),
        ([(60, 70)], [(40, 55)], 99, 30),
        ([(60, 70)], [(10, 15)], 99, 50),
        ([(60, 70)], [(10, 15), (58, 90)], 99, 48),
        ([(60, 70)], [(61, 65)], 99, 50),
        ([(60, 70)], [(5, 25)], 99, 0),
        ([(60, 70), (75, 99)], [], 99, 71),
        ([(60, 70), (73, 99)], [], 99, 50),
        ([(60, 62), (64, 66), (68, 99)], [], 99, 50),
        ([(20, 40), (60, 70)], [(45, 55)], 99, 41),
    ],
)
def test_the_approach_to_a_loss(
    lost: list[tuple[int, int]], hidden: list[tuple[int, int]], frame: int, expected: int | None
) -> None:
    """It leads to ten frames before the last loss, or before what hid the target shortly before."""
    assert before_loss(flags(*lost), flags(*hidden), frame) == expected


def test_the_run_begins_somewhere() -> None:
    """There is nothing before the first frame, also when the target is lost from the beginning."""
    assert approach(3) == 0
    assert before_loss([True, True], [False, False], 1) == 0


def test_a_loss_goes_on_until_the_target_is_not_lost() -> None:
    """It begins with the first frame that is lost; one of which nobody says anything ends it."""
    lost = [False, True, True, None, False, False, True]
    found: list[int | None] = []
    for frame, one in enumerate(lost):
        found.append(loss_start(frame, found[-1] if found else None, lost=one))
    assert found == [None, 1, 1, None, None, None, 6]


def test_the_loss_to_ask_about_is_the_first_that_lasts() -> None:
    """Five frames or to the end is lasting; failing that it is the first, and without a loss none."""
    assert losses([True, False, True, True]) == [(0, 0), (2, 3)]
    assert losses([]) == []
    assert first_loss(8 * [False] + 2 * [True] + [False] + 5 * [True] + [False]) == 11
    assert first_loss([False, True, False, False, True]) == 4
    assert first_loss([False, True, False, True, False]) == 1
    assert first_loss([False]) is None
