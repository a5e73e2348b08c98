"""The frame that all maps on the page of a report have: where cells are, and what is written along their axes, as SVG.

Coordinates are pixels from the upper left corner of the cells; a row of cells is counted from below.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from pftrack.output.figures.layout import ticks
from pftrack.output.figures.style import INK
from pftrack.sweep.axis import Axis
from pftrack.sweep.report.colours import MISSING
from pftrack.sweep.report.labels import format_value, label
from pftrack.sweep.report.study import Study

__all__ = ["Frame"]

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
