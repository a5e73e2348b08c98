"""The probability that the target of a run is lost, frame by frame; and the numbers of a run's frames as columns.

The probability is computed from the rows on demand: it does not slow a run, and runs of earlier versions have it, too.
Columns are arrays by name, as files hold them, notebooks show and lessons read them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model import series
from pftrack.core.model.measures import MEAN_LOSS_PROBABILITY, evaluate
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments.shared.loss_probability import LOSS_PROBABILITY, Past
from pftrack.runs.scoring import evaluated_run

if TYPE_CHECKING:
    from pftrack.runs.run import Run


def loss_probabilities(run: "Run") -> Floats:
    """Return the probability in each frame that a run has computed, (L,).

    NaN in frame 0, in which a tracker only begins, wherever the tracker has no such probability, and on recordings. A
    tracker after a switch begins anew: its first frame has none, either.
    """
    return np.array(LossAccount().follow(run))


def measure_loss_probability(run: "Run") -> Mapping[str, float | int]:
    """Return the mean of these as a measure of the run, by its name; empty where no frame has one."""
    course = evaluated_run(run.experiment, run.diagnostics)
    return evaluate((MEAN_LOSS_PROBABILITY,), replace(course, loss_probabilities=loss_probabilities(run)))


class LossAccount:
    """The same for a growing run: known values are not computed again."""

    def __init__(self) -> None:
        """Begin with no frame."""
        self._rows: list[Diagnostics] | None = None
        self._told: list[float] = []
        self._tracker, self._past = "", Past()

    def follow(self, run: "Run") -> Sequence[float]:
        """Return the probability in each frame that the run has computed; values computed before are kept."""
        if self._rows is not run.diagnostics:
            # Another run, such as a branch.
            self._rows, self._told, self._tracker = run.diagnostics, [], ""
        models = run.experiment.quality.loss_probability.models_on(run.setup.footage)
        begun, end = len(self._told), len(run.diagnostics)
        edges = [begun, *(one.start for one in run.timeline.segments if begun < one.start < end), end]
        for start, stop in pairwise(edges):
            rows, tracker = run.diagnostics[start:stop], run.tracker_at(start)
            if tracker != self._tracker:
                self._tracker, self._past = tracker, Past()
            told = np.full(len(rows), np.nan)
            if tracker in models:
                self._past, told = models[tracker].follow(self._past, rows)
            self._told += told.tolist()
        return self._told


# What every frame has is a column under the names of its diagnostics, and what tracker and experiment have measured
# under `series_NAME`, with the probability that the target is lost, where the tracker has one. A number that is not
# known is NaN; true and false are 1 and 0.

PREFIX = "series_"
"""Prefix of the columns of measurements beyond those of every frame."""


def columns_of(run: "Run") -> dict[str, np.ndarray[Any, Any]]:
    """Return the columns of all frames that were computed, one row a frame; what no frame has is left out."""
    rows = [row.as_dict() for row in run.diagnostics]
    columns = {name: _column([row[name] for row in rows]) for name in rows[0] if name != "series"}
    for declared in run.experiment.all_series():
        values = [row.series.get(declared.name) for row in run.diagnostics]
        if any(value is not None for value in values):
            columns |= {f"{PREFIX}{name}": column for name, column in series.columns(declared, values).items()}
    said = loss_probabilities(run)
    return columns if np.isnan(said).all() else columns | {f"{PREFIX}{LOSS_PROBABILITY.name}": said}


def _column(values: list[Any]) -> np.ndarray[Any, Any]:
    """Return one value a frame as an array; numbers that are missing become NaN."""
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=np.str_)
    width = max((len(value) for value in values if isinstance(value, list | tuple)), default=0)
    missing = [np.nan] * width if width else np.nan
    return np.array([missing if value is None else value for value in values], dtype=np.float64)
