"""A run in a notebook: the frame at which it stands, what came of it so far, and its error at a glance."""

import base64
from dataclasses import replace
from html import escape

import cv2

from pftrack.analysis.diagnosis import diagnose
from pftrack.core.model.calibration import TITLES
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.faults import without_faults
from pftrack.output.displays.parts import box, row, table
from pftrack.output.displays.readings import quantity
from pftrack.output.displays.sparkline import track
from pftrack.runs.manifest import extent_of, title_of
from pftrack.runs.run import Run
from pftrack.vision.rendering import render_beside

__all__ = ["run_html", "summary_lines"]

WIDE_PX = 320
"""Of the picture, as it is shown; it has twice as many pixels where there are that many."""
QUALITY = 85


def summary_lines(run: Run) -> dict[str, str]:
    """Return what came of a run so far, in words by what it is."""
    made, experiment = run.summary(), run.experiment
    lines = {"Frames": extent_of(run)}
    if made.verdict.success is not None:
        lines["Outcome"] = "kept" if made.verdict.success else "lost"
    diagnosis = diagnose(run)
    if diagnosis.lost:
        lines["Why"] = diagnosis.sentence
        if run.explained is not None and run.explained.diagnosis.frame == diagnosis.frame:
            lines["What if"] = run.explained.what_if.sentence
    if made.verdict.mean_error is not None:
        lines["Mean error"] = _with_unit(quantity(made.verdict.mean_error, experiment.unit), experiment.unit)
    for measure in experiment.run_measures:
        value = made.measures.get(measure.name)
        if value is not None:
            share = measure.how == "share"
            words = f"{100 * value:.0f} %" if share else _with_unit(quantity(value, measure.unit), measure.unit)
            lines[measure.title] = words
    lines |= {TITLES[direction]: reason for direction, reason in made.miscalibration.items()}
    footage = run.setup.footage
    if footage is not None:
        lines |= {"Recording": footage.name} | ({"SHA-256 of the recording": footage.sha256} if footage.sha256 else {})
    return {**lines, "SHA-256 of the estimates": made.estimates_sha256}


def run_html(run: Run) -> str:
    """Return a run as HTML, at the frame at which it stands."""
    drawing = without_faults(run.experiment.draw(run.current, run.diagnostics))
    lines = {**summary_lines(run), "SHA-256 of the estimates": f"{run.estimates_sha256[:16]}…"}
    rows = "".join(row(key, [escape(value)]) for key, value in lines.items())
    caption = drawing.caption or f"Frame {run.position}"
    style = "font-size:85%;opacity:.75"
    picture = (
        f'<figure style="margin:0;max-width:{WIDE_PX}px"><img src="{_picture(run, drawing)}" alt="{escape(caption)}" '
        f'style="width:100%;display:block"><figcaption style="{style}">{escape(caption)}</figcaption></figure>'
    )
    glance = f'<div style="height:36px;margin-top:6px" title="error over the frames">{track(run)}</div>'
    return box(title_of(run), f'{picture}<div style="flex:1 1 {WIDE_PX}px">{table(rows)}{glance}</div>')


def _picture(run: Run, drawing: Drawing) -> str:
    """Return a drawing as a film would show it, as an address that holds its content."""
    scale = max(1.0, 2.0 * WIDE_PX / max(1, drawing.width * (1 + len(drawing.worlds))))
    image = render_beside(replace(drawing, caption=""), layers=run.experiment.shown_layers, scale=min(2.0, scale))
    file = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, QUALITY))[1]
    return f"data:image/jpeg;base64,{base64.b64encode(file.tobytes()).decode()}"


def _with_unit(words: str, unit: str) -> str:
    return f"{words} {unit}".strip()
