"""A lesson's question as a poll: a few answers to choose from, which a class can tap.

A choice has its own. For a number or a point the range of answers is cut between the right one and the usual mistakes,
so that each lies in an interval of its own; where two lie far apart the cut is at their geometric mean.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from pftrack.teaching.lessons.lesson import Given, Question

__all__ = ["MOST_ANSWERS", "poll_answers"]

MOST_ANSWERS: Final = 8
"""As many as a phone shows, and keys count."""
FEWEST_VALUES: Final = 3
FAR: Final = 4.0
"""Ratio of two positive numbers from which on their geometric mean lies between them, to the eye."""
UNBOUNDED: Final = 1e6
"""What the bounds of a question are that has none."""


def poll_answers(question: Question, exact: Given | None = None) -> tuple[str, ...]:
    """Return the answers among which a class chooses, in ascending order where they are intervals.

    Args:
        question: Of the lesson.
        exact: Its right answer, in the question's unit; not needed for a choice.

    Raises:
        ValueError: The question asks for a number, and its right answer is none.
    """
    if question.choices:
        return tuple(question.choices.values())
    if not isinstance(exact, float | int) or not math.isfinite(exact):
        raise ValueError("the right answer of this question is no number, so no answers can be offered")
    cuts = _distinct([_rounded(_cut(low, high)) for low, high in pairwise(_values(question, float(exact)))])
    unit = f" {question.unit}" if question.unit else ""
    texts = [f"{cut:,.10g}" for cut in cuts]
    between = (f"{low} to {high}{unit}" for low, high in pairwise(texts))
    return (f"Below {texts[0]}{unit}", *between, f"Above {texts[-1]}{unit}")


def _values(question: Question, exact: float) -> list[float]:
    """Return the right answer and what is answered in its place, ascending, no two closer than the tolerance."""
    apart = max(question.tolerance, 1e-9 * abs(exact), 1e-12)
    found = [exact]
    for value in (*_mistakes(question), *_ends(question, exact)):
        is_spare = len(found) >= FEWEST_VALUES and value in _ends(question, exact)
        if len(found) < MOST_ANSWERS and not is_spare and all(abs(value - other) > apart for other in found):
            found.append(value)
    return sorted(found)


def _mistakes(question: Question) -> Iterator[float]:
    for mistake in question.mistakes:
        given = mistake.given
        if isinstance(given, tuple):
            yield sum(given) / 2
        elif not isinstance(given, str):
            yield float(given)


def _ends(question: Question, exact: float) -> tuple[float, ...]:
    """Return what is answered where few mistakes are declared: the bounds, or half and twice the right answer."""
    low, high = question.bounds
    if low > -UNBOUNDED and high < UNBOUNDED:
        return low, high
    return (exact / 2, 2 * exact) if exact else (-1.0, 1.0)


def _cut(low: float, high: float) -> float:
    return math.sqrt(low * high) if low > 0 and high > FAR * low else (low + high) / 2


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _distinct(cuts: Sequence[float]) -> list[float]:
    return list(dict.fromkeys(cuts))
