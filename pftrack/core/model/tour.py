"""What a guided tour says: how somebody who has never seen a tracker comes to see one lose its target, and why."""

from dataclasses import dataclass

__all__ = ["Tour"]


@dataclass(frozen=True, slots=True)
class Tour:
    """A preset that loses its target, told to a first visitor.

    Attributes:
        begin: What is to be seen before it runs, a sentence or two.
        reason: Why the target is lost, a few sentences that need no knowledge of filters.
        plot: Id of the experiment's plot that shows it.
        frame: Number of the frame in which it is to be seen.
    """

    begin: str
    reason: str
    plot: str
    frame: int
