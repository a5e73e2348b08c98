"""Verdicts on predictions."""

import math

import pytest

from pftrack.core.refusal import ParameterError
from pftrack.teaching.lessons.lesson import Answer, Mistake, Question, judge, read_answer

HALVED = Question(
    text="By what factor does the error fall?",
    words="The error goes with one over the root of N.",
    tolerance=0.1,
    bounds=(0, 100),
    mistakes=(Mistake(given=4.0, words="Four times the particles are not four times the accuracy."),),
)
LARGE = HALVED.model_copy(update={"bounds": (0, 1e9)})
COLOUR = Question(text="Which is it?", kind="choice", words="So it is.", choices={"a": "the first", "b": "the second"})


def test_a_verdict_has_the_right_answer() -> None:
    """It quotes the words of both choices, or the exact number, without decimals if it is large.

    The tolerance includes its bounds. A usual mistake gets its explanation, any other does not.
    """
    verdicts = [judge(HALVED, Answer(2.0), given) for given in (2, 2.1, 1.9, 2.11, -0.0)]
    assert [it.right for it in verdicts] == [True, True, True, False, False]
    assert {it.words[-1] for it in verdicts} == {HALVED.words}
    assert HALVED.mistakes[0].words in judge(HALVED, Answer(2.0), 4.0).words
    assert HALVED.mistakes[0].words not in judge(HALVED, Answer(2.0), 9.0).words
    assert judge(COLOUR, Answer("b"), "b").words[0] == "Right."
    assert judge(COLOUR, Answer("b"), "a").words[0] == "The right answer is “the second”, not “the first”."
    assert judge(HALVED, Answer(2.0), 2).words[0] == "Right: it is 2."
    measured = Answer(2.0, 2.04, "Measured: 2.04.")
    assert judge(HALVED, measured, 2).words[0] == "Right: it is 2 in theory."
    assert judge(HALVED, measured, 4).words[0] == "You said 4; it is 2 in theory, which is 2 off."
    assert judge(LARGE, Answer(10_000.0), 9000.4).words[0] == "You said 9000; it is 10,000, which is 1,000 off."
    assert judge(LARGE, Answer(0.00123), 1).words[0] == "You said 1; it is 0.00123, which is 0.999 off."


@pytest.mark.parametrize("given", ["two", None, True, math.nan, 101])
def test_other_answers_are_refused_with_what_is_allowed(given: object) -> None:
    """The refusal names the bounds."""
    with pytest.raises(ParameterError, match="between 0 and 100"):
        judge(HALVED, Answer(2.0), given)  # type: ignore[arg-type]  # what a client may send
    with pytest.raises(ParameterError, match="between 0 and 1,000,000,000, got 'many'"):
        judge(LARGE, Answer(10_000.0), "many")


@pytest.mark.parametrize(
    ("typed", "unit", "value"),
    [
        ("0.55", "", 0.55),
        (" 55% ", "", 0.55),
        ("55,5 %", "", 0.555),
        ("0,125", "", 0.125),
        ("55 %", "%", 55.0),
        ("2,5 m²", "m²", 2.5),
        ("\N{MINUS SIGN}1", "m", -1.0),
        ("+1e1", "", 10.0),
    ],
)
def test_a_number_is_taken_as_people_type_it(typed: str, unit: str, value: float) -> None:
    """A number may have a comma or a point, its unit, or a percent sign for a share."""
    assert read_answer(HALVED.model_copy(update={"unit": unit, "bounds": (-10, 100)}), typed) == pytest.approx(value)


@pytest.mark.parametrize("typed", ["", "%", "1,000,000", "10,000", "half", "nan", "1 2", "5 km"])
def test_other_texts_are_refused(typed: str) -> None:
    """The refusal quotes the text; a comma before three digits is ambiguous."""
    with pytest.raises(ParameterError, match=f"got '{typed}'"):
        read_answer(HALVED, typed)
