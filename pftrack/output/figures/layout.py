"""Figures of several panels over the same axes: parts in one column, each with heading, panels and legend.

matplotlib arranges the panels. This module chooses the values of an axis that fit without touching each other, and the
number of columns of a legend.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.output.figures.style import HEADING_PT, INK, LETTERS_PT, TEXT_PT, bare

MOST_COLUMNS, FEWER_COLUMNS = 4, 3
"""Panels in a row: up to four fit in one row, more go into rows of three."""

LINE_IN, APART_IN, KEY_COLUMN_IN = 0.2, 0.1, 0.6
NARROW_EM, WIDE_EM = 0.54, 0.66
"""Widths of lower-case letters and of other characters, to estimate the length of a text before it is drawn."""

USABLE = 0.75
"""Share of a panel's room that the values of its other axis leave free."""


@dataclass(frozen=True)
class Values:
    """The values of an axis as text.

    Attributes:
        title: Title of the axis with its unit.
        texts: The values in order.
        is_named: Whether the values are names; long names are rotated, numbers are not.
    """

    title: str = ""
    texts: tuple[str, ...] = ("",)
    is_named: bool = False

    @property
    def longest(self) -> float:
        """Length of the longest value, in."""
        return max(_length(text, LETTERS_PT) for text in self.texts)

    def is_upright(self, wide: float) -> bool:
        """Return whether to rotate the values below a panel of this width, in."""
        return self.is_named and self.longest + APART_IN > USABLE * wide / len(self.texts)

    def below(self, wide: float) -> float:
        """Return the height of the values below a panel, in."""
        return self.longest if self.is_upright(wide) else LINE_IN

    def chosen(self, room: float, needed: float) -> tuple[NDArray[Any], list[str]]:
        """Return indices and texts of the values that fit into a length, in, if each needs this much."""
        places = np.arange(len(self.texts))[:: max(1, ceil(needed * len(self.texts) / (USABLE * room)))]
        return places, [self.texts[place] for place in places]


@dataclass(frozen=True)
class Part:
    """One or several rows of panels.

    Attributes:
        heading: Heading over the panels.
        count: Number of panels.
        size: Width and height of a panel with its values and titles, in.
        key: Entries of the legend.
        shared: Whether the panels have the same axes.
    """

    heading: str
    count: int
    size: tuple[float, float]
    key: Sequence[Artist] = ()
    shared: bool = True

    @property
    def columns(self) -> int:
        """Number of panels in a row."""
        return self.count if self.count <= MOST_COLUMNS else FEWER_COLUMNS

    @property
    def rows(self) -> int:
        """Number of rows of panels."""
        return ceil(self.count / self.columns)


def lay_out(parts: Sequence[Part]) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of parts in one column, and the panels of each."""
    width = max(part.columns * part.size[0] for part in parts)
    keys = [_key_columns(part.key, width) for part in parts]
    heights = [
        (1.5 + part.heading.count("\n") + ceil(len(part.key) / columns)) * LINE_IN + part.rows * part.size[1]
        for part, columns in zip(parts, keys, strict=True)
    ]
    figure = Figure(figsize=(width, sum(heights)), layout="constrained")
    rooms: Any = figure.subfigures(len(parts), 1, height_ratios=heights, squeeze=False)
    panels = [_fill(room, part, columns) for room, part, columns in zip(rooms[:, 0], parts, keys, strict=True)]
    return figure, panels


def _fill(room: SubFigure, part: Part, key_columns: int) -> list[Axes]:
    room.suptitle(part.heading, x=0.01, ha="left", fontsize=HEADING_PT)
    made = room.subplots(part.rows, part.columns, sharex=part.shared, sharey=part.shared, squeeze=False)
    panels = list(made.flat)
    for panel in panels[part.count :]:
        panel.set_visible(False)
    for panel in panels[max(part.count - part.columns, 0) : part.count]:
        panel.tick_params(labelbottom=True)
    if part.key:
        look: dict[str, Any] = {"frameon": False, "fontsize": TEXT_PT, "borderpad": 0.2}
        room.legend(handles=part.key, loc="outside lower left", ncols=key_columns, **look)
    return panels[: part.count]


def _key_columns(key: Sequence[Artist], width: float) -> int:
    longest = max((_length(str(one.get_label()), TEXT_PT) for one in key), default=0.0) + KEY_COLUMN_IN
    return min(max(int(width / longest), 1), max(len(key), 1))


def _length(text: str, points: float) -> float:
    """Return the estimated length of a text, in."""
    return sum(NARROW_EM if sign.islower() or sign == " " else WIDE_EM for sign in text) * points / 72


def write_across(panel: Axes, values: Values, wide: float) -> None:
    """Write values at equal distances below a panel of this width, in."""
    upright = values.is_upright(wide)
    places, texts = values.chosen(wide, LINE_IN if upright else values.longest + APART_IN)
    panel.set_xticks(places, texts, fontsize=LETTERS_PT, rotation=90 if upright else 0)


def write_up(panel: Axes, values: Values, high: float) -> None:
    """Write values at equal distances next to a panel of this height, in."""
    panel.set_yticks(*values.chosen(high, LINE_IN), fontsize=LETTERS_PT)


def draw_map(panel: Axes, title: str, values: Floats, colours: Colormap, scale: Normalize) -> AxesImage:
    """Draw the cells (rows, columns) of a map; unknown cells are hatched."""
    panel.set_title(title, fontsize=TEXT_PT)
    panel.patch.set(facecolor="white", edgecolor=INK["hatching"], hatch="////", linewidth=0)
    panel.tick_params(labelsize=LETTERS_PT)
    for spine in panel.spines.values():
        spine.set(color=INK["frame"], linewidth=0.6)
    cells = np.ma.masked_invalid(values)
    return panel.imshow(cells, colours, scale, origin="lower", aspect="auto", interpolation="nearest")


def draw_scale(panels: Sequence[Axes], image: AxesImage) -> None:
    """Draw the colour scale of maps next to them."""
    figure = panels[0].get_figure()
    if figure is not None:
        bar = figure.colorbar(image, ax=list(panels), aspect=30, pad=0.02)
        bar.ax.tick_params(labelsize=LETTERS_PT)
        bar.outline.set_visible(False)


def finish(panel: Axes, across: str, up: str) -> None:
    """Write the titles of a panel's axes, and draw a horizontal grid."""
    panel.set_xlabel(across)
    panel.set_ylabel(up)
    bare(panel, grid="y")


def draw_curve(
    panel: Axes,
    x: NDArray[Any],
    y: Floats,
    colour: str,
    interval: tuple[Floats, Floats] | None = None,
) -> None:
    """Draw a curve through points, with the interval of each if known."""
    if interval is not None:
        panel.fill_between(x, *interval, color=colour, alpha=0.2, linewidth=0)
    panel.plot(x, y, color=colour, marker="o", markersize=3, linewidth=1.5)


def draw_boxes(panel: Axes, ends: Floats, x: Floats, width: float, colour: str) -> None:
    """Draw a row of boxes with few artists, which is much faster than one artist per line.

    Args:
        panel: The panel.
        ends: (5, N) lower whisker, lower edge, median, upper edge, upper whisker.
        x: (N,) centres of the boxes.
        width: Width available for a box.
        colour: Colour of the boxes.
    """
    low, lower, median, upper, high = ends
    panel.bar(x, upper - lower, 0.85 * width, lower, color=colour, alpha=0.6, edgecolor="black", linewidth=0.8)
    panel.vlines([*x, *x], [*low, *upper], [*lower, *high], color="black", linewidth=0.8)
    for middle, half, line in ((low, 0.2, 0.8), (median, 0.42, 1.4), (high, 0.2, 0.8)):
        panel.hlines(middle, x - half * width, x + half * width, color="black", linewidth=line)


def draw_differences(
    panel: Axes,
    x: NDArray[np.floating[Any]],
    differences: Sequence[Floats],
    is_filled: Bools,
    colour: str,
) -> None:
    """Draw differences with their intervals, filled where significant.

    Args:
        panel: The panel.
        x: (N,) places.
        differences: Mean, lower and upper end, (N,) each.
        is_filled: (N,) whether to fill the marker.
        colour: Colour of all markers.
    """
    mean, low, high = differences
    panel.vlines(x, low, high, color=colour, linewidth=1.2)
    panel.plot(x, mean, "o", markerfacecolor="white", color=colour, markersize=5)
    panel.plot(x[is_filled], mean[is_filled], "o", color=colour, markersize=5)
    panel.axhline(0, color=INK["frame"], linewidth=0.8)


def key_line(text: str, colour: str, *, size: float = 3, is_box: bool = False) -> Line2D:
    """Return the entry of a curve or a row of boxes in a legend."""
    if is_box:
        return Line2D([], [], color=colour, label=text, linewidth=6, alpha=0.6)
    return Line2D([], [], color=colour, label=text, marker="o", markersize=size)
