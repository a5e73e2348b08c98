"""The numbers that plots are drawn of: arrays over the frames of a run, NaN where a frame has none."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model import series
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Hypotheses, Series
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run

__all__ = [
    "errors",
    "find_series",
    "frames",
    "hidden_frames",
    "hypotheses",
    "lost_frames",
    "measure",
    "of_role",
    "sigmas",
    "thresholds",
]

Numbers = NDArray[np.float64]


def frames(run: Run) -> NDArray[np.int64]:
    """Return the (L,) indices of the frames that were computed."""
    return np.arange(run.computed + 1)


def errors(run: Run) -> Numbers:
    """Return (L,) distances of the estimate from the truth."""
    return np.array([np.nan if row.error is None else row.error for row in run.diagnostics])


def sigmas(run: Run) -> Numbers:
    """Return (L,) the largest standard deviation of each frame."""
    return np.array([max(row.sigma, default=np.nan) for row in run.diagnostics])


def hidden_frames(run: Run) -> NDArray[np.bool_]:
    """Return (L,) whether the target is known to be out of sight."""
    return np.array([row.hidden is True for row in run.diagnostics])


def lost_frames(run: Run) -> NDArray[np.bool_]:
    """Return (L,) whether the target is lost."""
    return find_lost_frames(run).lost


def find_series(run: Run, name: str) -> Series:
    """Return the declaration of a series that a plot names."""
    return next(one for one in run.experiment.all_series() if one.name == name)


def of_role(run: Run, role: str) -> list[Series]:
    """Return the series of a role that some frame has."""
    return [one for one in run.experiment.all_series() if one.role == role and _is_measured(run, one.name)]


def measure(run: Run, name: str) -> Numbers:
    """Return the values of a series, (L,) numbers, or (L, d) vectors and intervals; (L,) NaN where no frame has any."""
    values = [row.series.get(name) for row in run.diagnostics]
    if not name or all(value is None for value in values):
        return np.full(len(values), np.nan)
    return series.columns(find_series(run, name), values)[name]


def hypotheses(run: Run, name: str) -> list[Hypotheses]:
    """Return the hypotheses of each frame, without any where it has none."""
    return [row.hypotheses(name) or Hypotheses((), ()) for row in run.diagnostics]


def thresholds(run: Run, of: str) -> Iterator[tuple[list[int], list[float]]]:
    """Yield of each parameter that limits a series the frames from which a value is in force, and the values."""
    changes = sorted({0, *(change.frame for change in run.timeline.changes if change.frame <= run.computed)})
    steps = [*changes, run.computed]
    for item in run.experiment.declarations(type(run.setup.parameters)):
        if item.role == "threshold" and item.threshold_of == of:
            values = [_in_force(run, item, frame) for frame in steps]
            if not np.isnan(values).all():
                yield steps, values


def _in_force(run: Run, item: Declaration, frame: int) -> float:
    if item.trackers and run.tracker_at(frame) not in item.trackers:
        return np.nan
    return float(getattr(run.parameters_at(frame), item.name))


def _is_measured(run: Run, name: str) -> bool:
    return any(name in row.series for row in run.diagnostics)
