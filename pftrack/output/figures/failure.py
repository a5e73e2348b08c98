"""The errors of a failing run and of the cured one over their frames, as the gallery of failures shows them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pftrack.output.figures.style import INK, ONE_COLUMN_IN, explain_below, new_figure, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_failure"]

HIGH_IN = 2.4


def draw_failure(
    failing: Sequence[float | None], cured: Sequence[float | None], *, title: str, unit: str, frame: int
) -> "Figure":
    """Draw both errors in one column of a journal's page.

    Args:
        failing: Error of each frame of the run that fails; None where it is not known.
        cured: Of the other one.
        title: What fails.
        unit: Of the errors.
        frame: The one before it happens; it is marked.
    """
    figure, (panel,) = new_figure(HIGH_IN, width=ONE_COLUMN_IN)
    panel.axvline(frame, color=INK["frame"], linewidth=0.8, linestyle=":")
    panel.plot(np.array(cured, dtype=float), color=INK["second"], linewidth=1.2, linestyle="--", label="cured")
    panel.plot(np.array(failing, dtype=float), color=INK["lost"], linewidth=1.5, label="fails")
    panel.set_ylim(bottom=0.0)
    panel.set_xlabel("frame")
    panel.set_ylabel(f"error, {unit}" if unit else "error")
    write_title(panel, title)
    explain_below(figure, panel, 2)
    return figure
