"""The figures of the shapes: reconstructions (4.21 to 4.23, 4.27), and errors over trials (4.24, 4.26)."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pftrack.model.palette import CURVES, NEUTRALS, hexadecimal
from pftrack.reproduce.structure.course import Course, Online

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


def draw(body: str, courses: Sequence[Course], common: Sequence[Online], own: Sequence[Online]) -> "dict[str, Figure]":
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
    # Drawing loads much that computing does not need, in every process of the pool.
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    for panel, (side, across, down) in zip(figure.subplots(1, 2), SIDES, strict=True):
        for one, other in zip(found, truth, strict=True):
            panel.plot([one[across], other[across]], [one[down], other[down]], color=hexadecimal(NEUTRALS["grid"]))
        panel.plot(*truth[:, [across, down]].T, "o", color=hexadecimal(CURVES[1]), mfc="none", label="true")
        panel.plot(*found[:, [across, down]].T, ".", color=hexadecimal(CURVES[0]), label="reconstructed")
        panel.set_title(side, fontsize=10)
        panel.set_aspect("equal")
        panel.invert_yaxis()
        panel.set_xlabel("mm")
        _plain(panel)
    handles, names = panel.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(title, fontsize=11)
    return figure


def _errors(errors: Mapping[str, Sequence[float]]) -> "Figure":
    """Draw mean and standard deviation of the errors of each method over the trials."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    panel = figure.subplots()
    means, spreads = [np.mean(it) for it in errors.values()], [np.std(it) for it in errors.values()]
    places = np.arange(len(errors))
    panel.bar(places, means, yerr=spreads, color=hexadecimal(CURVES[0]), width=0.6, capsize=4)
    for place, mean in zip(places, means, strict=True):
        panel.annotate(f"{mean:.3f}", (place + 0.05, mean), fontsize=9)
    panel.set_xticks(places, [TITLES[name].replace(", ", ",\n") for name in errors], fontsize=9)
    panel.set_ylabel("Shape error")
    panel.set_title(f"{len(errors['svd'])} trials, mean and standard deviation", fontsize=11)
    _plain(panel)
    return figure


def _plain(panel: Any) -> None:  # noqa: ANN401 - matplotlib is loaded late
    panel.grid(color=hexadecimal(NEUTRALS["grid"]), linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
