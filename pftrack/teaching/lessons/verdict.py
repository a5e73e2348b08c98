"""How a prediction is judged: how far off it was, and in words why."""

import math
import re
from dataclasses import dataclass

from pftrack.core.model.parameters import ParameterError
from pftrack.teaching.lessons.lesson import Answer, Given, Mistake, Question

__all__ = ["Verdict", "judge", "read_answer"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is said of a prediction.

    Attributes:
        right: Whether it is within the question's tolerance.
        given: The prediction.
        exact: The right answer.
        measured: What the lesson measured in its place, if it did.
        off: By how much a number was off; None of a choice.
        words: The verdict and its reason, in sentences.
    """

    right: bool
    given: Given
    exact: Given
    measured: float | None
    off: float | None
    words: tuple[str, ...]


DECIMAL_COMMA = re.compile(r"([-+]?\d*),(\d+)")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")
"""To some a thousand and more, to others one and three decimals."""


def judge(question: Question, answer: Answer, given: Given) -> Verdict:
    """Judge a prediction.

    Args:
        question: What was asked.
        answer: The right answer.
        given: The prediction: a number, or the name of a choice.

    Raises:
        ParameterError: It is no answer to this question.
    """
    value = read_answer(question, given)
    if isinstance(value, str) or isinstance(answer.exact, str):
        right, off = value == answer.exact, None
    else:
        off = value - answer.exact
        right = abs(off) <= question.tolerance * (1 + 1e-12)
    mistake = None if right else next((each for each in question.mistakes if _fits(each, value, question)), None)
    # What was probably thought comes right after what was said, as it speaks of that.
    said = (_how_far(question, value, answer, right), mistake.words if mistake else "", answer.words, question.words)
    return Verdict(right, value, answer.exact, answer.measured, off, tuple(words for words in said if words))


def read_answer(question: Question, given: object) -> Given:
    """Return a prediction as its question understands it: of a number also as a person types it, with its unit.

    Raises:
        ParameterError: It is no answer to this question.
    """
    if question.kind == "choice":
        choices = question.choices or {}
        if not isinstance(given, str) or given not in choices:
            raise ParameterError("answer", given, f"one of {', '.join(choices)}")
        return given
    low, high = question.bounds
    unit = f" {question.unit}" if question.unit else ""
    allowed = f"a number between {_write(low)} and {_write(high)}{unit}"
    value = _parse(given, question.unit) if isinstance(given, str) else given
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ParameterError("answer", given, allowed)
    if not low <= value <= high:
        raise ParameterError("answer", given, allowed)
    return float(value)


def _parse(text: str, unit: str) -> float | None:
    """Return the number that a person has typed, with a comma or a point, its unit, or as percent; None of others."""
    bare, factor = text.strip().replace("\N{MINUS SIGN}", "-"), 1.0
    if unit and bare.endswith(unit):
        bare = bare.removesuffix(unit)
    elif bare.endswith("%"):
        bare, factor = bare.removesuffix("%"), 0.01
    bare = bare.strip()
    if THOUSANDS.fullmatch(bare):
        return None  # rather asked for again than taken for what was not meant
    if (found := DECIMAL_COMMA.fullmatch(bare)) is not None:
        bare = ".".join(found.groups())
    try:
        return factor * float(bare)
    except ValueError:
        return None


def _fits(mistake: Mistake, value: Given, question: Question) -> bool:
    if isinstance(value, str) or isinstance(mistake.given, str):
        return value == mistake.given
    low, high = mistake.given if isinstance(mistake.given, tuple) else (mistake.given, mistake.given)
    return low - question.tolerance <= value <= high + question.tolerance


def _how_far(question: Question, value: Given, answer: Answer, right: bool) -> str:
    if isinstance(value, str) or isinstance(answer.exact, str):
        # Both are named: what follows speaks of "that", the one that was chosen.
        exact, said = ((question.choices or {}).get(str(each), each) for each in (answer.exact, value))
        return "Right." if right else f"The right answer is “{exact}”, not “{said}”."
    unit = f" {question.unit}" if question.unit else ""
    # What the lesson measures in its place is told as well, and is another number.
    exact = f"{_write(answer.exact)}{unit}" + (" in theory" if answer.measured is not None else "")
    if right:
        return f"Right: it is {exact}."
    return f"You said {_write(value)}{unit}; it is {exact}, which is {_write(abs(value - answer.exact), 3)}{unit} off."


def _write(value: float, digits: int = 4) -> str:
    """Return a number in a few digits, a large one whole: "10,000", not "1e+04"."""
    return f"{value:,.0f}" if abs(value) >= 10**digits - 0.5 else f"{value:.{digits}g}"
