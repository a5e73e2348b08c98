"""Colours and scales, which can be distinguished without red and green, and mean the same in every figure.

Amounts are shown in viridis. What is better is blue for the first tracker and orange for the second, in the difference
maps as in the tests, with a neutral middle. All are the palette's, in the form that matplotlib and CSS read.
"""

from collections.abc import Iterable

import numpy as np
from matplotlib.colors import Colormap
from numpy.typing import NDArray

from pftrack.core.model.palette import VERDICTS, hexadecimal
from pftrack.output.figures.style import INK, viridis
from pftrack.sweep.cells import Code
from pftrack.sweep.comparison import Comparison
from pftrack.sweep.quantities import Quantity

__all__ = [
    "CODES",
    "CODE_NAMES",
    "MISSING",
    "amounts",
    "largest_difference",
    "scale_of",
]

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


def scale_of(quantity: Quantity, means: Iterable[NDArray[np.float64]]) -> tuple[float, float]:
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
