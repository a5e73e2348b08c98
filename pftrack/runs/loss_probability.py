"""How probable it is that the target of a run is lost, frame by frame.

It is told from the rows when it is asked for: a run costs nothing for it, and runs of earlier versions have it, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.measures import evaluate
from pftrack.core.model.own_account import MEAN_LOSS_PROBABILITY
from pftrack.experiments.shared.loss_probability.model import Past
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run

__all__ = [
    "LossAccount",
    "loss_probabilities",
    "measure_loss_probability",
]


def loss_probabilities(run: Run) -> NDArray[np.float64]:
    """Return the probability in each frame that a run has computed, (L,).

    NaN in frame 0, in which a tracker only begins, wherever the tracker has no such probability, and on recordings. A
    tracker that takes over begins anew: its first frame has none, either.
    """
    return np.array(LossAccount().follow(run))


def measure_loss_probability(run: Run) -> Mapping[str, float | int]:
    """Return the mean of these as a measure of the run, by its name; empty where no frame has one."""
    course = evaluated_run(run.experiment, run.diagnostics)
    return evaluate((MEAN_LOSS_PROBABILITY,), replace(course, loss_probabilities=loss_probabilities(run)))


class LossAccount:
    """The same of a run that goes on: what was told is not computed again."""

    def __init__(self) -> None:
        """Begin with no frame."""
        self._rows: list[Diagnostics] | None = None
        self._told: list[float] = []
        self._tracker, self._past = "", Past()

    def follow(self, run: Run) -> Sequence[float]:
        """Return the probability in each frame that the run has computed; what was told of it before is kept."""
        if self._rows is not run.diagnostics:
            # Another run, such as a branch.
            self._rows, self._told, self._tracker = run.diagnostics, [], ""
        models = run.experiment.loss_probability.models_on(run.setup.footage)
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
