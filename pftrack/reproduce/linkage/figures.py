"""The figures of the chain of links: a region that has split, and a length while nothing moves."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.experiments import find
from pftrack.output.figures.style import CURVE_COLOURS, new_figure
from pftrack.runs.run import Change, Run
from pftrack.vision.rendering import render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["split", "still"]

SPLIT_FRAME = 68
LINK, TRUE_PX = 3, 50.0
TITLES = {"static": "EKF with bounds", "static-regions": "Guided ellipsoids"}


def split() -> NDArray[np.uint8]:
    """Return a frame in which there are two regions, with the chain from above and the lengths beside it (RGB)."""
    run = _run("mirror3")
    step = run.seek(SPLIT_FRAME)
    return render_beside(find("linkage").draw(step, run.diagnostics), scale=2.0)


def still() -> "Figure":
    """Return the intervals of the third length by a filter and by regions, on the same frames."""
    figure, (panel,) = new_figure(2.8)
    for (preset, title), colour in zip(TITLES.items(), (CURVE_COLOURS[1], CURVE_COLOURS[0]), strict=True):
        rows = _rows(preset)
        ends = np.array([row.vector(f"length_{LINK}") for row in rows], dtype=np.float64)
        panel.fill_between(np.arange(len(ends)), *ends.T, color=colour, alpha=0.35, label=title)
    panel.axhline(TRUE_PX, color="black", linewidth=1.0, linestyle="--", label="truth")
    panel.set_xlim(0, len(ends) - 1)
    panel.set_ylim(35, 65)
    panel.set_xlabel("Frame")
    panel.set_ylabel("Length of link 3, px")
    panel.legend(loc="upper right", frameon=False, ncols=3)
    return figure


def _run(name: str) -> Run:
    experiment = find("linkage")
    preset = next(one for one in experiment.presets if one.name == name)
    timeline = (Change(0, preset.parameters),)
    return Run(experiment, experiment.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)


def _rows(name: str) -> list[Diagnostics]:
    run = _run(name)
    run.finish()
    return list(run.diagnostics)
