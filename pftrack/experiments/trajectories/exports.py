"""Tables of trajectories for other programs: filtered and smoothed, in the unit of the file that they came from."""

from collections.abc import Sequence

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.export import Export
from pftrack.core.spreadsheet import csv_text
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState

__all__ = ["EXPORTS"]

HEADER = "frame", "track", "x", "y", "filtered_x", "filtered_y", "smoothed_x", "smoothed_y", "outlier"


def table_of(state: TrajectoriesState, past: Sequence[Diagnostics]) -> bytes:
    """Return all tracks up to a frame as CSV; what was not measured has empty cells.

    Args:
        state: Of the frame.
        past: Of all frames from 0 on.
    """
    origin = state.origin
    scale = 1.0 if origin is None else origin.scale
    corner = np.zeros(2) if origin is None else origin.corner
    rows, outliers = state.history
    first = past[-1].frame + 1 - len(rows) + (0 if origin is None else origin.first_frame)
    names = [str(number) for number in range(rows.shape[1])] if origin is None else origin.names
    places = rows / scale + corner
    lines: list[tuple[str, ...]] = [HEADER]
    for frame in range(len(rows)):
        for track, name in enumerate(names):
            if np.isfinite(places[frame, track]).any():
                cells = (_cell(number) for number in places[frame, track].ravel())
                lines.append((str(first + frame), name, *cells, str(int(outliers[frame, track]))))
    return csv_text(lines).encode()


def _cell(number: np.float64) -> str:
    return f"{number:.10g}" if np.isfinite(number) else ""


EXPORTS = (Export("paths", "Trajectories up to here, CSV", "paths.csv", "text/csv", table_of),)
