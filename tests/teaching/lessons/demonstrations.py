"""Demonstration lessons, with the extremes of their parameters."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from pftrack.core.model.parameters import Declaration, Parameters, Value, declarations, revise
from pftrack.teaching.lessons import LESSONS, Figure
from pftrack.teaching.lessons.figure import Shown
from pftrack.teaching.lessons.lesson import Demonstration, Lesson

DEMONSTRATIONS = [name for name, lesson in LESSONS.items() if isinstance(lesson.body, Demonstration)]


def shown(lesson: Lesson, **changes: Value) -> Shown:
    return lesson.body.show(revise(lesson.body.parameters, changes), lesson.body.seed)


def asked_at(lesson: Lesson) -> Parameters:
    """Return the parameters of the question."""
    return revise(lesson.body.parameters, lesson.question.at)


def extremes(declaration: Declaration) -> tuple[Value, ...]:
    """Return the bounds of a parameter, or all its values if these are few."""
    match declaration.kind:
        case "boolean":
            return False, True
        case "choice":
            return declaration.choices
        case "integer" | "number":
            ends = declaration.minimum, declaration.maximum
            assert None not in ends
            return tuple(int(end) for end in ends) if declaration.kind == "integer" else ends
        case "sequence":
            letters = "".join(declaration.sequence)
            longest = int(declaration.maximum or 0)
            return "", (letters * longest)[:longest], *(letter * longest for letter in letters)
        case kind:
            raise AssertionError(f"say what the extremes of a parameter of the kind {kind} are")


def corners(lesson: Lesson) -> Iterator[dict[str, Value]]:
    """Yield the defaults with one parameter at an extreme; then all at their first, and all at their last."""
    declared = declarations(type(lesson.body.parameters))
    for each in declared:
        yield from ({each.name: value} for value in extremes(each))
    yield {each.name: extremes(each)[0] for each in declared}
    yield {each.name: extremes(each)[-1] for each in declared}


def assert_sound(figure: Figure) -> None:
    """Assert that a figure can be drawn: values are finite, gaps only in lines, and lengths agree."""
    Figure.model_validate(figure.model_dump(mode="json"))
    assert len({panel.id for panel in figure.panels}) == len(figure.panels) > 0
    for panel in figure.panels:
        assert panel.title, panel.id
        assert panel.words.endswith("."), f"{panel.id}: {panel.words}"
        for axis in (panel.x, panel.y):
            assert np.isfinite([axis.low, axis.high]).all()
            assert axis.low < axis.high, f"{panel.id}: {axis}"
            assert axis.low > 0 or not axis.log, f"{panel.id}: {axis}"
        for trace in panel.traces:
            arrays = {name: value for name, value in trace if isinstance(value, np.ndarray)}
            for name, values in arrays.items():
                assert not np.isinf(values).any(), f"{panel.id}, {trace.title}: {name}"
                may_have_gaps = (name == "y" and trace.kind in {"curve", "strip chart"}) or trace.kind == "tree"
                assert may_have_gaps or not np.isnan(values).any(), f"{panel.id}, {trace.title}: {name}"
            _assert_lengths(trace, arrays)


def _assert_lengths(trace: Any, arrays: dict[str, Any]) -> None:
    match trace.kind:
        case "histogram":
            assert len(arrays["edges"]) == len(arrays["heights"]) + 1
            assert (np.diff(arrays["edges"]) > 0).all()
        case "heat map":
            assert arrays["values"].shape == (len(arrays["y"]), len(arrays["x"]))
        case "tree":
            assert arrays["parents"].shape == arrays["weights"].shape
        case _:
            assert len({len(values) for values in arrays.values()}) <= 1, trace.title
