"""Layouts: what the panels of a lesson say, declared in a file that a person can mend."""

from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.teaching.lessons.figure import Handle, Number, look

PANEL = """
panels:
  density:
    title: At step {step}
    x: {title: x, low: -1.0, high: 1.0}
    y: {title: density}
    traces:
      prior: {kind: curve, title: prior, dashed: true}
      known: {kind: curve, title: "{name}", ink: truth}
    handles: {place: x}
    words: The mean is {mean:.2f}.
numbers:
  mean: {title: "Mean, {how}", unit: m, digits: 3}
"""


class Turned(Parameters):
    """What can be dragged."""

    place: int = parameter(2, "Place", "Where it is.", within=(0, 6, 1))


def declared(folder: Path, text: str) -> str:
    """Write the file beside a module, and return the module's path."""
    (folder / "lesson.yaml").write_text(text)
    return str(folder / "lesson.py")


def test_a_panel_has_the_words_of_its_file_and_the_numbers_given(tmp_path: Path) -> None:
    """Titles and words name numbers, traces without numbers are left out, and handles stand at their parameters."""
    of_file = look(declared(tmp_path, PANEL))
    x = np.array([0.0, 1.0])
    panel = of_file.draw("density", {"known": (x, 2 * x)}, turned=Turned(), y=(0.0, 3.0), step=4, name="it", mean=0.125)
    assert (panel.id, panel.title, panel.words) == ("density", "At step 4", "The mean is 0.12.")
    assert (panel.x.low, panel.x.high, panel.y.low, panel.y.high) == (-1.0, 1.0, 0.0, 3.0)
    assert panel.handles == (Handle(parameter="place", at=2.0),)
    [trace] = panel.traces
    assert (trace.title, trace.ink, trace.y.tolist()) == ("it", "truth", [0.0, 2.0])
    assert of_file.draw("density", {}, step=4, mean=0).handles == ()
    with pytest.raises(ValueError, match="a curve needs y"):
        of_file.draw("density", {"known": {"x": x}}, step=4, name="it", mean=0)


def test_a_number_has_the_words_of_its_file_and_the_values_given(tmp_path: Path) -> None:
    """By their order or by name; whether it is within its tolerance follows."""
    of_file = look(declared(tmp_path, PANEL))
    [number] = of_file.show((), {"mean": (1.0, 1.5, 0.5)}, how="on a grid").numbers
    assert number == Number("Mean, on a grid", 1.0, 1.5, 0.5, unit="m", digits=3)
    assert (number.within, str(number)) == (True, "Mean, on a grid: 1 m, exact 1.5 m, within 0.5 m")
    [named] = of_file.show((), {"mean": {"value": 1.0, "reveals": True}}, how="").numbers
    assert (named.value, named.exact, named.within, named.reveals) == (1.0, None, None, True)


@pytest.mark.parametrize(
    ("right", "wrong", "line", "said"),
    [
        ("kind: curve, title: prior", "kind: bend, title: prior", 8, "bend"),
        ("dashed: true", "size_px: 3", 8, "unknown field 'curve.size_px'"),
        ("ink: truth", "ink: green", 9, "ink"),
        ("title: density", "titel: density", 6, "titel"),
        ("{place: x}", "{place: z}", 10, "handles"),
        ("unit: m,", "in: m,", 13, "unknown field 'in'"),
        ("title: At step {step}", "name: At step {step}", 4, "unknown field 'name'"),
    ],
)
def test_what_is_wrong_is_told_by_file_and_line(tmp_path: Path, right: str, wrong: str, line: int, said: str) -> None:
    """A wrong kind, a field of another kind, a colour that is not in the palette, misspelt and misplaced fields."""
    with pytest.raises(ValueError, match=rf"lesson\.yaml, line {line}: .*{said}"):
        look(declared(tmp_path, PANEL.replace(right, wrong, 1)))
