"""A lesson's figure: declared in a file that a person can mend, and drawn by matplotlib with room for its texts."""

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex

from pftrack.core.model.drawing import COLOURS, hexadecimal
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.teaching.lessons import LESSONS, Figure
from pftrack.teaching.lessons import figure as parts
from pftrack.teaching.lessons.figure import Axis, Bars, Curve, Handle, Histogram, Rule, Stems, StripChart, Tree
from pftrack.teaching.lessons.traces import DRAWERS, draw, encode
from tests.teaching.lessons.demonstrations import DEMONSTRATIONS, shown

UNIT = Axis(title="x", low=0.0, high=4.0, unit="m")


def panel(*traces: Any, **more: Any) -> parts.Panel:
    y = Axis(title="y", low=0.0, high=4.0)
    return parts.Panel(**{"id": "it", "title": "What it shows", "x": UNIT, "y": y, "traces": traces} | more)


def drawn(*traces: Any, **more: Any) -> Axes:
    return draw(Figure(panels=(panel(*traces, **more),))).axes[0]


def test_a_curve_is_drawn_in_its_ink_with_its_area() -> None:
    """Points, colour, dashes and the shaded interval, which ends where it is said to, between points too.

    A strip chart leaves gaps: where there is no value there is no dot, and no line across. No kind lacks a drawer.
    """
    axes = drawn(Curve(title="curve", ink="observation", x=[0, 1, 2], y=[0, 2, 0], dashed=True, area=(0.5, 1.5)))
    (line,) = axes.lines
    assert line.get_xdata().tolist() == [0, 1, 2]
    assert to_hex(line.get_color()) == hexadecimal(COLOURS["observation"])
    assert line.get_linestyle() == "--"
    shaded = axes.collections[0].get_paths()[0].vertices
    assert (shaded[:, 0].min(), shaded[:, 0].max()) == (0.5, 1.5)
    assert shaded[:, 1].max() == 2.0
    (line,) = drawn(StripChart(title="variance", x=[0, 1, 2], y=[1, np.nan, 2])).lines
    assert line.get_marker() == "o"
    assert np.isnan(line.get_ydata()).tolist() == [False, True, False]
    assert {*DRAWERS, "bars"} == {it.model_fields["kind"].default for it in get_args(get_args(parts.Trace)[0])}


def test_axes_have_titles_units_limits_and_names() -> None:
    """What is measured, in what unit, from where to where; names in place of numbers; a logarithmic axis."""
    axes = drawn(
        Bars(heights=[1, 2]),
        x=Axis(title="", low=-0.5, high=1.5, names=("on", "off")),
        y=Axis(title="error", low=0.1, high=9, unit="px", log=True),
    )
    assert axes.get_ylabel() == "error (px)"
    assert axes.get_yscale() == "log"
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 1.5), (0.1, 9))
    assert [label.get_text() for label in axes.get_xticklabels()] == ["on", "off"]


def test_draws_have_their_places_and_heights() -> None:
    """The bars of a histogram adjoin, each as high as it is said to be; a stem is one line and one dot."""
    axes = drawn(Histogram(title="draws", edges=[0, 1, 3], heights=[2, 0.5]))
    values, edges, _ = axes.patches[0].get_data()
    assert values.tolist() == [2, 0.5]
    assert edges.tolist() == [0, 1, 3]
    axes = drawn(Stems(title="draws", x=[1, 2], y=[3, 1]))
    assert [segment.tolist() for segment in axes.collections[0].get_segments()] == [[[1, 0], [1, 3]], [[2, 0], [2, 1]]]
    assert axes.lines[0].get_ydata().tolist() == [3, 1]


def test_a_heat_map_covers_its_cells() -> None:
    """Cells reach half a step beyond their middles, the first row lies at the first y, nothing is the darkest."""
    axes = drawn(parts.HeatMap(x=[0, 1, 2], y=[0, 2], values=[[1, 2, 3], [4, 5, 6]]))
    (image,) = axes.images
    assert list(image.get_extent()) == [-0.5, 2.5, -1.0, 3.0]
    assert image.origin == "lower"
    assert image.get_array()[0].tolist() == [1, 2, 3]
    assert image.get_clim() == (0.0, 6.0)


def test_bars_stand_side_by_side_at_their_names() -> None:
    """Two traces share the room of a name; along a y axis with names they lie."""
    names = Axis(title="", low=-0.5, high=1.5, names=("a", "b"))
    axes = drawn(Bars(title="one", heights=[1, 2]), Bars(title="two", heights=[3, 4]), x=names)
    assert [bar.get_x() + bar.get_width() / 2 for bar in axes.patches] == pytest.approx([-0.2, 0.8, 0.2, 1.2])
    assert [bar.get_height() for bar in axes.patches] == [1, 2, 3, 4]
    lying = drawn(Bars(heights=[1, 2]), y=names)
    assert [(bar.get_y() + bar.get_height() / 2, bar.get_width()) for bar in lying.patches] == [(0, 1), (1, 2)]


def test_stacked_bars_lie_end_to_end() -> None:
    """Shares of a whole follow each other along x, a row for each trace where the y axis has names."""
    shares = Bars(title="shares", heights=[0.5, 0.3, 0.2], stacked=True)
    whole = drawn(shares, y=Axis(title="", low=0, high=1))
    assert [bar.get_x() for bar in whole.patches] == pytest.approx([0.0, 0.5, 0.8])
    assert {(bar.get_y(), bar.get_height()) for bar in whole.patches} == {(0.0, 1.0)}
    rows = drawn(shares, shares.model_copy(), y=Axis(title="", low=-0.5, high=1.5, names=("a", "b")))
    assert sorted({round(bar.get_y(), 6) for bar in rows.patches}) == [-0.4, 0.6]
    neighbours = [bar.get_alpha() for bar in whole.patches[:2]]
    assert neighbours[0] != neighbours[1]


def test_a_tree_joins_each_particle_to_its_parent() -> None:
    """A line from (generation before, row of the parent) to (generation, row)."""
    axes = drawn(Tree(parents=[[np.nan, np.nan], [1, 1]], weights=[[1, 0.5], [1, 1]]))
    lines, dots = axes.collections
    assert [segment.tolist() for segment in lines.get_segments()] == [[[0, 1], [1, 0]], [[0, 1], [1, 1]]]
    assert len(dots.get_offsets()) == 4


def test_rules_and_handles_stand_at_their_values() -> None:
    """A rule across, and a dotted line where a parameter can be turned on a screen."""
    rule, handle = drawn(Rule(title="mean", at=2.5, along="y"), handles=(Handle(parameter="z", at=1.5),)).lines
    assert set(rule.get_ydata()) == {2.5}
    assert set(handle.get_xdata()) == {1.5}
    assert handle.get_linestyle() == ":"


def test_the_key_names_what_has_a_title() -> None:
    """Traces without a title need no key; the panel's title stands over it."""
    legend = drawn(Curve(title="density", x=[0, 1], y=[0, 1]), Curve(x=[0, 1], y=[1, 0])).get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["density"]
    assert legend.get_title().get_text() == "What it shows"
    alone = drawn(Curve(x=[0, 1], y=[1, 0]))
    assert alone.get_legend() is None
    assert alone.get_title(loc="left") == "What it shows"


def test_files_are_the_same_again() -> None:
    """A file of each kind, whose bytes do not depend on when it was made; for others it is said what can be written."""
    figure = Figure(panels=(panel(Curve(title="p", x=[0, 1], y=[0, 1])),))
    for suffix, begins in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        content = encode(figure, suffix)
        assert content.startswith(begins)
        assert content == encode(figure, suffix)
    with pytest.raises(ValueError, match=r"\.png, \.svg, \.pdf, got '\.gif'"):
        encode(figure, ".gif")


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_every_lesson_is_drawn_with_room_for_its_texts(name: str) -> None:
    """Each panel has its axes, and no title or key reaches beyond the figure."""
    figure = shown(LESSONS[name]).figure
    made = draw(figure)
    made.draw_without_rendering()
    assert len(made.axes) == len(figure.panels)
    for axes, each in zip(made.axes, figure.panels, strict=True):
        box = (axes.get_legend() or axes.title).get_window_extent()
        assert box.x1 <= made.bbox.x1 + 1, each.id
        assert box.y1 <= made.bbox.y1 + 1, each.id


# Layouts: what the panels of a lesson say, declared in a file that a person can mend.

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


def test_a_figure_has_the_words_of_its_file_and_the_numbers_given(tmp_path: Path) -> None:
    """Titles and words name numbers, traces without numbers are left out, and handles stand at their parameters.

    Numbers are given by their order or by name; whether one is within its tolerance follows.
    """
    of_file = parts.look(declared(tmp_path, PANEL))
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
    [number] = of_file.show((), {"mean": (1.0, 1.5, 0.5)}, how="on a grid").numbers
    assert number == parts.Number("Mean, on a grid", 1.0, 1.5, 0.5, unit="m", digits=3)
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
        parts.look(declared(tmp_path, PANEL.replace(right, wrong, 1)))
