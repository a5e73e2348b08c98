"""The frame at which a run stands, as a picture with all that is drawn: PNG, or SVG for print."""

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.faults import without_faults
from pftrack.runs.run import Run
from pftrack.vision.rendering import png, render_beside
from pftrack.vision.rendering.vector import svg

SMALLEST_PX = 1200
"""A small picture is enlarged so far that lines and letters on it are sharp."""


def png_of_frame(run: Run) -> bytes:
    """Return the frame with its worlds as PNG, enlarged by a whole number."""
    drawing = _drawing(run)
    scale = max(1, round(SMALLEST_PX / drawing.width))
    return png(render_beside(drawing, layers=run.experiment.shown_layers, scale=scale))


def svg_of_frame(run: Run) -> bytes:
    """Return the frame with its worlds as SVG."""
    return svg(_drawing(run), layers=run.experiment.shown_layers)


def _drawing(run: Run) -> Drawing:
    return without_faults(run.experiment.draw(run.current, run.diagnostics))
