"""Beams: a belief as a few weighted hypotheses, each with a link to its parent in the previous frame.

A beam keeps alternatives between which a single estimate would have to decide at once. Later frames may show which
alternative was right. The links to the parents then lead back from the best current hypothesis to its past.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from pftrack.core.arrays import Floats, Ints, check
from pftrack.core.numerics.elementary import exponentials
from pftrack.filters.particles import normalise

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Beam(Generic[T]):
    """K hypotheses, the most probable first where `select_best` has made it.

    Attributes:
        members: K of whatever a family believes in: poses, Gaussians, regions.
        log_weights: (K,) logarithms of probabilities that sum to one.
        parents: (K,) index of each member's parent among the members of the frame before; -1 for one without.
    """

    members: tuple[T, ...]
    log_weights: Floats
    parents: Ints

    def __post_init__(self) -> None:
        """Refuse arrays of other lengths.

        Raises:
            TypeError: Weights or parents are not an array of numbers.
            ValueError: It has no member, or another number of weights or parents than of members.
        """
        if not self.members:
            raise ValueError("a beam needs at least one member, got none")
        count = f"{len(self.members)}"
        check(missing=True, log_weights=(self.log_weights, count), parents=(self.parents, count, "whole"))

    @classmethod
    def of(cls, member: T) -> "Beam[T]":
        """Return the beam of one certain member that has no parent."""
        return cls((member,), np.zeros(1), np.full(1, -1))

    def __len__(self) -> int:
        """Return the number of members K."""
        return len(self.members)

    @property
    def weights(self) -> Floats:
        """(K,) probabilities that sum to one."""
        return exponentials(self.log_weights)

    @property
    def best(self) -> int:
        """Index of the most probable member; the first among equals."""
        return int(np.argmax(self.log_weights))


def select_best(
    members: Sequence[T],
    scores: Floats,
    parents: Ints,
    width: int,
    same: Callable[[T, T], bool],
) -> Beam[T]:
    """Return the best members that differ from one another, at most `width`, the best first.

    Args:
        members: N candidates, at least one.
        scores: (N,) log probabilities up to a constant. A score that is not finite marks an impossible member.
            Impossible members are kept only if all are impossible, and then with equal probabilities.
        parents: (N,) index of each one's parent in the frame before, or -1.
        width: Most members that are kept, at least 1.
        same: Whether two members are the same hypothesis; the less probable one is dropped.

    Raises:
        TypeError: Scores or parents are not an array of numbers.
        ValueError: There is nothing to keep, the size is below 1, or the number of scores or parents differs from that
            of the members.
    """
    if not members or width < 1:
        raise ValueError(f"keeping the best needs a member and a width of at least 1, got {len(members)} and {width}")
    check(missing=True, scores=(scores, f"{len(members)}"), parents=(parents, f"{len(members)}", "whole"))
    ranks = np.where(np.isfinite(scores), scores, -np.inf)
    possible = ranks > -np.inf
    chosen: list[int] = []
    for place in np.argsort(-ranks, kind="stable").tolist():
        if len(chosen) == width or (chosen and possible[chosen[0]] and not possible[place]):
            break
        if not any(same(members[other], members[place]) for other in chosen):
            chosen.append(place)
    log_weights, _ = normalise(ranks[chosen])
    return Beam(tuple(members[place] for place in chosen), log_weights, parents[chosen])


def backtrack(parents: Sequence[Ints], last: int) -> Ints:
    """Return the ancestor, in each frame, of a member of the last frame.

    Args:
        parents: Parents (K_t,) of the members of each of T frames; the first frame's are not read.
        last: Index of a member of the last frame.

    Returns:
        (T,) indices of members; -1 in the frames before one that has no parent.
    """
    path = np.full(len(parents), -1)
    place = last
    for frame in range(len(parents) - 1, -1, -1):
        if place < 0:
            break
        path[frame] = place
        place = int(parents[frame][place])
    return path
