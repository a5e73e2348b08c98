"""A lesson's figure drawn by matplotlib, trace by trace: in print, in a notebook and as a file.

Panels are in their rows, each with its title and keys above it. On a screen users drag handles; here a dotted line
marks each of them.
"""

from collections.abc import Callable, Mapping
from itertools import groupby
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import COLOURS, hexadecimal
from pftrack.output.figures.style import HEADING_PT, INK, TEXT_PT, bare, encode_as
from pftrack.teaching.lessons.figure import (
    Axis,
    Bars,
    Curve,
    Figure,
    HeatMap,
    Histogram,
    Panel,
    Rule,
    Scatter,
    Stems,
    StripChart,
    Tree,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawn
    from matplotlib.gridspec import SubplotSpec


Look: TypeAlias = "dict[str, Any]"
"""Arguments of matplotlib's artists: colour, title in the key, and depth of a trace."""


def across(axes: "Axes", along: str, at: float, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own properties
    """Draw a line across the panel at a value of one of its axes."""
    (axes.axvline if along == "x" else axes.axhline)(at, **style)


def _curve(axes: "Axes", trace: Curve, look: Look) -> None:
    axes.plot(trace.x, trace.y, "--" if trace.dashed else "-", linewidth=1.8, **look)
    if trace.area is not None:
        low, high = trace.area
        x = np.unique(np.concatenate([trace.x[(low <= trace.x) & (trace.x <= high)], [low, high]]))
        axes.fill_between(x, np.interp(x, trace.x, trace.y), alpha=0.18, linewidth=0.0, **_unnamed(look))


def _histogram(axes: "Axes", trace: Histogram, look: Look) -> None:
    axes.stairs(trace.heights, trace.edges, fill=True, alpha=0.3, **look)
    axes.stairs(trace.heights, trace.edges, linewidth=0.8, **_unnamed(look))


def _heat_map(axes: "Axes", trace: HeatMap, look: Look) -> None:
    extent = (*_ends(trace.x), *_ends(trace.y))
    where = {"extent": extent, "origin": "lower", "aspect": axes.get_aspect(), "zorder": look["zorder"]}
    axes.imshow(trace.values, cmap="viridis", vmin=0.0, **where)


def _stems(axes: "Axes", trace: Stems, look: Look) -> None:
    axes.vlines(trace.x, 0.0, trace.y, linewidth=1.0, alpha=0.7, **_unnamed(look))
    axes.plot(trace.x, trace.y, "o", markersize=3.0, **look)


def _bars(axes: "Axes", trace: Bars, look: Look, panel: Panel) -> None:
    alike = [each for each in panel.traces if isinstance(each, Bars) and each.stacked == trace.stacked]
    place = next(number for number, each in enumerate(alike) if each is trace)
    if trace.stacked:
        low, height = (place - 0.4, 0.8) if panel.y.names else (0.0, 1.0)
        starts = np.concatenate([[0.0], np.cumsum(trace.heights)[:-1]])
        shades = np.where(np.arange(len(trace.heights)) % 2, 0.45, 0.85)
        for name, (width, start, shade) in enumerate(zip(trace.heights, starts, shades, strict=True)):
            named = look if name == 0 else _unnamed(look)
            axes.barh(low, width, height, start, align="edge", alpha=float(shade), edgecolor="white", **named)
        return
    thickness = 0.8 / len(alike)
    middles = np.arange(len(trace.heights)) + (place - (len(alike) - 1) / 2) * thickness
    lying = bool(panel.y.names) and not panel.x.names
    (axes.barh if lying else axes.bar)(middles, trace.heights, thickness, **look)


def _scatter(axes: "Axes", trace: Scatter, look: Look) -> None:
    area = (0.75 * trace.size_px) ** 2  # in points; a pixel of the screen has three quarters of a point
    axes.scatter(trace.x, trace.y, s=area, linewidths=0.0, **look)


def _strip_chart(axes: "Axes", trace: StripChart, look: Look) -> None:
    axes.plot(trace.x, trace.y, "o-", linewidth=1.2, markersize=3.5, **look)


def _tree(axes: "Axes", trace: Tree, look: Look) -> None:
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    born, rows = np.nonzero(np.isfinite(trace.parents))
    places = trace.parents[born, rows]
    segments = np.stack([np.column_stack([born - 1, places]), np.column_stack([born, rows])], axis=1)
    strengths = np.clip(trace.weights, 0.1, 1.0)
    colours = list(_fade(trace, strengths[born, rows]))
    axes.add_collection(
        LineCollection(list(segments), colors=colours, linewidths=0.8, zorder=look["zorder"]), autolim=False
    )
    generations, particles = np.indices(trace.weights.shape)
    dots = {**look, "color": _fade(trace, strengths.ravel())}
    axes.scatter(generations.ravel(), particles.ravel(), s=6.0, linewidths=0.0, **dots)


def _rule(axes: "Axes", trace: Rule, look: Look) -> None:
    across(axes, trace.along, trace.at, linestyle="--" if trace.dashed else "-", linewidth=1.2, **look)


DRAWERS: Mapping[str, Callable[["Axes", Any, Look], None]] = {
    "curve": _curve,
    "histogram": _histogram,
    "heat map": _heat_map,
    "stems": _stems,
    "scatter": _scatter,
    "strip chart": _strip_chart,
    "tree": _tree,
    "rule": _rule,
}
"""Drawing functions of each kind of trace except bars, which depend on others of their panel."""


def _unnamed(look: Look) -> Look:
    """Return a look without its place in the key."""
    return {name: value for name, value in look.items() if name != "label"}


def _fade(trace: Any, strengths: Floats) -> Floats:  # noqa: ANN401 - any trace has an ink
    """Return (n, 4) RGBA of 0..1: the trace's ink, each as opaque as it is strong."""
    colour = np.array(COLOURS[trace.ink]) / 255.0
    return np.column_stack([np.broadcast_to(colour, (len(strengths), 3)), strengths])


def _ends(middles: Floats) -> tuple[float, float]:
    """Return where a row of cells begins and ends, given their middles."""
    half = 0.5 * (middles[1] - middles[0]) if len(middles) > 1 else 0.5
    return float(middles[0] - half), float(middles[-1] + half)


WIDTH_IN, ROW_IN = 9.0, 2.8
"""In inches: width of a figure, and height of its lowest row."""
HEIGHTS_IN = 4.2, 10.0
"""In inches: the least and the greatest height of a figure."""
KEY_CHARACTERS = 82
"""Characters of keys that fit side by side over the whole width of a figure."""


def draw(figure: Figure) -> "Drawn":
    """Draw a figure, its panels in their rows."""
    # Loading takes half a second, which only who draws has to wait for.
    from matplotlib.figure import Figure as Drawn  # noqa: PLC0415

    rows = [tuple(members) for _, members in groupby(figure.panels, key=lambda panel: panel.row)]
    heights = [max(panel.share[0] for panel in row) for row in rows]
    height = float(np.clip(ROW_IN * sum(heights) / min(heights), *HEIGHTS_IN))
    drawn = Drawn(figsize=(WIDTH_IN, height), layout="constrained")
    grid = drawn.add_gridspec(len(rows), 1, height_ratios=heights)
    for number, row in enumerate(rows):
        _row(drawn, row, grid[number, 0])
    return drawn


def encode(figure: Figure, suffix: str) -> bytes:
    """Return a figure as the content of a file, the same bytes whenever it is drawn.

    Args:
        figure: The figure.
        suffix: One of `pftrack.output.figures.style.SUFFIXES`.

    Raises:
        ValueError: The suffix is none of them.
    """
    return encode_as(draw(figure), suffix, figure.panels[0].title)


def _row(drawn: "Drawn", panels: tuple[Panel, ...], place: "SubplotSpec") -> None:
    widths = [panel.share[1] for panel in panels]
    cells = place.subgridspec(1, len(panels), width_ratios=widths)
    for column, panel in enumerate(panels):
        _panel(drawn.add_subplot(cells[0, column]), panel, widths[column] / sum(widths))


def _panel(axes: "Axes", panel: Panel, width: float) -> None:
    bare(axes)
    _axis(axes, panel.x, "x")
    _axis(axes, panel.y, "y")
    for order, trace in enumerate(panel.traces):
        look = {"color": hexadecimal(COLOURS[trace.ink]), "label": trace.title, "zorder": 2.0 + 0.01 * order}
        if isinstance(trace, Bars):
            _bars(axes, trace, look, panel)
        else:
            DRAWERS[trace.kind](axes, trace, look)
    pictured = any(trace.kind == "heat map" for trace in panel.traces)
    for handle in panel.handles:
        colour = INK["paper" if pictured else "outline"]
        across(axes, handle.along, handle.at, color=colour, linestyle=":", linewidth=1.5, zorder=4.0)
    _key(axes, panel, width)


def _axis(axes: "Axes", axis: Axis, along: str) -> None:
    axes.set(
        **{
            f"{along}lim": (axis.low, axis.high),
            f"{along}label": f"{axis.title} ({axis.unit})" if axis.unit else axis.title,
            f"{along}scale": "log" if axis.log else "linear",
        }
    )
    line = axes.xaxis if along == "x" else axes.yaxis
    if axis.names:
        line.set_ticks(range(len(axis.names)), list(axis.names))
    if axis.hidden:
        line.set_ticks([])
        line.grid(visible=False)


def _key(axes: "Axes", panel: Panel, width: float) -> None:
    """Write the title over the panel, and under it what the traces are."""
    handles, titles = axes.get_legend_handles_labels()
    if not handles:
        axes.set_title(panel.title, loc="left", fontsize=HEADING_PT)
        return
    longest = max(len(title) for title in titles) + 6
    legend = axes.legend(
        handles,
        titles,
        title=panel.title,
        title_fontsize=HEADING_PT,
        fontsize=TEXT_PT,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        ncols=max(1, min(len(titles), int(KEY_CHARACTERS * width / longest))),
        alignment="left",
        frameon=False,
        borderpad=0.0,
    )
    legend.set_zorder(5.0)
