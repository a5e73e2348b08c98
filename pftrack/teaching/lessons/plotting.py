"""A lesson's figure drawn by matplotlib: in print, in a notebook and as a file.

Panels stand in their rows, each with its title and keys over it. On a screen one drags handles; here a dotted line
stands where each of them is.
"""

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from pftrack.output.figures.picture import encode_as
from pftrack.output.figures.style import HEADING_PT, INK, TEXT_PT, bare
from pftrack.teaching.lessons.figure import Axis, Figure, Panel
from pftrack.teaching.lessons.traces import DRAWERS, across

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawn
    from matplotlib.gridspec import SubplotSpec

__all__ = ["draw", "encode"]

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
        figure: What is drawn.
        suffix: One of `pftrack.output.figures.picture.SUFFIXES`.

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
    if any(trace.kind == "picture" for trace in panel.traces):
        axes.invert_yaxis()
    if panel.equal:
        axes.set_aspect("equal")
    for order, trace in enumerate(panel.traces):
        DRAWERS[trace.kind](axes, trace, panel, 2.0 + 0.01 * order)
    pictured = any(trace.kind in {"heat map", "picture"} for trace in panel.traces)
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
