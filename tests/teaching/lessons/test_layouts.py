"""Layouts: what the panels of a lesson say, declared in a file that a person can mend."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.teaching.lessons.figure import Curve, Handle, layouts

PANEL = """
density:
  title: At step {step}
  x: {title: x, low: -1.0, high: 1.0}
  y: {title: density}
  traces:
    prior: {kind: curve, title: prior, dashed: true}
    known: {kind: curve, title: "{name}", ink: truth}
  handles: {place: x}
  words: The mean is {mean:.2f}.
"""


class Turned(Parameters):
    """What can be dragged."""

    place: int = parameter(2, "Place", "Where it is.", within=(0, 5, 1))


def declared(folder: Path, text: str) -> str:
    """Write the file beside a module, and return the module's path."""
    (folder / "lesson.yaml").write_text(text)
    return str(folder / "lesson.py")


def test_a_panel_has_the_words_of_its_file_and_the_numbers_given(tmp_path: Path) -> None:
    """Titles and words name numbers, traces without numbers are left out, and handles stand at their parameters."""
    layout = layouts(declared(tmp_path, PANEL))["density"]
    x = np.array([0.0, 1.0])
    panel = layout.draw({"known": (x, 2 * x)}, turned=Turned(), y=(0.0, 3.0), step=4, name="it", mean=0.125)
    assert (panel.id, panel.title, panel.words) == ("density", "At step 4", "The mean is 0.12.")
    assert (panel.x.low, panel.x.high, panel.y.low, panel.y.high) == (-1.0, 1.0, 0.0, 3.0)
    assert panel.handles == (Handle(parameter="place", at=2.0),)
    [trace] = panel.traces
    assert isinstance(trace, Curve)
    assert (trace.title, trace.ink, trace.y.tolist()) == ("it", "truth", [0.0, 2.0])
    assert layout.draw({}, step=4, mean=0).handles == ()
    with pytest.raises(ValidationError, match="y"):
        layout.draw({"known": {"x": x}}, step=4, name="it", mean=0)


@pytest.mark.parametrize(
    ("right", "wrong", "line", "said"),
    [
        ("kind: curve, title: prior", "kind: bend, title: prior", 7, "no kind 'bend'"),
        ("dashed: true", "size_px: 3", 7, "a curve has no size_px"),
        ("ink: truth", "ink: green", 8, "ink"),
        ("title: density", "titel: density", 5, "titel"),
        ("{place: x}", "{place: z}", 9, "handles"),
        ("title: At step {step}", "name: At step {step}", 3, "unknown field 'name'"),
    ],
)
def test_what_is_wrong_is_told_by_file_and_line(tmp_path: Path, right: str, wrong: str, line: int, said: str) -> None:
    """A wrong kind, a field of another kind, a colour that is not in the palette, misspelt and misplaced fields."""
    with pytest.raises(ValueError, match=rf"lesson\.yaml, line {line}: .*{said}"):
        layouts(declared(tmp_path, PANEL.replace(right, wrong, 1)))
