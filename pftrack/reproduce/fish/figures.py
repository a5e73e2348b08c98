"""The figures of the fish: successes over the number of particles (6 and 7), and ten particles of each (8 and 9)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.output.figures.style import CURVE_COLOURS, new_figure, write_title
from pftrack.reproduce.fish.trials import Successes
from pftrack.runs.run import Change, Run
from pftrack.vision.rendering import render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw", "ten_particles"]

AT_FRAME, AROUND_PX = 12, 110
"""In the middle of a sharp turn, and how much of the picture around the fish is shown."""

TITLES = {"guided": "Guided diffusion", "ordinary": "Ordinary filter"}


def draw(found: Mapping[tuple[str, int], Successes]) -> "dict[str, Figure]":
    """Return figures 6 and 7 of Mitsugami et al. 2009 as one, given successes by tracker and number of particles."""
    figure, panels = new_figure(3.2, columns=2)
    counts = sorted({count for _, count in found})
    for panel, title, most in zip(panels, ("All fish", "Sharp turns"), (24, 9), strict=True):
        for (tracker, name), colour in zip(TITLES.items(), CURVE_COLOURS, strict=False):
            values = [found[tracker, count] for count in counts]
            rates = [one.fish if most == 24 else one.sharp for one in values]
            panel.plot(counts, rates, "o-", color=colour, linewidth=1.5, markersize=4, label=name)
        panel.set_xscale("log")
        panel.set_xticks(counts, [f"{count}" for count in counts])
        panel.minorticks_off()
        panel.set_ylim(0, most + 0.5)
        write_title(panel, f"{title}, of {most}")
        panel.set_xlabel("Particles")
    panel.legend(loc="lower right", frameon=False)
    figure.axes[0].set_ylabel("Successes")
    return {"figure-fish-success": figure}


def ten_particles() -> NDArray[np.uint8]:
    """Return ten particles of the ordinary filter, and of the guided one, side by side in a sharp turn (RGB)."""
    experiment = find("fish")
    parts = []
    for name in ("ordinary", "same-turn"):
        preset = next(preset for preset in experiment.presets if preset.name == name)
        timeline = (Change(0, preset.parameters),)
        run = Run(experiment, experiment.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
        step = run.seek(AT_FRAME)
        picture = render(
            experiment.draw(step, run.diagnostics), layers=experiment.shown_layers, scale=2.0, caption=False
        )
        target = step.frame.target
        x, y = np.rint(2.0 * target.position).astype(int) if target is not None else (0, 0)
        reach = 2 * AROUND_PX
        left, top = (
            min(max(x - reach, 0), picture.shape[1] - 2 * reach),
            min(max(y - reach, 0), picture.shape[0] - 2 * reach),
        )
        parts.append(picture[top : top + 2 * reach, left : left + 2 * reach])
    return np.concatenate(parts, axis=1)
