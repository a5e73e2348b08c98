"""What the trackers by colour histograms report: the likeness at the estimate, and the box that they believe in."""

from collections.abc import Mapping

from pftrack.series import Series, SeriesValue
from pftrack.trackers.histogram.state import HistogramState

__all__ = ["BOX", "SERIES", "measure"]

BOX = Series("box", "believed box", "px", "vector", role="extent", components=("width", "height"))
"""Width and height of the window around the estimate."""

SERIES = (Series("likeness", "likeness rho"), BOX)


def measure(state: HistogramState) -> Mapping[str, SeriesValue]:
    """Report rho of the window at the estimate, and its size."""
    return {"likeness": state.likeness, "box": state.box_px}
