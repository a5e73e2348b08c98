"""How a target is found on a recording that nobody has marked: where one looks, and what is seen there."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from pftrack.core.model.marks import Mark
from pftrack.core.model.sequence import FrameSequence

__all__ = ["Finder", "Search", "Sighting"]


@dataclass(frozen=True, slots=True)
class Sighting:
    """What came of looking for a target in one picture of a recording.

    Attributes:
        frame: Number of the picture.
        mark: The target; None if it was not found.
        sure: Whether the picture has shown it, wholly or in part, rather than a model has placed all of it.
        placed: Names of the mark's handles that a model has placed rather than the picture shown.
        remarks: What a person should look at, or why there is nothing, one sentence each.
    """

    frame: int
    mark: Mark | None = None
    sure: bool = False
    placed: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


class Search(Protocol):
    """Look for a target through a recording."""

    def __call__(self, sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
        """Look into one picture after the other.

        Args:
            sequence: The pictures.
            frames: Which of them, in this order. Only of the first is it said why there is nothing, since that takes
                several times as long as looking.
        """


@dataclass(frozen=True, slots=True)
class Finder:
    """How an experiment finds its target on a recording by itself.

    Attributes:
        frames: (first, last) -> numbers of the pictures to look into, as many as can be looked into in some seconds.
        search: Look into pictures.
        better: (sequence, sighting) -> one soon after it that is a better start, or the same.
        kind: Of the marks that it gives.
        within: (sequence, frame, mark of another kind that a person has made) -> the target there, if need be all of
            it placed.
        hints: Kinds of mark that `within` takes.
    """

    frames: Callable[[int, int], Sequence[int]]
    search: Search
    better: Callable[[FrameSequence, Sighting], Sighting]
    kind: type[Mark]
    within: Callable[[FrameSequence, int, Mark], Sighting] | None = None
    hints: tuple[type[Mark], ...] = ()
