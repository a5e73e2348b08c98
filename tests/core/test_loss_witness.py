"""Who says that a target is lost."""

import pytest

from pftrack.core.model.measures import Witness, judge_loss


@pytest.mark.parametrize(
    ("lost", "searching", "expected", "witness"),
    [
        (True, False, True, "truth"),
        (True, True, True, "truth"),
        (False, True, False, "truth"),
        (False, False, False, "truth"),
        (False, None, False, "truth"),
        (None, True, True, "tracker"),
        (None, False, False, "tracker"),
        (None, None, None, ""),
    ],
)
def test_the_first_who_knows_has_the_word(
    lost: bool | None, searching: bool | None, expected: bool | None, witness: Witness
) -> None:
    """The truth has the word where it is known, elsewhere the tracker's own account."""
    assert judge_loss(lost, searching) == (expected, witness)
