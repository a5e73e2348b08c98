"""Figures of several panels over the same axes: parts below each other, each with its heading, panels and key.

matplotlib lays the panels out. What it does not do is done here: to choose which values of an axis can be written
without touching each other, and as how many columns a key has room.
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
"""Of panels: up to four stand side by side, more of them in rows of three."""

LINE_IN, APART_IN, KEY_COLUMN_IN = 0.2, 0.1, 0.6
NARROW_EM, WIDE_EM = 0.54, 0.66
"""Widths of small letters and of other signs, by which the length of a text is told before it is drawn."""

USABLE = 0.75
"""Share of a panel's room that is left beside the values of its other axis."""


@dataclass(frozen=True)
class Values:
    """The values of an axis in words.

    Attributes:
        title: Of the axis, with its unit.
        texts: In order.
        is_named: Whether they are names and no numbers: names that need the room are written upright.
    """

    title: str = ""
    texts: tuple[str, ...] = ("",)
    is_named: bool = False

    @property
    def longest(self) -> float:
        """Length of the longest of them, in."""
        return max(_length(text, LETTERS_PT) for text in self.texts)

    def is_upright(self, wide: float) -> bool:
        """Return whether they are written upright below a panel of a width, in."""
        return self.is_named and self.longest + APART_IN > USABLE * wide / len(self.texts)

    def below(self, wide: float) -> float:
        """Return the room that they need below a panel, in."""
        return self.longest if self.is_upright(wide) else LINE_IN

    def chosen(self, room: float, needed: float) -> tuple[NDArray[Any], list[str]]:
        """Return which of them can be written along a room, in, of which each needs some, and their texts."""
        places = np.arange(len(self.texts))[:: max(1, ceil(needed * len(self.texts) / (USABLE * room)))]
        return places, [self.texts[place] for place in places]


@dataclass(frozen=True)
class Part:
    """A row or several rows of panels.

    Attributes:
        heading: Above them.
        count: How many panels.
        size: Width and height of each, with its values and titles, in.
        key: What explains the colours.
        shared: Whether the panels have the same axes.
    """

    heading: str
    count: int
    size: tuple[float, float]
    key: Sequence[Artist] = ()
    shared: bool = True

    @property
    def columns(self) -> int:
        """How many panels stand side by side."""
        return self.count if self.count <= MOST_COLUMNS else FEWER_COLUMNS

    @property
    def rows(self) -> int:
        """How many rows of panels there are."""
        return ceil(self.count / self.columns)


def lay_out(parts: Sequence[Part]) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of parts below each other, and the panels of each."""
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
    """Return how long a text will be, in, before it is drawn."""
    return sum(NARROW_EM if sign.islower() or sign == " " else WIDE_EM for sign in text) * points / 72


def write_across(panel: Axes, values: Values, wide: float) -> None:
    """Write values at equal distances below a panel of a width, in."""
    upright = values.is_upright(wide)
    places, texts = values.chosen(wide, LINE_IN if upright else values.longest + APART_IN)
    panel.set_xticks(places, texts, fontsize=LETTERS_PT, rotation=90 if upright else 0)


def write_up(panel: Axes, values: Values, high: float) -> None:
    """Write values at equal distances beside a panel of a height, in."""
    panel.set_yticks(*values.chosen(high, LINE_IN), fontsize=LETTERS_PT)


def draw_map(panel: Axes, title: str, values: Floats, colours: Colormap, scale: Normalize) -> AxesImage:
    """Draw the cells (rows, columns) of a map; what is not known is hatched."""
    panel.set_title(title, fontsize=TEXT_PT)
    panel.patch.set(facecolor="white", edgecolor=INK["hatching"], hatch="////", linewidth=0)
    panel.tick_params(labelsize=LETTERS_PT)
    for spine in panel.spines.values():
        spine.set(color=INK["frame"], linewidth=0.6)
    cells = np.ma.masked_invalid(values)
    return panel.imshow(cells, colours, scale, origin="lower", aspect="auto", interpolation="nearest")


def draw_scale(panels: Sequence[Axes], image: AxesImage) -> None:
    """Draw the scale of maps beside them."""
    figure = panels[0].get_figure()
    if figure is not None:
        bar = figure.colorbar(image, ax=list(panels), aspect=30, pad=0.02)
        bar.ax.tick_params(labelsize=LETTERS_PT)
        bar.outline.set_visible(False)


def finish(panel: Axes, across: str, up: str) -> None:
    """Write the titles of a panel's axes, over a grid of heights."""
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
    """Draw a curve through points, with the interval around each if that is known."""
    if interval is not None:
        panel.fill_between(x, *interval, color=colour, alpha=0.2, linewidth=0)
    panel.plot(x, y, color=colour, marker="o", markersize=3, linewidth=1.5)


def draw_boxes(panel: Axes, ends: Floats, x: Floats, width: float, colour: str) -> None:
    """Draw a row of boxes, of which a handful of artists is drawn many times faster than one for every line.

    Args:
        panel: Where.
        ends: (5, N): lower whisker, lower edge, median, upper edge, upper whisker.
        x: (N,) Middles.
        width: Of what a box stands in.
        colour: Of the boxes.
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
    """Draw differences with their intervals; filled where they count.

    Args:
        panel: Where.
        x: (N,) Places.
        differences: Mean, lower and upper end, (N,) each.
        is_filled: (N,).
        colour: Of all.
    """
    mean, low, high = differences
    panel.vlines(x, low, high, color=colour, linewidth=1.2)
    panel.plot(x, mean, "o", markerfacecolor="white", color=colour, markersize=5)
    panel.plot(x[is_filled], mean[is_filled], "o", color=colour, markersize=5)
    panel.axhline(0, color=INK["frame"], linewidth=0.8)


def key_line(text: str, colour: str, *, size: float = 3, is_box: bool = False) -> Line2D:
    """Return what a key shows of a curve or of a row of boxes."""
    if is_box:
        return Line2D([], [], color=colour, label=text, linewidth=6, alpha=0.6)
    return Line2D([], [], color=colour, label=text, marker="o", markersize=size)
