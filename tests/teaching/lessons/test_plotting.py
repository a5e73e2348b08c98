"""A lesson's figure: declared in a file, and drawn by matplotlib with room for its texts."""

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
    """It has its points, colour and dashes; the shaded interval may end between points. Every kind has a drawer.

    A strip chart has a gap where a value is missing.
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


def test_axes_have_titles_units_limits_names_and_a_key() -> None:
    """Names replace numbers, an axis may be logarithmic, and only traces with a title are in the key."""
    names = Axis(title="", low=-0.5, high=1.5, names=("on", "off"))
    axes = drawn(Bars(heights=[1, 2]), x=names, y=Axis(title="error", low=0.1, high=9, unit="px", log=True))
    assert axes.get_ylabel() == "error (px)"
    assert axes.get_yscale() == "log"
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 1.5), (0.1, 9))
    assert [label.get_text() for label in axes.get_xticklabels()] == ["on", "off"]
    assert axes.get_legend() is None
    assert axes.get_title(loc="left") == "What it shows"
    legend = drawn(Curve(title="density", x=[0, 1], y=[0, 1]), Curve(x=[0, 1], y=[1, 0])).get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["density"]
    assert legend.get_title().get_text() == "What it shows"


def test_traces_have_their_places_and_heights() -> None:
    """Bars of a histogram adjoin, a stem is a line and a dot, cells of a heat map reach half a step out.

    A line of a tree joins a particle to its parent; a rule crosses the panel, and a handle is a dotted line.
    """
    shapes = [
        panel(Histogram(title="draws", edges=[0, 1, 3], heights=[2, 0.5])),
        panel(Stems(title="draws", x=[1, 2], y=[3, 1])),
        panel(parts.HeatMap(x=[0, 1, 2], y=[0, 2], values=[[1, 2, 3], [4, 5, 6]])),
        panel(Tree(parents=[[np.nan, np.nan], [1, 1]], weights=[[1, 0.5], [1, 1]])),
        panel(Rule(title="mean", at=2.5, along="y"), handles=(Handle(parameter="z", at=1.5),)),
    ]
    histogram, stems, heat, tree, rules = draw(Figure(panels=shapes)).axes
    values, edges, _ = histogram.patches[0].get_data()
    assert (values.tolist(), edges.tolist()) == ([2, 0.5], [0, 1, 3])
    lines = [segment.tolist() for segment in stems.collections[0].get_segments()]
    assert lines == [[[1, 0], [1, 3]], [[2, 0], [2, 1]]]
    assert stems.lines[0].get_ydata().tolist() == [3, 1]
    (image,) = heat.images
    assert list(image.get_extent()) == [-0.5, 2.5, -1.0, 3.0]
    assert (image.origin, image.get_array()[0].tolist(), image.get_clim()) == ("lower", [1, 2, 3], (0.0, 6.0))
    branches, dots = tree.collections
    assert [segment.tolist() for segment in branches.get_segments()] == [[[0, 1], [1, 0]], [[0, 1], [1, 1]]]
    assert len(dots.get_offsets()) == 4
    rule, handle = rules.lines
    assert (set(rule.get_ydata()), set(handle.get_xdata()), handle.get_linestyle()) == ({2.5}, {1.5}, ":")


def test_bars_are_side_by_side_or_stacked() -> None:
    """Two traces share the space of a name, horizontally if the y axis has the names; shares of a whole adjoin."""
    names = Axis(title="", low=-0.5, high=1.5, names=("a", "b"))
    shares = Bars(title="shares", heights=[0.5, 0.3, 0.2], stacked=True)
    shapes = [
        panel(Bars(title="one", heights=[1, 2]), Bars(title="two", heights=[3, 4]), x=names),
        panel(Bars(heights=[1, 2]), y=names),
        panel(shares, y=Axis(title="", low=0, high=1)),
        panel(shares, shares.model_copy(), y=names),
    ]
    pairs, lying, whole, rows = draw(Figure(panels=shapes)).axes
    assert [bar.get_x() + bar.get_width() / 2 for bar in pairs.patches] == pytest.approx([-0.2, 0.8, 0.2, 1.2])
    assert [bar.get_height() for bar in pairs.patches] == [1, 2, 3, 4]
    assert [(bar.get_y() + bar.get_height() / 2, bar.get_width()) for bar in lying.patches] == [(0, 1), (1, 2)]
    assert [bar.get_x() for bar in whole.patches] == pytest.approx([0.0, 0.5, 0.8])
    assert {(bar.get_y(), bar.get_height()) for bar in whole.patches} == {(0.0, 1.0)}
    assert whole.patches[0].get_alpha() != whole.patches[1].get_alpha()
    assert sorted({round(bar.get_y(), 6) for bar in rows.patches}) == [-0.4, 0.6]


def test_files_are_the_same_again() -> None:
    """The bytes of a file do not depend on the time; another suffix is refused with the possible ones."""
    figure = Figure(panels=(panel(Curve(title="p", x=[0, 1], y=[0, 1])),))
    for suffix, begins in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        content = encode(figure, suffix)
        assert content.startswith(begins)
        assert content == encode(figure, suffix)
    with pytest.raises(ValueError, match=r"\.png, \.svg, \.pdf, got '\.gif'"):
        encode(figure, ".gif")


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_every_lesson_is_drawn_with_room_for_its_texts(name: str) -> None:
    """Each panel has its axes, and titles and keys are within the figure."""
    figure = shown(LESSONS[name]).figure
    made = draw(figure)
    made.draw_without_rendering()
    assert len(made.axes) == len(figure.panels)
    for axes, each in zip(made.axes, figure.panels, strict=True):
        box = (axes.get_legend() or axes.title).get_window_extent()
        assert box.x1 <= made.bbox.x1 + 1, each.id
        assert box.y1 <= made.bbox.y1 + 1, each.id


# Layouts: the texts of a lesson's panels, declared in a file.

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
    """The parameter of a handle."""

    place: int = parameter(2, "Place", "Where it is.", within=(0, 6, 1))


def declared(folder: Path, text: str) -> str:
    """Write the file next to a module, and return the module's path."""
    (folder / "lesson.yaml").write_text(text)
    return str(folder / "lesson.py")


def test_a_figure_has_the_words_of_its_file_and_the_numbers_given(tmp_path: Path) -> None:
    """Titles and words contain numbers, traces without numbers are omitted, and handles are at their parameters.

    Numbers are given by position or by name.
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
        ("{place: x}", "{place: z}", 10, "handles"),
        ("unit: m,", "in: m,", 13, "unknown field 'in'"),
    ],
)
def test_a_mistake_is_reported_with_file_and_line(tmp_path: Path, right: str, wrong: str, line: int, said: str) -> None:
    """So are a wrong kind, a field of another kind, a colour outside the palette, and unknown fields."""
    with pytest.raises(ValueError, match=rf"lesson\.yaml, line {line}: .*{said}"):
        parts.look(declared(tmp_path, PANEL.replace(right, wrong, 1)))
