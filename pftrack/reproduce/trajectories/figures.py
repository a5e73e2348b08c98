"""The figures of the simulated track: what each filter makes of it, and the likelihood of the scales."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.trajectories.scene.reference import REFERENCE_PX
from pftrack.experiments.trajectories.scene.scene import TRUE_PATH
from pftrack.filters.trajectories.whole import GRID, Smoothed, track_error
from pftrack.output.figures.style import CURVE_COLOURS, INK, draw_scale, explain_below, new_figure, viridis, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

TITLES = {"lg": "Gaussian noise (LG)", "lng": "Cauchy noise (LNG)", "nlng": "Self-organising (NLNG)"}
DEEPEST = 100.0
"""Further below the maximum the likelihood is shown as this."""


def draw(found: Mapping[str, Smoothed], surfaces: Mapping[str, NDArray[np.float64]]) -> "dict[str, Figure]":
    """Return the figures by name: of the runs of each method, and of log likelihoods (20, 20) over the grid."""
    return {"trajectories-track": _track(found), "trajectories-likelihood": _likelihood(surfaces)}


def _track(found: Mapping[str, Smoothed]) -> "Figure":
    """Draw how far measurements and positions are aside of the truth, of the run whose error is the median."""
    figure, panels = new_figure(5.6, rows=len(found), share="xy")
    frames = np.arange(len(TRUE_PATH))
    for panel, (name, one) in zip(panels, found.items(), strict=True):
        panel.axhline(0.0, color=INK["truth"], linewidth=0.8)
        aside = REFERENCE_PX[:, 0] - TRUE_PATH[:, 0]
        panel.plot(frames, aside, ".", color=INK["observation"], label="measured")
        off = track_error(one.filtered, TRUE_PATH[:, None])
        middle = int(np.argsort(off)[len(off) // 2])
        for kind, colour, positions in zip(
            ("smoothed", "filtered"), CURVE_COLOURS, (one.smoothed, one.filtered), strict=False
        ):
            panel.plot(frames, positions[:, middle, 0] - TRUE_PATH[:, 0], color=colour, label=kind)
        write_title(panel, TITLES[name])
        panel.set_ylabel("aside, px")
        panel.set_ylim(-25.0, 15.0)
    panels[-1].set_xlabel("frame")
    explain_below(figure, panels[0], 3)
    return figure


def _likelihood(surfaces: Mapping[str, NDArray[np.float64]]) -> "Figure":
    """Draw maps of the log likelihood less its maximum, and where that is."""
    colours = viridis()
    figure, panels = new_figure(3.4, columns=len(surfaces), share="y")
    for panel, (name, surface) in zip(panels, surfaces.items(), strict=True):
        panel.pcolormesh(GRID, GRID, (surface - surface.max()).T, cmap=colours, vmin=-DEEPEST, vmax=0.0, zorder=2)
        noise, drive = np.unravel_index(surface.argmax(), surface.shape)
        panel.plot(GRID[noise], GRID[drive], "o", color=INK["lost"], mfc="none")
        write_title(panel, f"{TITLES[name]}: best at ({GRID[noise]:g}, {GRID[drive]:g})")
        panel.set_xlabel("σ², px²")
    panels[0].set_ylabel("τ², px²")
    draw_scale(figure, panels, colours, (-DEEPEST, 0.0), "log likelihood less its maximum")
    return figure
