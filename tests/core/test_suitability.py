"""What is said while tracking of how a target separates from its surroundings."""

import math

from pftrack.core.model.setup import SETTLED, describe_course


def test_it_says_since_when() -> None:
    """From the frame on in which most of the newest values are of that grade; a single frame changes nothing."""
    course = [0.05] * 20 + [11.0] * 20
    since = 20 + SETTLED // 2
    assert describe_course(course) == (
        f"Separates not at all since frame {since}: the estimate is 9 % as likely as what is beside it"
    )
    course[10] = 11.0
    assert describe_course(course[:20]) == (
        "Separates well from the start: what is beside the estimate is 5 % as likely as it"
    )


def test_of_what_is_not_known_nothing_is_said() -> None:
    """Before the first frame, and where nothing was measured."""
    assert describe_course([]) == ""
    assert describe_course([0.5, math.nan]) == ""
