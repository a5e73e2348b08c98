"""Expressions over the numbers of a run: what they come to, and that a hostile one does nothing."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pftrack.teaching.lessons.lecturers.expression import LONGEST, ExpressionError, NoValueError, parse

COLUMNS = {
    "frame": np.arange(6.0),
    "lost": np.array([0.0, 0.0, 1.0, 1.0, 0.0, 1.0]),
    "error": np.array([1.0, 2.0, 8.0, 9.0, np.nan, 4.0]),
    "estimate": np.array([[float(row), 10.0 * row] for row in range(6)]),
    "wide": np.zeros((6, 8, 8)),
}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", 3.0),
        ("mean(lost[2:])", 0.75),
        ("first(lost)", 2.0),
        ("first(error > 100)", 6.0),
        ("last(lost)", 5.0),
        ("last(error > 100)", -1.0),
        ("count(error > 3)", 3.0),
        ("max(error) - min(error)", 8.0),
        ("median(error)", 4.0),
        ("error[-1]", 4.0),
        ("error[first(lost)]", 8.0),
        ("mean(error[lost == 0])", 1.5),
        ("estimate[2, 1]", 20.0),
        ("sum(estimate[:, 0])", 15.0),
        ("100 * count(lost) / len(lost)", 50.0),
        ("count(lost and error < 9)", 2.0),
        ("count(1 <= frame < 3)", 2.0),
        ("not any(lost[:2])", 1.0),
        ("-2 ** 2", -4.0),
        ("7 // 2 + 7 % 2", 4.0),
        ("sd(frame)", float(np.std(np.arange(6)))),
        ("round(sqrt(abs(-8.5)))", 3.0),
        ('"lost" if lost[-1] else "held"', "lost"),
        ('"lost" if all(lost) else "held"', "held"),
    ],
)
def test_an_expression_comes_to_a_number_or_a_text(text: str, value: float | str) -> None:
    """Columns are taken by frames, compared, counted and averaged; what is not known is left out."""
    assert parse(text).value(COLUMNS) == value


@pytest.mark.parametrize(
    "text",
    [
        "",
        "mean(lost",
        "lost; error",
        "x = 1",
        "__import__('os').system('true')",
        "lost.__class__",
        "().__class__.__bases__",
        "(lambda: 1)()",
        "[x for x in lost]",
        "f'{lost}'",
        "mean(*lost)",
        "mean(lost, 0)",
        "mean(axis=0)",
        "open(lost)",
        "mean",
        "lost @ lost",
        "lost << 99",
        "b'1'",
        "1j",
        "...",
        "None",
        "{1: 2}",
        "(y := 3)",
        "lost[0]()",
        "9" * LONGEST + "9",
        "(" * 190 + "1" + ")" * 190 + "+lost[",
        "-" * 300 + "1",
    ],
)
def test_what_is_not_allowed_is_refused(text: str) -> None:
    """No attribute, no other call, no comprehension, no depth: a sentence says what cannot be used."""
    with pytest.raises(ExpressionError, match=r"\w+ \w+"):
        parse(text).value(COLUMNS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mean(losst)", "did you mean lost"),
        ("lost", "6 numbers"),
        ("estimate[0]", "2 numbers"),
        ("lost[0.5]", "no number of a frame"),
        ("lost[0, 0]", "2 places"),
        ("lost[::0]", "no range"),
        ("lost[:3] + lost", "do not go together"),
        ("'a' + 1", "a text"),
        ("1 if lost else 2", "one number"),
        ("first(estimate)", "one number a frame"),
        ("len(3)", "takes a column"),
        ("lost[(1, 2), (3,)]", "brackets"),
    ],
)
def test_what_has_no_value_in_any_run_says_why(text: str, words: str) -> None:
    """The sentence names what is wrong, and it is not blamed on the run."""
    with pytest.raises(ExpressionError, match=words) as caught:
        parse(text).value(COLUMNS)
    assert not isinstance(caught.value, NoValueError)


@pytest.mark.parametrize(
    "text", ["lost[99]", "mean(error[4:5])", "error[4]", "1 / 0", "max(error[9:])", "9e999 - 9e999"]
)
def test_what_has_no_value_in_this_run_is_told_apart(text: str) -> None:
    """A frame that is not there, the mean of nothing, an infinity: another run may have one."""
    with pytest.raises(NoValueError):
        parse(text).value(COLUMNS)


def test_work_is_bounded() -> None:
    """No array may grow: columns that are set against each other crosswise are refused before they are computed."""
    columns = {"long": np.ones((2000, 8, 8))}
    begun = time.process_time()
    for text in (
        "long[:, 0:1, 0:1] + long[0:1, 0, :]",
        "long[:, 0:1, 0] * long[:, 0, 0]",
        "9**9**9**9**9",
        "2.0**99999",
    ):
        with pytest.raises(ExpressionError):
            parse(text).value(columns)
    assert time.process_time() - begun < 5


@settings(max_examples=150, deadline=None)
@given(st.text(alphabet="lostfram()[]:.,-+*/<>=! 0129e'\"if else and not mean first", max_size=40))
def test_any_text_is_refused_or_has_a_value(text: str) -> None:
    """Nothing but the module's own errors leaves it."""
    try:
        value = parse(text).value(COLUMNS)
    except ExpressionError:
        return
    assert isinstance(value, str) or np.isfinite(value)
