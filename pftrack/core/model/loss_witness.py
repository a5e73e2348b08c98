"""Who says that a target is lost: the one rule by which everything goes that asks.

A target is lost where the truth says so, and where the tracker looks for it by its own account: then there is nothing
that it follows, wherever its last place was. Else the truth says that it is held. Where that is not known, the tracker
says that it follows, if it gives such an account; else nobody says.
"""

from typing import Literal, NamedTuple, TypeAlias

__all__ = ["LossVerdict", "Witness", "judge_loss"]

Witness: TypeAlias = Literal["truth", "tracker", ""]
"""The truth, the tracker's own account, or nobody."""


class LossVerdict(NamedTuple):
    """What is said of a frame.

    Attributes:
        lost: Whether the target is lost; None where nobody says.
        witness: Who says so.
    """

    lost: bool | None
    witness: Witness


def judge_loss(lost: bool | None, searching: bool | None) -> LossVerdict:
    """Return whether a target is lost in a frame, and who says so.

    Args:
        lost: By the truth; None where that is not known.
        searching: Whether the tracker looks for the target by its own account; None for one that always follows.
    """
    if lost:
        return LossVerdict(True, "truth")
    if searching:
        return LossVerdict(True, "tracker")
    if lost is not None:
        return LossVerdict(False, "truth")
    return LossVerdict(searching, "" if searching is None else "tracker")
