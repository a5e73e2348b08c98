"""Panels over an axis of a few values, below each other, and what stands in them: curves with intervals, and boxes.

All lengths are inches.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pftrack.output.figures.layout import APART_IN, LINE_IN, axes_at, draw_key, key_height, length, ticks, write
from pftrack.output.figures.style import INK, LETTERS_PT, TEXT_PT, bare

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

__all__ = [
    "BELOW_IN",
    "HIGH_IN",
    "LEFT_IN",
    "RIGHT_IN",
    "TITLE_IN",
    "Values",
    "draw_boxes",
    "draw_curve",
    "draw_differences",
    "finish",
    "foot_height",
    "key_line",
    "panels_below_each_other",
    "write_numbers",
    "write_values",
]

MOST_TICKS = 10
LEFT_IN, RIGHT_IN = 0.75, 0.15
TITLE_IN, HIGH_IN, BELOW_IN = 0.24, 2.5, 0.55


@dataclass(frozen=True)
class Values:
    """The values of an axis in words.

    Attributes:
        texts: One a place.
        is_named: Whether they are names, which are written upright rather than left out.
    """

    texts: tuple[str, ...]
    is_named: bool

    def height(self, wide: float) -> float:
        """Return the room that names need below an axis of a width where they are written upright, else 0."""
        longest = max(length(text, LETTERS_PT) for text in self.texts)
        return longest if self.is_named and longest + APART_IN > wide / len(self.texts) else 0.0


def panels_below_each_other(
    values: Values, wide: float, parts: "Sequence[tuple[str, Sequence[Line2D]]]"
) -> "tuple[Figure, list[Axes]]":
    """Return panels over the same equally spaced values, each with its title and its key.

    Args:
        values: Of the axis.
        wide: Width of a panel.
        parts: Titles, and lines of the keys.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - see `style`

    width = LEFT_IN + wide + RIGHT_IN
    below = BELOW_IN + values.height(wide)
    heights = [2 * TITLE_IN + HIGH_IN + below + foot_height(key, width) for _, key in parts]
    figure, top, panels = Figure(figsize=(width, sum(heights))), sum(heights), []
    for (title, key), height in zip(parts, heights, strict=True):
        bottom = top - 2 * TITLE_IN - HIGH_IN
        panel = axes_at(figure, LEFT_IN, bottom, wide, HIGH_IN)
        panel.set_xlim(-0.6, len(values.texts) - 0.4)
        write_values(panel, values, wide)
        write(figure, LEFT_IN, bottom + HIGH_IN + 0.08, title, TEXT_PT)
        draw_key(figure, key, LEFT_IN, bottom - below)
        panels.append(panel)
        top -= height
    return figure, panels


def write_values(panel: "Axes", values: Values, wide: float) -> None:
    """Write the values of an axis at equal distances, upright if they are names that need the room."""
    upright = values.height(wide) > 0
    needed = LINE_IN if upright else max(length(text, LETTERS_PT) for text in values.texts) + APART_IN
    places, kept = zip(*ticks(values.texts, wide / len(values.texts), needed), strict=True)
    panel.set_xticks(places, kept, fontsize=LETTERS_PT, rotation=90 if upright else 0)


def write_numbers(panel: "Axes", positions: NDArray[Any], texts: Sequence[str], wide: float) -> None:
    """Write the values of an axis where they are, if they are few, and of those too near each other the first."""
    if len(texts) > MOST_TICKS:
        return
    places = _apart(positions, max(length(text, LETTERS_PT) for text in texts) / wide)
    panel.set_xticks(positions[places], [texts[place] for place in places], fontsize=LETTERS_PT)


def _apart(positions: NDArray[Any], share: float) -> list[int]:
    """Return which of ascending or descending positions can carry a label of a length without touching another."""
    least = (share + 0.02) * float(np.ptp(positions))
    kept: list[int] = []
    for place in range(len(positions)):
        if not kept or abs(positions[place] - positions[kept[-1]]) >= least:
            kept.append(place)
    return kept


def finish(panel: "Axes", across: str, up: str) -> None:
    """Write the titles of a panel's axes, over a grid of heights."""
    panel.set_xlabel(across)
    panel.set_ylabel(up)
    bare(panel, grid="y")


def draw_curve(
    panel: "Axes",
    x: NDArray[Any],
    y: NDArray[np.float64],
    colour: str,
    interval: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> None:
    """Draw a curve through points, with the interval around each if that is known."""
    if interval is not None:
        panel.fill_between(x, *interval, color=colour, alpha=0.2, linewidth=0)
    panel.plot(x, y, color=colour, marker="o", markersize=3, linewidth=1.5)


def draw_boxes(panel: "Axes", ends: NDArray[np.float64], x: NDArray[np.float64], width: float, colour: str) -> None:
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
    panel: "Axes",
    x: NDArray[np.floating[Any]],
    differences: Sequence[NDArray[np.float64]],
    is_filled: NDArray[np.bool_],
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


def key_line(text: str, colour: str, *, size: float = 3, is_box: bool = False) -> "Line2D":
    """Return what a key shows of a curve or of a row of boxes."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - see `style`

    if is_box:
        return Line2D([], [], color=colour, label=text, linewidth=6, alpha=0.6)
    return Line2D([], [], color=colour, label=text, marker="o", markersize=size)


def foot_height(key: "Sequence[Line2D]", width: float) -> float:
    """Return the room that a key needs below a panel of a width."""
    return key_height([str(line.get_label()) for line in key], width) + 0.1
