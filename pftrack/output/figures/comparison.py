"""The errors of runs over the frames that they have in common, each in its colour, as in the plots of the page."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.output.figures.style import explain_below, new_figure, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure


HIGH_IN, LANE_IN = 2.8, 0.16
LINES = ("-", "--", "-.", ":")
"""So that the runs can be told apart without colours."""


def draw_errors(
    errors: Sequence[Floats],
    lost: Sequence[Bools],
    *,
    names: Sequence[str],
    colours: Sequence[str],
    unit: str,
    title: str,
) -> "Figure":
    """Draw the error of each run, and below that a lane a run with the frames in which its target is lost.

    Args:
        errors: Of each run, (L,) by frame, NaN where it is not known.
        lost: Of each run, (L,) whether its target is lost.
        names: Of the runs.
        colours: Of the runs, "#rrggbb".
        unit: Of the errors.
        title: What is compared.
    """
    lanes_in = LANE_IN * len(names)
    figure, (panel, lanes) = new_figure(HIGH_IN + lanes_in, rows=2, share="x")
    if grid := panel.get_gridspec():
        grid.set_height_ratios((HIGH_IN, lanes_in))
    described = zip(errors, lost, names, colours, LINES, strict=False)
    for place, (error, gone, name, colour, line) in enumerate(described):
        known = np.concatenate([[False], np.isfinite(error), [False]])
        alone = known[1:-1] & ~known[:-2] & ~known[2:]
        panel.plot(error, color=colour, linestyle=line, linewidth=1.3, label=name)
        panel.plot(np.flatnonzero(alone), error[alone], color=colour, linestyle="", marker=".", markersize=4)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], gone, [False]]).astype(int))).reshape(-1, 2)
        spans = [(begin - 0.5, end - begin) for begin, end in edges.tolist()]
        lanes.broken_barh(spans, (place + 0.15, 0.7), color=colour)
    panel.set_xlim(-0.5, max(1, *map(len, errors)) - 0.5)
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel(f"error, {unit}" if unit else "error")
    write_title(panel, title)
    lanes.set_ylim(len(names), 0)
    lanes.set_yticks([])
    lanes.set_ylabel("lost", rotation=0, ha="right", va="center")
    lanes.set_xlabel("frame")
    explain_below(figure, panel, 2)
    return figure
