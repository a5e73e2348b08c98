"""Who says that a target is lost: the one rule by which everything goes that asks.

A target is lost where the truth says so, and where the tracker looks for it by its own account: then there is nothing
that it follows, wherever its last place was. Else the truth says that it is held. Where that is not known the tracker's
numbers may still tell how probable a loss is, and from a half on it is taken for one. Else nobody says.
"""

import math
from typing import Literal, NamedTuple, TypeAlias

__all__ = ["PROBABLE", "LossVerdict", "Witness", "judge_loss"]

Witness: TypeAlias = Literal["truth", "tracker", "probability", ""]
"""The truth, the tracker's own account, the probability that its own numbers tell, or nobody."""

PROBABLE = 0.5
"""From this probability on a target is taken for lost."""


class LossVerdict(NamedTuple):
    """What is said of a frame.

    Attributes:
        lost: Whether the target is lost; None where nobody says.
        witness: Who says so.
    """

    lost: bool | None
    witness: Witness


def judge_loss(lost: bool | None, searching: bool | None, probability: float | None = None) -> LossVerdict:
    """Return whether a target is lost in a frame, and who says so.

    A tracker that does not search may have lost its target without notice: then its numbers have the word, if they
    tell anything.

    Args:
        lost: By the truth; None where that is not known.
        searching: Whether the tracker looks for the target by its own account; None for one that always follows.
        probability: That the target is lost, by the tracker's own numbers; None or NaN where nothing tells it.
    """
    if lost:
        return LossVerdict(True, "truth")
    if searching:
        return LossVerdict(True, "tracker")
    if lost is not None:
        return LossVerdict(False, "truth")
    if probability is not None and not math.isnan(probability):
        return LossVerdict(probability >= PROBABLE, "probability")
    return LossVerdict(searching, "" if searching is None else "tracker")
