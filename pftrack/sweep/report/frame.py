"""The frame that all maps of a report have: where cells are, colours and scales, and what is written along their axes.

Coordinates are pixels from the upper left corner of the cells; a row of cells is counted from below. The frame is SVG.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from math import isnan
from typing import Literal

import numpy as np
from matplotlib.colors import Colormap

from pftrack.core.arrays import Floats
from pftrack.core.model.palette import VERDICTS, hexadecimal
from pftrack.core.model.parameters import Value
from pftrack.output.figures.panels import ticks
from pftrack.output.figures.style import INK, viridis
from pftrack.sweep.axis import Axis, find_declaration
from pftrack.sweep.cells import Code, Quantity
from pftrack.sweep.comparison import Comparison
from pftrack.sweep.report.study import Study

# Colours can be distinguished without red and green, and mean the same in every figure. Amounts are shown in viridis.
# What is better is blue for the first tracker and orange for the second, in the difference maps as in the tests, with a
# neutral middle. All are the palette's, in the form that matplotlib and CSS read.

CODES = {
    Code.FIRST_BETTER: hexadecimal(VERDICTS["first"].light),
    Code.SECOND_BETTER: hexadecimal(VERDICTS["second"].light),
    Code.NOT_SIGNIFICANT: hexadecimal(VERDICTS["none"].light),
    Code.NOT_APPLICABLE: hexadecimal(VERDICTS["untested"].light),
}

CODE_NAMES = {
    Code.FIRST_BETTER: "{first} better",
    Code.SECOND_BETTER: "{second} better",
    Code.NOT_SIGNIFICANT: "not significant",
    Code.NOT_APPLICABLE: "not applicable",
}

MISSING = INK["missing"]
"""Cells of which nothing is known."""


def amounts(quantity: Quantity) -> Colormap:
    """Return the map of a quantity's values, on which what is better is bright."""
    return viridis(is_reversed=quantity.better != "higher")


def scale_of(quantity: Quantity, means: Iterable[Floats]) -> tuple[float, float]:
    """Return what the two ends of a colour scale stand for: a scale has 0 on it, and all of 0..1 for a share.

    Args:
        quantity: That is shown.
        means: Of the cells of each map, any shape, NaN where there is none.
    """
    if quantity.share:
        return 0.0, 1.0
    known = np.concatenate([np.ravel(values[np.isfinite(values)]) for values in means])
    low, high = float(known.min(initial=0.0)), float(known.max(initial=0.0))
    return (low, high) if high > low else (0.0, 1.0)


def largest_difference(pairs: Iterable[Comparison]) -> float:
    """Return what the ends of a scale of differences stand for, 1 where no cell has a difference."""
    return max(float(np.nanmax(np.abs(pair.difference), initial=0.0)) for pair in pairs) or 1.0


def label(study: Study, axis: Axis) -> str:
    """Return what an axis is called, with its unit."""
    declaration = find_declaration(study.result.plan.wiring, axis.name, study.result.plan.kind)
    return f"{declaration.title}, {declaration.unit}" if declaration.unit else declaration.title


LONGEST_SHOWN = 60
"""Characters of a value."""


def format_value(value: Value) -> str:
    """Return a value as a tick or a table shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and len(value) > LONGEST_SHOWN:
        return "own file"  # nothing else is as long
    return f"{value:g}" if isinstance(value, float) else str(value)


def number(value: float, sign: Literal["", "+"] = "") -> str:
    """Return a result to three digits, whole from 1,000 on; nothing for NaN.

    Args:
        value: The result.
        sign: "+" to write it of positive values too.
    """
    if isnan(value):
        return ""
    return f"{value:{sign},.0f}" if abs(value) >= 999.5 else f"{value:{sign}.3g}"


SIDE_PX = 280
ROW_PX = 40
"""Height of the cells where there is a single row."""

LEAST_GAPPED_PX = 8
LETTER_PX, LINE_PX, APART_PX = 7.2, 14.0, 6.0
"""Of the labels: width of a letter, about, height of a line, and what is between two."""


@dataclass(frozen=True)
class Frame:
    """The frame of maps that have the same axes.

    Attributes:
        columns: How many cells there are across.
        wide: Width of a cell.
        high: Height of a cell.
        extent: x and y of the upper left corner, width and height of all, with the labels.
        labels: Of both axes, SVG.
    """

    columns: int
    wide: float
    high: float
    extent: tuple[float, float, float, float]
    labels: str

    @classmethod
    def of(cls, study: Study) -> "Frame":
        """Return the frame of a study's maps."""
        across, up = _values(study.x), _values(study.y)
        wide = _cell(SIDE_PX, len(across))
        side = SIDE_PX * study.proportion if study.y else ROW_PX
        high = _cell(side, len(up))
        width, height = wide * len(across), high * len(up)
        # Names of choices stand upright rather than being left out.
        longest = _length(across)
        upright = study.x is not None and not study.x.numerical and longest + APART_PX > wide
        below = height + (longest + 5 if upright else LINE_PX)
        labels = [
            _text(text, (place + 0.5) * wide, height + (5 if upright else LINE_PX), upright=upright)
            for place, text in ticks(across, wide, LINE_PX if upright else longest + APART_PX)
        ]
        labels += [
            _text(text, -5, height - (place + 0.5) * high + 4, anchor="end") for place, text in ticks(up, high, LINE_PX)
        ]
        left = max(_length(up) + 8, 0.0 if upright else (longest - wide) / 2)
        if study.x:
            below += LINE_PX + 4
            labels.append(_text(label(study, study.x), width / 2, below))
        if study.y:
            left += LINE_PX + 4
            turn = f'<g transform="translate({LINE_PX - left - 2:g} {height / 2:g}) rotate(-90)">'
            labels.append(f"{turn}{_text(label(study, study.y), 0, 0)}</g>")
        extent = -left, -1.0, left + width + 12, below + 6
        return cls(len(across), wide, high, extent, "".join(labels))

    def map(self, fills: Sequence[str], title: str) -> str:
        """Return a map as SVG.

        Args:
            fills: Colour of every cell, row by row; empty where nothing is known.
            title: For those who cannot see it.
        """
        gap = int(min(self.wide, self.high) > LEAST_GAPPED_PX)
        inner, tall = self.wide - gap, self.high - gap
        rows = len(fills) // self.columns
        paths: dict[str, list[str]] = {}
        for place, fill in enumerate(fills):
            row, column = divmod(place, self.columns)
            corner = f"M{column * self.wide:g} {(rows - row - 1) * self.high:g}"
            paths.setdefault(fill, []).append(f"{corner}h{inner:g}v{tall:g}h{-inner:g}z")
        paths.pop("", None)
        cells = "".join(f'<path fill="{fill}" d="{"".join(parts)}"/>' for fill, parts in paths.items())
        return (
            f'<svg viewBox="{" ".join(f"{it:g}" for it in self.extent)}" width="{self.extent[2]:g}" role="img" '
            f'aria-label="{escape(title)}"><rect x="-0.5" y="-0.5" width="{self.columns * self.wide:g}" '
            f'height="{rows * self.high:g}" fill="{MISSING}" stroke="{INK["frame"]}"/>{cells}{self.labels}</svg>'
        )


def _values(axis: Axis | None) -> list[str]:
    return [format_value(value) for value in axis.values] if axis else [""]


def _cell(side: float, count: int) -> float:
    """Return the side of one of so many cells, whole pixels unless they are small."""
    return side // count if side // count > LEAST_GAPPED_PX else side / count


def _length(texts: Sequence[str]) -> float:
    return LETTER_PX * max(map(len, texts))


def _text(text: str, x: float, y: float, *, anchor: str = "middle", upright: bool = False) -> str:
    where = f'transform="translate({x + 4:g} {y:g}) rotate(-90)"' if upright else f'x="{x:g}" y="{y:g}"'
    return f'<text {where} text-anchor="{"end" if upright else anchor}">{escape(text)}</text>'
