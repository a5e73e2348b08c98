"""Places in a figure, in inches: every text has the room that its size asks for.

A layout that matplotlib finds by itself costs more than the drawing, since it measures every text several times.
"""

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Literal, TypeAlias

from pftrack.output.figures.style import TEXT_PT

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["APART_IN", "LINE_IN", "axes_at", "draw_key", "key_height", "length", "ticks", "write"]

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
