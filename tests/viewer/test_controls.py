"""How parameters are turned: sliders, boxes and words, from their declarations."""

from typing import Any

import pytest

from pftrack.core.model.parameters import Declaration
from pftrack_server.viewer.panel import slider_range


def declare(kind: str, **more: Any) -> Declaration:
    known = {"name": "a", "title": "Width", "description": "How wide.", "unit": "", "kind": kind, "default": 0}
    return Declaration.model_validate(known | more)


@pytest.mark.parametrize(
    ("declaration", "slider"),
    [
        (declare("number", minimum=0, maximum=640, useful=(0, 200), step=1), (0, 200)),
        (declare("integer", minimum=0, maximum=640, useful=(0, 60), step=1), (0, 100)),
        (declare("number", minimum=-640, maximum=640, useful=(120, 200), step=1), (100, 200)),
        (declare("number", minimum=5, maximum=5, useful=(100, 100)), None),
        (declare("number", minimum=0), None),
    ],
)
def test_a_slider_covers_the_useful_range_and_the_value(
    declaration: Declaration, slider: tuple[float, float] | None
) -> None:
    """A value beyond the useful range widens it; what has no range has no slider."""
    assert slider_range(declaration, 100) == slider


def test_the_words_name_unit_bounds_and_restart() -> None:
    """A label carries the unit; the hint says what it does, how far it goes, and what a change costs."""
    declaration = declare("number", minimum=0, maximum=200, unit="px", live=False)
    assert declaration.label == "Width (px)"
    assert declaration.hint == "How wide. From 0 to 200 px. A change restarts the run."
    assert declare("boolean").hint == "How wide."
