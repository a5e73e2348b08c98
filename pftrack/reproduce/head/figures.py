"""The figures of the head: alpha of every feature over the drive (4.15), and success over the threshold (4.16)."""

from typing import TYPE_CHECKING, Any

import numpy as np

from pftrack.output.figures.style import (
    CURVE_COLOURS,
    INK,
    TITLE_PT,
    explain_below,
    new_figure,
    write_heading,
    write_title,
)
from pftrack.reproduce.head.curves import AXES, success_rates
from pftrack.reproduce.head.trials import Model, TrialResult
from pftrack.vision.geometry.face_model import FEATURES, TITLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

MODELS: dict[Model, str] = {"individual": CURVE_COLOURS[0], "mean": CURVE_COLOURS[1]}
NAMES: dict[Model, str] = {"individual": "the driver's own face", "mean": "mean face of other people"}
MOST_DEG = 4.0
HIDDEN: dict[str, Any] = {"color": INK["hidden"], "alpha": 0.2, "linewidth": 0}


def draw(by_model: dict[Model, list[TrialResult]]) -> "dict[str, Figure]":
    """Return the figures by name, given the trials of one driver with the mixture, by face model."""
    return {
        "figure-4.15-alpha": alpha_over_time(by_model["mean"]),
        "figure-4.16-success-by-threshold": success_by_threshold(by_model),
    }


def alpha_over_time(courses: list[TrialResult]) -> "Figure":
    """Draw alpha of each feature, the mean of all trials, shaded where the head is turned."""
    ratios = np.mean([course.ratios for course in courses], axis=0)
    frames = np.arange(1, len(ratios) + 1)
    figure, panels = new_figure(6.0, rows=4, columns=3, share="xy")
    for panel, name, values in zip(panels, FEATURES, ratios.T, strict=False):
        panel.fill_between(frames, 0.0, 1.0, where=courses[0].turned, **HIDDEN)
        panel.plot(frames, values, color=MODELS["individual"], linewidth=0.8)
        write_title(panel, TITLES[name].capitalize())
    panels[11].set_visible(False)
    panels[8].tick_params(labelbottom=True)
    figure.supxlabel("Frame", fontsize=TITLE_PT)
    figure.supylabel("alpha, share of the head's prediction", fontsize=TITLE_PT)
    write_heading(figure, "Alpha of each feature; shaded where the head is turned by more than 20°")
    return figure


def success_by_threshold(by_model: dict[Model, list[TrialResult]]) -> "Figure":
    """Draw the success of each axis over the threshold, of both face models."""
    thresholds = np.linspace(0.0, MOST_DEG, 401)
    figure, panels = new_figure(3.2, columns=len(AXES), share="y")
    for axis, (panel, name) in enumerate(zip(panels, AXES, strict=True)):
        for model, colour in MODELS.items():
            rates = success_rates(by_model[model], axis, thresholds)
            panel.plot(thresholds, rates, color=colour, linewidth=1.5, label=NAMES[model])
        write_title(panel, name.capitalize())
        panel.set_xlabel("Threshold of the mean error, °")
    panels[0].set_ylabel("Success rate")
    panels[0].set_ylim(-0.02, 1.02)
    explain_below(figure, panels[0], 2)
    write_heading(figure, f"Trials below a threshold, PF-ASD, {len(by_model['mean'])} trials")
    return figure
