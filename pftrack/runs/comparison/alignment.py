"""Alignment: which frame of one run belongs to which frame of another.

Runs on the same recording belong together picture by picture, wherever in it each of them began. All others, on scenes
that are simulated or on different recordings, belong together by the frames' numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from pftrack.runs.run import Run

__all__ = ["MOST_RUNS", "Alignment", "ComparisonError", "align"]

MOST_RUNS = 4


class ComparisonError(ValueError):
    """Runs that cannot be compared; the sentence says why, and what can be."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """The frames that runs have in common, counted from 0 on.

    Attributes:
        frames: How many they are.
        firsts: The number that each run has for the first of them; one of these numbers is 0.
    """

    frames: int
    firsts: tuple[int, ...]


def align(runs: Sequence[Run]) -> Alignment:
    """Return the frames that runs have in common.

    Args:
        runs: Two to four, computed or not: what counts is how long they are.

    Raises:
        ComparisonError: There are too few or too many, their units differ, or they have no frame in common.
    """
    if not 2 <= len(runs) <= MOST_RUNS:
        raise ComparisonError(f"expected two to four runs to compare, got {len(runs)}")
    _check_units(runs)
    starts = _starts(runs)
    begin, end = max(starts), min(start + run.frames for start, run in zip(starts, runs, strict=True))
    if begin >= end:
        pictures = ", ".join(f"{start} to {start + run.frames - 1}" for start, run in zip(starts, runs, strict=True))
        raise ComparisonError(
            f"the runs have no picture of the recording in common: they show pictures {pictures}; compare runs that "
            "begin closer to each other, or that are longer"
        )
    return Alignment(end - begin, tuple(begin - start for start in starts))


def _check_units(runs: Sequence[Run]) -> None:
    first = runs[0].experiment
    for run in runs[1:]:
        other = run.experiment
        if other.unit != first.unit:
            raise ComparisonError(
                f"errors of {first.title} are {_in_words(first.unit)}, those of {other.title} {_in_words(other.unit)}; "
                "compare runs whose errors have one unit"
            )


def _in_words(unit: str) -> str:
    return f"in {unit}" if unit else "pure numbers"


def _starts(runs: Sequence[Run]) -> list[int]:
    """Return the number of each run's frame 0 among all that can be common to them."""
    footage = [run.setup.footage for run in runs]
    known = [one for one in footage if one is not None]
    contents = {one.sha256 for one in known}
    if len(known) < len(runs) or len(contents) > 1 or None in contents:
        return [0] * len(runs)
    return [one.start for one in known]
