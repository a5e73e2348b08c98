"""Boxes of a run in the forms of other trackers: what is believed, and what is true; see `pftrack.sources.results`."""

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.export import ExportError
from pftrack.runs.run import Run
from pftrack.runs.scoring import extent_series
from pftrack.sources.results.table import Box, Form
from pftrack.sources.results.writing import write_results

__all__ = ["believed_file", "true_file"]


def believed_file(run: Run, form: Form) -> bytes:
    """Return the boxes that the tracker believes in, of all frames computed; those of a clip count as in the clip.

    Raises:
        ExportError: It believes in none.
    """
    boxes = _of_states(run) if run.experiment.boxes is not None else _of_rows(run)
    return _file(run, form, boxes, "no frame has a box that is believed")


def true_file(run: Run, form: Form) -> bytes:
    """Return the true boxes of all frames computed.

    Raises:
        ExportError: None is known.
    """
    boxes = [
        _box(_number(run, row.frame), row.truth, row.extent) for row in run.diagnostics if row.truth and row.extent
    ]
    return _file(run, form, boxes, "no frame has a true box")


def _file(run: Run, form: Form, boxes: list[Box], nothing: str) -> bytes:
    if not boxes:
        raise ExportError(nothing)
    frames = _number(run, run.computed) + 1
    return write_results(form, boxes, frames=frames, size=run.source.size, rate_hz=run.source.frame_rate_hz)


def _of_states(run: Run) -> list[Box]:
    if run.experiment.boxes is None:
        return []
    found: list[Box] = []
    for frame in range(run.computed + 1):
        state = run.seek(frame).state
        found += (box._replace(frame=_number(run, frame)) for box in run.experiment.boxes(state))
    return found


def _of_rows(run: Run) -> list[Box]:
    name = extent_series(run.experiment.all_series())
    return [
        _box(_number(run, row.frame), row.estimate, extent) for row in run.diagnostics if (extent := _extent(row, name))
    ]


def _extent(row: Diagnostics, name: str | None) -> tuple[float, ...] | None:
    extent = row.vector(name) if name else None
    return extent if extent and np.isfinite([*extent, *row.estimate]).all() else None


def _box(frame: int, centre: tuple[float, ...], extent: tuple[float, ...]) -> Box:
    """Return the box around a position; it covers whole pixels, and positions count from the centre of the first."""
    (x, y), (w, h) = centre[:2], extent
    return Box(frame, 1, x - (w - 1.0) / 2.0, y - (h - 1.0) / 2.0, w, h)


def _number(run: Run, frame: int) -> int:
    """Return the number in the recording of a frame of the run."""
    return frame + (run.setup.footage.start if run.setup.footage else 0)
