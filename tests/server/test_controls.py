"""How parameters are turned: sliders, boxes and words, from their declarations."""

from typing import Any

import pytest

from pftrack.core.model.parameters import Declaration
from pftrack_server.schemas.controls import control_of, controls_of, working_range


def declare(kind: str, **more: Any) -> Declaration:
    known = {"name": "a", "title": "Width", "description": "How wide.", "unit": "", "kind": kind, "default": 0}
    return Declaration.model_validate(known | more)


@pytest.mark.parametrize(
    ("declaration", "slider"),
    [
        (declare("number", minimum=0, maximum=200, step=1), (0, 200)),
        (declare("number", minimum=0, maximum=1), (0, 1)),
        (declare("integer", minimum=1, maximum=100_000, step=1), (1, 500)),
        (declare("integer", minimum=0, maximum=10**9, step=1), None),
        (declare("number", minimum=5, maximum=5), None),
        (declare("number", minimum=0), None),
        (declare("boolean"), None),
        (declare("choice", choices=("a", "b")), None),
    ],
)
def test_a_slider_goes_as_far_as_it_can_be_set_with(
    declaration: Declaration, slider: tuple[float, float] | None
) -> None:
    """Over the whole range, over a part of a wide one, and there is none where numbers are names."""
    control = control_of(declaration, 100)
    assert control.slider == slider
    assert slider is None or control.step


def test_the_words_name_unit_bounds_and_restart() -> None:
    """A label carries the unit; the hint says what it does, how far it goes, and what a change costs."""
    control = control_of(declare("number", minimum=0, maximum=200, unit="px", live=False), 7)
    assert control.label == "Width (px)"
    assert control.hint == "How wide. From 0 to 200 px. A change restarts the run."
    assert control_of(declare("boolean"), True).hint == "How wide."


def test_what_has_no_value_has_no_control() -> None:
    """Only parameters that the session has are offered, in their order."""
    declarations = [declare("boolean", name=name) for name in "cab"]
    assert [each.name for each in controls_of(declarations, {"b": True, "c": False})] == ["c", "b"]


@pytest.mark.parametrize(
    ("minimum", "maximum", "step", "value", "expected"),
    [
        (1, 100_000, 1, 800, (1, 5000)),
        (0, 1000, 0.5, 20, (0, 100)),
        (0.01, 200, 0.1, 4, (0.01, 20)),
        (-960, 960, 1, 0, (-200, 200)),
        (1, 100_000, 1, 60_000, (1, 100_000)),
    ],
)
def test_the_working_range_holds_the_value_and_round_numbers(
    minimum: float, maximum: float, step: float, value: float, expected: tuple[float, float]
) -> None:
    """It reaches to about five times what is in force, within the bounds."""
    declaration = declare("number", minimum=minimum, maximum=maximum, step=step)
    assert working_range(declaration, value) == pytest.approx(expected)
