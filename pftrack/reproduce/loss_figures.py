"""Figures of the probabilities by which trackers say that they have lost their target, a small panel a tracker.

- Reliability: of the frames in which a probability is said, the share that are lost; a dot a bin, the larger the more
  frames it has, and all on the diagonal where the probability is true.
- Receiver operating characteristic: the share of the lost frames that a threshold tells, over the share of the others
  that it tells wrongly.
- Delays: the share of the losses that have been told so many frames after they began.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from pftrack.experiments.shared.loss_probability.scores import Bin, Delays, Roc
from pftrack.output.figures.style import CURVE_COLOURS, INK, LETTERS_PT, TWO_COLUMNS_IN, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["FIGURES", "Scores", "draw_scores"]

Scores: TypeAlias = tuple[Sequence[Bin], Roc, Delays]
"""Of a tracker: frames by their probability, what thresholds tell, and how soon losses were told."""

FIGURES = ("loss-reliability", "loss-roc", "loss-delays")

COLUMNS, HIGH_IN, FOOT_IN = 5, 1.5, 0.4
LAST_FRAME = 20
LARGEST_DOT, SMALLEST_DOT = 60.0, 4.0
LINE_PT, TITLE_PT = 1.3, 7


def draw_scores(found: Mapping[tuple[str, str], Scores]) -> "dict[str, Figure]":
    """Return the figures by name, of trackers by experiment and name."""
    drawings = (
        (_draw_reliability, "probability that is said", "share that is lost"),
        (_draw_roc, "share of the other frames", "share of the lost frames"),
        (_draw_delays, "frames since the loss began", "share of the losses"),
    )
    experiments = list(dict.fromkeys(experiment for experiment, _ in found))
    figures = {}
    for name, (draw, across, up) in zip(FIGURES, drawings, strict=True):
        rows = -(-len(found) // COLUMNS)
        figure, panels = new_figure(
            rows * HIGH_IN + FOOT_IN, width=TWO_COLUMNS_IN, rows=rows, columns=COLUMNS, share="xy"
        )
        for panel, ((experiment, tracker), scores) in zip(panels, found.items(), strict=False):
            draw(panel, scores, CURVE_COLOURS[experiments.index(experiment) % len(CURVE_COLOURS)])
            panel.set_title(f"{experiment}, {tracker}", fontsize=TITLE_PT)
            panel.set_ylim(-0.04, 1.04)
        for panel in panels[len(found) :]:
            panel.set_visible(False)
        for panel in panels[max(len(found) - COLUMNS, 0) : len(found)]:
            panel.tick_params(labelbottom=True)
        figure.supxlabel(across, fontsize=LETTERS_PT)
        figure.supylabel(up, fontsize=LETTERS_PT)
        figures[name] = figure
    return figures


def _draw_reliability(panel: "Axes", scores: Scores, colour: str) -> None:
    bins, _, _ = scores
    shares = np.array([one.frames for one in bins]) / sum(one.frames for one in bins)
    said, lost = [one.probability for one in bins], [one.lost for one in bins]
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(said, lost, color=colour, linewidth=LINE_PT)
    panel.scatter(said, lost, s=np.maximum(LARGEST_DOT * np.sqrt(shares), SMALLEST_DOT), color=colour)


def _draw_roc(panel: "Axes", scores: Scores, colour: str) -> None:
    _, roc, _ = scores
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(roc.false_alarms, roc.told, color=colour, linewidth=LINE_PT)
    panel.text(1.0, 0.04, f"{roc.area:.3f}", fontsize=LETTERS_PT, ha="right")


def _draw_delays(panel: "Axes", scores: Scores, colour: str) -> None:
    _, _, delays = scores
    frames = np.arange(LAST_FRAME + 1)
    told = np.array([sum(one <= frame for one in delays.frames) for frame in frames]) / max(delays.losses, 1)
    panel.step(frames, told, where="post", color=colour, linewidth=LINE_PT)
    panel.text(LAST_FRAME, 0.04, f"{delays.losses} losses", fontsize=LETTERS_PT, ha="right")
