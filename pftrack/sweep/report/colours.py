"""Colours of maps and curves, which can be distinguished without red and green, and mean the same in every figure.

Amounts are shown in viridis. What is better is blue for the first tracker and orange for the second, in the difference
maps as in the tests, with a neutral middle. All are the palette's, in the form that matplotlib and Bokeh read.
"""

from matplotlib.colors import LinearSegmentedColormap

from pftrack.palette import CURVES, DIVERGING, NEUTRALS, VERDICTS, hexadecimal
from pftrack.sweep.cells import Code

__all__ = ["CODES", "CODE_NAMES", "GREYS", "MISSING", "TRACKERS", "diverging"]

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

GREYS = {use: hexadecimal(grey) for use, grey in NEUTRALS.items()}
"""Of lines and grids, by use."""

MISSING = GREYS["missing"]
"""Cells of which nothing is known."""

TRACKERS = tuple(hexadecimal(colour) for colour in CURVES)
"""Curves, in the trackers' order."""


def diverging() -> LinearSegmentedColormap:
    """Return the map of differences, from the second tracker ahead to the first tracker ahead."""
    return LinearSegmentedColormap.from_list("first-second", [hexadecimal(stop.light) for stop in DIVERGING])
