"""Who says that a target is lost."""

import math

import pytest

from pftrack.model.loss_witness import Witness, judge_loss


@pytest.mark.parametrize(
    ("lost", "searching", "probability", "expected", "witness"),
    [
        (True, False, 0.1, True, "truth"),
        (True, True, 0.1, True, "truth"),
        (False, True, 0.1, True, "tracker"),
        (False, False, 0.9, False, "truth"),
        (False, None, 0.9, False, "truth"),
        (None, True, 0.1, True, "tracker"),
        (None, False, None, False, "tracker"),
        (None, False, 0.5, True, "probability"),
        (None, False, 0.499, False, "probability"),
        (None, None, 0.93, True, "probability"),
        (None, None, math.nan, None, ""),
        (None, None, None, None, ""),
    ],
)
def test_the_first_who_knows_has_the_word(
    lost: bool | None, searching: bool | None, probability: float | None, expected: bool | None, witness: Witness
) -> None:
    """A loss by the truth goes before a search, that before all else, and numbers say lost from a half on."""
    assert judge_loss(lost, searching, probability) == (expected, witness)
