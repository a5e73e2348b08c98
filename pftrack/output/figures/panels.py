"""Panels over an axis of a few values, below each other, and what stands in them: curves with intervals, and boxes.

All lengths are inches, and every text has the room that its size asks for: a layout that matplotlib finds by itself
costs more than the drawing, since it measures every text several times.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model import series
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Hypotheses, Series
from pftrack.output.figures.style import INK, LETTERS_PT, TEXT_PT, bare
from pftrack.runs.run import Run

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Anchor: TypeAlias = Literal["sw", "s", "n", "e", "w"]

LINE_IN, APART_IN = 0.16, 0.08
"""Height of a line of 9 points, and what is between two texts side by side."""

KEY_LINE_IN, KEY_COLUMN_IN = 0.22, 0.6
NARROW_EM, WIDE_EM = 0.54, 0.66
"""Width of small letters, and of all other signs, of the font's size, about."""


def length(text: str, points: float) -> float:
    """Return how long a text is, about."""
    return sum(NARROW_EM if sign.islower() or sign == " " else WIDE_EM for sign in text) * points / 72


def ticks(texts: Sequence[str], step: float, needed: float) -> list[tuple[int, str]]:
    """Return which values of an axis there is room to write, the first and then evenly, with their places.

    Args:
        texts: The values.
        step: From one to the next.
        needed: By one, in the same unit.
    """
    return list(enumerate(texts))[:: max(1, ceil(needed / step))]


def axes_at(figure: "Figure", left: float, bottom: float, wide: float, high: float) -> "Axes":
    """Return new axes, whose inner frame is at this place."""
    width, height = figure.get_size_inches()
    return figure.add_axes((left / width, bottom / height, wide / width, high / height))


def write(
    figure: "Figure", x: float, y: float, text: str, points: float, *, anchor: Anchor = "sw", upright: bool = False
) -> None:
    """Write a text.

    Args:
        figure: Where.
        x: From the left.
        y: From below.
        text: What.
        points: Size of the font.
        anchor: What of the text is at the place: a corner, or the middle of a side; "s" is its base line.
        upright: Whether it is read from below.
    """
    figure.text(
        *(x, y, text),
        transform=figure.dpi_scale_trans,
        fontsize=points,
        horizontalalignment="left" if "w" in anchor else "right" if "e" in anchor else "center",
        verticalalignment="baseline" if "s" in anchor else "top" if "n" in anchor else "center",
        rotation=90 if upright else 0,
    )


def key_height(names: Sequence[str], width: float) -> float:
    """Return how high a key of these names is, in a figure of a width."""
    return KEY_LINE_IN * -(-len(names) // _key_columns(names, width))


def draw_key(figure: "Figure", handles: "Sequence[Artist]", left: float, top: float) -> None:
    """Draw what lines and colours mean, as many side by side as there is room for."""
    width, height = figure.get_size_inches()
    columns = _key_columns([str(handle.get_label()) for handle in handles], width)
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(left / width, top / height),
        ncols=columns,
        frameon=False,
        fontsize=TEXT_PT,
        borderaxespad=0,
        borderpad=0,
    )


def _key_columns(names: Sequence[str], width: float) -> int:
    longest = max(length(name, TEXT_PT) for name in names) + KEY_COLUMN_IN
    return min(max(int(width / longest), 1), len(names))


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
    y: Floats,
    colour: str,
    interval: tuple[Floats, Floats] | None = None,
) -> None:
    """Draw a curve through points, with the interval around each if that is known."""
    if interval is not None:
        panel.fill_between(x, *interval, color=colour, alpha=0.2, linewidth=0)
    panel.plot(x, y, color=colour, marker="o", markersize=3, linewidth=1.5)


def draw_boxes(panel: "Axes", ends: Floats, x: Floats, width: float, colour: str) -> None:
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


def key_line(text: str, colour: str, *, size: float = 3, is_box: bool = False) -> "Line2D":
    """Return what a key shows of a curve or of a row of boxes."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - see `style`

    if is_box:
        return Line2D([], [], color=colour, label=text, linewidth=6, alpha=0.6)
    return Line2D([], [], color=colour, label=text, marker="o", markersize=size)


def foot_height(key: "Sequence[Line2D]", width: float) -> float:
    """Return the room that a key needs below a panel of a width."""
    return key_height([str(line.get_label()) for line in key], width) + 0.1


# What plots are drawn from are arrays over the frames of a run, NaN where a frame has none.

Numbers = Floats


def frames(run: Run) -> Ints:
    """Return the (L,) indices of the frames that were computed."""
    return np.arange(run.computed + 1)


def errors(run: Run) -> Numbers:
    """Return (L,) distances of the estimate from the truth."""
    return np.array([np.nan if row.error is None else row.error for row in run.diagnostics])


def sigmas(run: Run) -> Numbers:
    """Return (L,) the largest standard deviation of each frame."""
    return np.array([max(row.sigma, default=np.nan) for row in run.diagnostics])


def hidden_frames(run: Run) -> Bools:
    """Return (L,) whether the target is known to be out of sight."""
    return np.array([row.hidden is True for row in run.diagnostics])


def find_series(run: Run, name: str) -> Series:
    """Return the declaration of a series that a plot names."""
    return next(one for one in run.experiment.all_series() if one.name == name)


def of_role(run: Run, role: str) -> list[Series]:
    """Return the series of a role that some frame has."""
    return [one for one in run.experiment.all_series() if one.role == role and _is_measured(run, one.name)]


def measure(run: Run, name: str) -> Numbers:
    """Return the values of a series, (L,) numbers, or (L, d) vectors and intervals; (L,) NaN where no frame has any."""
    values = [row.series.get(name) for row in run.diagnostics]
    if not name or all(value is None for value in values):
        return np.full(len(values), np.nan)
    return series.columns(find_series(run, name), values)[name]


def hypotheses(run: Run, name: str) -> list[Hypotheses]:
    """Return the hypotheses of each frame, without any where it has none."""
    return [row.hypotheses(name) or Hypotheses((), ()) for row in run.diagnostics]


def thresholds(run: Run, of: str) -> Iterator[tuple[list[int], list[float]]]:
    """Yield of each parameter that limits a series the frames from which a value is in force, and the values."""
    changes = sorted({0, *(change.frame for change in run.timeline.changes if change.frame <= run.computed)})
    steps = [*changes, run.computed]
    for item in run.experiment.declarations(type(run.setup.parameters)):
        if item.role == "threshold" and item.threshold_of == of:
            values = [_in_force(run, item, frame) for frame in steps]
            if not np.isnan(values).all():
                yield steps, values


def _in_force(run: Run, item: Declaration, frame: int) -> float:
    if item.trackers and run.tracker_at(frame) not in item.trackers:
        return np.nan
    return float(getattr(run.parameters_at(frame), item.name))


def _is_measured(run: Run, name: str) -> bool:
    return any(name in row.series for row in run.diagnostics)
