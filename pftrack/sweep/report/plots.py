"""The maps on the page of a report, as SVG, each with the figures that its cells tell the pointer.

A page of eight measures and three trackers has 75 maps, so each is as little as it can be: one path for all cells of a
colour, and the figures as texts, which the page's script shows as they are.
"""

import json
from collections.abc import Mapping
from html import escape
from typing import Literal

import numpy as np
from matplotlib.colors import Colormap, Normalize, to_hex

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.statistics import holm
from pftrack.output.figures.style import diverging
from pftrack.sweep.cells import COMMON, CellMap, Code, Correction, Quantity
from pftrack.sweep.comparison import Comparison
from pftrack.sweep.report.frame import CODE_NAMES, CODES, Frame, amounts, largest_difference, number, scale_of
from pftrack.sweep.report.study import Study

STOPS = 9
"""How many colours a scale is made of."""

Figures = Mapping[str, list[str]]
"""What the pointer shows: a text of every cell, row by row, by what it is; empty ones are left out."""


def tracker_maps(study: Study, frame: Frame, quantity: Quantity) -> str:
    """Return each tracker's mean of a quantity, on one colour scale; what is better is bright."""
    means = {name: quantity.means(cells) for name, cells in study.maps.items()}
    colours, ends = amounts(quantity), scale_of(quantity, means.values())
    maps = [
        _map(frame, study.title(name), _fills(means[name], colours, ends), _of_cells(study, quantity, cells))
        for name, cells in study.maps.items()
    ]
    return _side_by_side(maps, _scale(colours, ends, quantity.label))


def difference_maps(study: Study, frame: Frame, quantity: Quantity) -> str:
    """Return the difference of every pair, positive where the first is better, with that on the same scenes."""
    pairs = study.comparisons[quantity.name]
    most = largest_difference(pairs)
    colours, ends = diverging(), (-most, most)
    maps = []
    for pair in pairs:
        figures = {
            "difference": _numbers(pair.difference, "+"),
            "on the same scenes": _numbers(pair.paired.mean, "+"),
            "95 % interval": _intervals(_numbers(pair.paired.low, "+"), _numbers(pair.paired.high, "+")),
            "pairs": _texts(pair.paired.pairs, "d"),
            f"p ({pair.test})": _p_values(pair.p_values),
        }
        maps.append(_map(frame, _title(pair), _fills(pair.difference, colours, ends), figures))
    unit = f", {quantity.unit}" if quantity.unit else ""
    return _side_by_side(maps, _scale(colours, ends, f"Difference{unit}"))


def code_maps(study: Study, frame: Frame, pairs: tuple[Comparison, ...], correction: Correction) -> str:
    """Return where the test finds one tracker of a pair better, in four colours."""
    maps = []
    for pair in pairs:
        found = pair.significance(study.level, correction)
        codes = [Code(code) for code in found.codes.ravel().tolist()]
        first, second = study.title(pair.first), study.title(pair.second)
        figures = {
            "verdict": [CODE_NAMES[code].format(first=first, second=second) for code in codes],
            "p": _p_values(pair.p_values),
            "p after Holm": _p_values(holm(pair.p_values)),
            "effect": _texts(found.effect, "+.3f"),
        }
        maps.append(_map(frame, _title(pair), [CODES[code] for code in codes], figures))
    return _side_by_side(maps)


def _map(frame: Frame, title: str, fills: list[str], figures: Figures) -> str:
    told = json.dumps(figures).replace("<", "\\u003c")  # which could end the script
    return (
        f"<figure><figcaption>{escape(title)}</figcaption>{frame.map(fills, title)}"
        f'<script type="application/json">{told}</script></figure>'
    )


def _fills(values: Floats, colours: Colormap, ends: tuple[float, float]) -> list[str]:
    found = colours(Normalize(*ends)(np.ma.masked_invalid(values.ravel())))
    return [to_hex(colour) if known else "" for colour, known in zip(found, np.isfinite(values.ravel()), strict=True)]


def _of_cells(study: Study, quantity: Quantity, cells: CellMap) -> Figures:
    success = {
        "success": _texts(cells.rate, ".3f"),
        "95 % interval": _intervals(_texts(cells.low, ".3f"), _texts(cells.high, ".3f")),
    }
    return {
        **({} if quantity.name in COMMON else {quantity.label: _numbers(quantity.means(cells))}),
        **(success if study.judged else {}),
        "mean error": _numbers(cells.mean_error),
        **({"mean lost frames": _numbers(cells.mean_lost_frames)} if study.judged else {}),
        "runs": _texts(cells.runs, "d"),
    }


def _texts(values: Floats | Ints, form: str) -> list[str]:
    return [format(value, form) if np.isfinite(value) else "" for value in values.ravel().tolist()]


def _numbers(values: Floats, sign: Literal["", "+"] = "") -> list[str]:
    return [number(value, sign) for value in values.ravel().tolist()]


def _intervals(low: list[str], high: list[str]) -> list[str]:
    return [f"{one} to {other}" if one else "" for one, other in zip(low, high, strict=True)]


def _p_values(p_values: Floats) -> list[str]:
    return [text or "not applicable" for text in _texts(p_values, ".2g")]


def _title(pair: Comparison) -> str:
    return f"1: {pair.first}, 2: {pair.second}"


def _scale(colours: Colormap, ends: tuple[float, float], title: str) -> str:
    stops = ", ".join(to_hex(colours(place)) for place in np.linspace(0.0, 1.0, STOPS))
    bar = f'<i style="background: linear-gradient(to right, {stops})"></i>'
    low, high = map(number, ends)
    return f'<p class="scale">{escape(title)} <span>{low} {bar} {high}</span></p>'


def _side_by_side(maps: list[str], scale: str = "") -> str:
    return f'{scale}<div class="maps">{"".join(maps)}</div>'
