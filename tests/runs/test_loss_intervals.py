"""Where to look when a target was lost."""

import numpy as np
import pytest

from pftrack.runs.loss import Loss, approach, loss_start, loss_words


def said(lost: list[bool], judged: int | None = None) -> Loss:
    """Return what the truth says of frames, of the first so many if not of all."""
    known = len(lost) if judged is None else judged
    return Loss(np.array(lost, np.bool_), tuple("truth" if frame < known else "" for frame in range(len(lost))))


def flags(*spans: tuple[int, int], frames: int = 100) -> list[bool]:
    return [any(first <= frame <= last for first, last in spans) for frame in range(frames)]


@pytest.mark.parametrize(
    ("lost", "hidden", "frame", "expected"),
    [
        ([], [], 50, None),
        ([(60, 70)], [], 99, 50),
        ([(60, 70)], [], 0, 50),
        ([(60, 70), (80, 99)], [], 79, 50),
        ([(60, 70), (80, 99)], [], 80, 73),
        ([(4, 9)], [], 50, 2),
        ([(8, 9)], [], 50, 2),
        ([(13, 20)], [], 50, 3),
        ([(2, 9)], [], 50, 1),
        ([(0, 9)], [], 50, 0),
        ([(60, 70)], [(40, 55)], 99, 30),
        ([(60, 70)], [(10, 15)], 99, 50),
        ([(60, 70)], [(10, 15), (58, 90)], 99, 48),
        ([(60, 70)], [(61, 65)], 99, 50),
        ([(60, 70)], [(5, 25)], 99, 2),
        ([(60, 70)], [(50, 50), (54, 90)], 99, 44),
        ([(60, 70)], [(0, 55)], 99, 58),
        ([(60, 70), (75, 99)], [], 99, 73),
        ([(60, 70), (73, 99)], [], 99, 50),
        ([(60, 62), (64, 66), (68, 99)], [], 99, 50),
        ([(20, 40), (60, 70)], [(45, 55)], 99, 43),
    ],
)
def test_the_approach_to_a_loss(
    lost: list[tuple[int, int]], hidden: list[tuple[int, int]], frame: int, expected: int | None
) -> None:
    """It leads to a frame with the target held for three: ten before the last loss, or before what hid it, or later."""
    assert said(flags(*lost)).approach(flags(*hidden), frame) == expected


def test_a_loss_is_watched_from_before_the_last_mark_that_held() -> None:
    """A mark tells that the target is lost by then; when that happened after the mark before it, nobody knows."""
    lost = flags((60, 60), frames=61)
    marks = Loss(np.array(lost, np.bool_), tuple("truth" if frame % 30 == 0 else "" for frame in range(61)))
    assert marks.approach(61 * [False], 60) == 30
    assert said(lost).approach(61 * [False], 60) == 50


@pytest.mark.parametrize(("loss", "frame"), [(0, 0), (1, 0), (2, 1), (3, 2), (12, 2), (13, 3), (40, 30)])
def test_a_frame_is_watched_from_ten_before_it(loss: int, frame: int) -> None:
    """Early in a run from the third frame, and never from the frame itself, unless it is the first."""
    assert approach(loss) == frame


def test_a_loss_goes_on_until_the_target_is_not_lost() -> None:
    """It begins with the first frame that is lost; one of which nobody says anything ends it."""
    lost = [False, True, True, None, False, False, True]
    found: list[int | None] = []
    for frame, one in enumerate(lost):
        found.append(loss_start(frame, found[-1] if found else None, lost=one))
    assert found == [None, 1, 1, None, None, None, 6]


@pytest.mark.parametrize(
    ("lost", "first", "lasting"),
    [
        (8 * [False] + 2 * [True] + [False] + 5 * [True] + [False], 8, 11),
        ([False, True, False, False, True], 1, 4),
        ([False, True, False, True, False], 1, 1),
        ([False], None, None),
        ([], None, None),
    ],
)
def test_the_loss_to_ask_about_is_the_first_that_lasts(
    lost: list[bool], first: int | None, lasting: int | None
) -> None:
    """Five frames or to the end is lasting; failing that it is the first, and without a loss none."""
    assert (said(lost).first_lost_frame, said(lost).lasting) == (first, lasting)


def test_losses_are_spans_of_frames() -> None:
    """Each has its first and its last frame; of a frame in one the loss begins with the first."""
    assert said([True, False, True, True]).spans == [(0, 0), (2, 3)]
    assert [said([True, False, True, True]).begin(frame) for frame in range(4)] == [0, 1, 2, 2]
    assert said([]).spans == []


def test_a_target_is_held_at_the_end_if_it_is_lost_in_none_of_the_last_judged_frames() -> None:
    """Ten frames that somebody judges decide; where nobody judges any, nothing is known of the run."""
    assert said(flags((80, 89))).held_at_end is True
    assert said(flags((80, 90))).held_at_end is False
    assert said(flags((50, 55), frames=100), judged=60).held_at_end is False
    nobody = said(flags(), judged=0)
    assert (nobody.held_at_end, nobody.lost_frames, nobody.witness) == (None, None, "")


def test_a_loss_has_one_sentence() -> None:
    """It names how many frames are lost and the first of them."""
    assert loss_words(60, 0, None) == "Never lost in 60 frames"
    assert loss_words(60, 12, 7) == "Lost in 12 of 60 frames, first in frame 7"
