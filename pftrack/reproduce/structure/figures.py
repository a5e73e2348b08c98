"""The figures of the shapes: reconstructions (4.21 to 4.23, 4.27), and errors over trials (4.24, 4.26)."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.output.figures.style import (
    CURVE_COLOURS,
    INK,
    TEXT_PT,
    explain_below,
    new_figure,
    write_heading,
    write_title,
)
from pftrack.reproduce.structure.trials import OnlineResult, TrialResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

NUMBERS = {
    "prism": {"svd": "4.21", "batch": "4.22", "online": "4.23", "errors": "4.24"},
    "face": {"online": "4.27", "errors": "4.26"},
}
TITLES = {
    "svd": "Singular values",
    "batch": "Variational",
    "online": "Online",
    "own": "Online, forgetting by information",
    "recursive": "Recursion",
}
SIDES = (("From the front", 0, 1), ("From above", 0, 2))


def draw(
    body: str, courses: Sequence[TrialResult], common: Sequence[OnlineResult], own: Sequence[OnlineResult]
) -> "dict[str, Figure]":
    """Return the figures by name, given the trials of the prism or of a face."""
    errors = {
        "svd": [one.svd for one in courses],
        "batch": [one.batch for one in courses],
        "online": [one.published for one in common],
        "own": [float(one.steps[-1]) for one in own],
        "recursive": [float(one.recursive[-1]) for one in courses],
    }
    shapes = {**courses[0].shapes, "online": common[0].shape_mm}
    figures = {
        f"figure-{number}-{body}-{name}": _shape(TITLES[name], shapes[name], shapes["true"])
        for name, number in NUMBERS[body].items()
        if name != "errors"
    }
    return {**figures, f"figure-{NUMBERS[body]['errors']}-{body}-errors": _errors(errors)}


def _shape(title: str, found: NDArray[np.float64], truth: NDArray[np.float64]) -> "Figure":
    """Draw a reconstructed shape over the true one from two sides."""
    figure, panels = new_figure(3.4, columns=2)
    for panel, (side, across, down) in zip(panels, SIDES, strict=True):
        for one, other in zip(found, truth, strict=True):
            panel.plot([one[across], other[across]], [one[down], other[down]], color=INK["grid"])
        panel.plot(*truth[:, [across, down]].T, "o", color=CURVE_COLOURS[1], mfc="none", label="true")
        panel.plot(*found[:, [across, down]].T, ".", color=CURVE_COLOURS[0], label="reconstructed")
        write_title(panel, side)
        panel.set_aspect("equal")
        panel.invert_yaxis()
        panel.set_xlabel("mm")
    explain_below(figure, panel, 2)
    write_heading(figure, title)
    return figure


def _errors(errors: Mapping[str, Sequence[float]]) -> "Figure":
    """Draw mean and standard deviation of the errors of each method over the trials."""
    figure, (panel,) = new_figure(3.4)
    means, spreads = [np.mean(it) for it in errors.values()], [np.std(it) for it in errors.values()]
    places = np.arange(len(errors))
    panel.bar(places, means, yerr=spreads, color=CURVE_COLOURS[0], width=0.6, capsize=4)
    for place, mean in zip(places, means, strict=True):
        panel.annotate(f"{mean:.3f}", (place + 0.05, mean), fontsize=TEXT_PT)
    panel.set_xticks(places, [TITLES[name].replace(", ", ",\n") for name in errors], fontsize=TEXT_PT)
    panel.set_ylabel("Shape error")
    write_title(panel, f"{len(errors['svd'])} trials, mean and standard deviation")
    return figure
