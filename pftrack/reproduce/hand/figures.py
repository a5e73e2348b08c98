"""The figures of a hand: how often it is right, and the same turn with one hand kept and with four."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.output.figures.style import CURVE_COLOURS, INK, explain_below, new_figure, write_title
from pftrack.reproduce.hand.trials import Outcome
from pftrack.runs.run import Change, Run
from pftrack.vision.rendering import png, render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["kept_figure", "right_figure"]

BAR = 0.38
SEED, FRAME, SCALE = 151, 24, 2.0
"""Of the presets in which one hand is lost and four are not, and a frame in which that is so."""


def right_figure(
    found: Mapping[tuple[str, int, str], Outcome], references: Mapping[tuple[str, int], Sequence[float]]
) -> "Figure":
    """Draw how often the best hand is right, and any that is kept, by both rankings, beside the reference's figures.

    Args:
        found: By motion, hands that are kept, and ranking.
        references: By motion and hands that are kept: tip error, best right, any right, right after backtracking.
    """
    motions = list(dict.fromkeys(motion for motion, _ in references))
    widths = sorted({width for _, width in references})
    figure, panels = new_figure(2.9, columns=len(motions), share="y")
    for panel, motion in zip(panels, motions, strict=True):
        for place, ranking in enumerate(("reference", "refined")):
            at = np.arange(len(widths)) + (place - 0.5) * BAR
            chosen = [found[motion, width, ranking] for width in widths]
            colour = CURVE_COLOURS[1 - place]
            panel.bar(at, [one.any for one in chosen], 0.9 * BAR, color=colour, alpha=0.35, label=f"any, {ranking}")
            panel.bar(at, [one.best for one in chosen], 0.9 * BAR, color=colour, label=f"best, {ranking}")
        marks = [references[motion, width][1] for width in widths]
        panel.plot(
            np.arange(len(widths)) - 0.5 * BAR,
            marks,
            "_",
            color=INK["truth"],
            ms=18,
            label="reference implementation",
        )
        write_title(panel, motion)
        panel.set_xticks(np.arange(len(widths)), [f"{width} kept" for width in widths])
        panel.set_ylim(0.0, 1.0)
    panels[0].set_ylabel("share of the frames")
    explain_below(figure, panels[0], 3)
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
