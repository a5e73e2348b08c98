"""Colours of maps and curves, which can be told apart without red and green, and mean the same in every figure.

Amounts are shown in viridis. What is better is blue for the first tracker and orange for the second, in the difference
maps as in the tests (both of Okabe and Ito's palette), with a neutral middle.
"""

from matplotlib.colors import LinearSegmentedColormap

from pftrack.sweep.cells import Code

__all__ = ["CODES", "CODE_NAMES", "DIVERGING", "MISSING", "TRACKERS", "diverging"]

CODES = {
    Code.FIRST_BETTER: "#0072b2",
    Code.SECOND_BETTER: "#e69f00",
    Code.NOT_SIGNIFICANT: "#cccccc",
    Code.NOT_APPLICABLE: "#ffffff",
}

CODE_NAMES = {
    Code.FIRST_BETTER: "{first} better",
    Code.SECOND_BETTER: "{second} better",
    Code.NOT_SIGNIFICANT: "not significant",
    Code.NOT_APPLICABLE: "not applicable",
}

MISSING = "#ececec"
"""Cells of which nothing is known."""

TRACKERS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#000000", "#999999")
"""Curves; Okabe and Ito's palette in an order in which neighbours differ in lightness."""

DIVERGING = ("#6b3d00", "#e69f00", "#f4f4f4", "#0072b2", "#00324f")
"""From the second tracker ahead to the first tracker ahead."""


def diverging() -> LinearSegmentedColormap:
    """Return the map of differences."""
    return LinearSegmentedColormap.from_list("first-second", list(DIVERGING))
