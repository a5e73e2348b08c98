"""The figures of a hand: how often it is right, and the same turn with one hand kept and with four."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.model.palette import COLOURS, CURVES, NEUTRALS, hexadecimal
from pftrack.rendering import png, render_beside
from pftrack.reproduce.hand.course import Outcome
from pftrack.runs.run import Change, Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["kept_figure", "right_figure"]

BAR = 0.38
SEED, FRAME, SCALE = 5, 20, 2.0
"""Of the presets in which one hand is lost and four are not, and a frame in which that is so."""


def right_figure(
    found: Mapping[tuple[str, int, str], Outcome], references: Mapping[tuple[str, int], Sequence[float]]
) -> "Figure":
    """Draw how often the best hand is right, and any that is kept, by both rankings, beside the reference's figures.

    Args:
        found: By motion, hands that are kept, and ranking.
        references: By motion and hands that are kept: tip error, best right, any right, right after backtracking.
    """
    # Drawing loads much that computing does not need, in every process of the pool.
    from matplotlib.figure import Figure  # noqa: PLC0415

    motions = list(dict.fromkeys(motion for motion, _ in references))
    widths = sorted({width for _, width in references})
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    panels = figure.subplots(1, len(motions), sharey=True)
    for panel, motion in zip(panels, motions, strict=True):
        for place, ranking in enumerate(("reference", "refined")):
            at = np.arange(len(widths)) + (place - 0.5) * BAR
            chosen = [found[motion, width, ranking] for width in widths]
            colour = hexadecimal(CURVES[1 - place])
            panel.bar(at, [one.any for one in chosen], 0.9 * BAR, color=colour, alpha=0.35, label=f"any, {ranking}")
            panel.bar(at, [one.best for one in chosen], 0.9 * BAR, color=colour, label=f"best, {ranking}")
        marks = [references[motion, width][1] for width in widths]
        panel.plot(
            np.arange(len(widths)) - 0.5 * BAR,
            marks,
            "_",
            color=hexadecimal(COLOURS["truth"]),
            ms=18,
            label="specification",
        )
        panel.set_title(motion, fontsize=10)
        panel.set_xticks(np.arange(len(widths)), [f"{width} kept" for width in widths])
        panel.set_ylim(0.0, 1.0)
        panel.grid(axis="y", color=hexadecimal(NEUTRALS["grid"]), linewidth=0.6)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("share of the frames")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    return figure


def kept_figure() -> bytes:
    """Return a picture of the same frame with one hand kept (left) and with four, each with the hand in space, PNG."""
    pictures: list[NDArray[np.uint8]] = []
    hand = find("hand")
    for width in (1, 4):
        values = {"motion": "wrist", "beam_width": width}
        run = Run(hand, hand.simulate(), tracker="beam", seed=SEED, timeline=(Change(0, values),))
        drawing = replace(hand.draw(run.seek(FRAME), run.diagnostics), caption="")
        pictures.append(render_beside(drawing, layers=hand.shown_layers, scale=SCALE))
    return png(np.hstack(pictures))
