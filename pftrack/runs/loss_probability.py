"""How probable it is that the target of a run is lost, frame by frame.

It is told from the rows when it is asked for: a run costs nothing for it, and runs of earlier versions have it, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pftrack.experiment import Experiment, Setup
from pftrack.loss_probability.model import Past
from pftrack.model.diagnostics import Diagnostics
from pftrack.model.measures import evaluate
from pftrack.model.own_account import MEAN_LOSS_PROBABILITY
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run

__all__ = [
    "LossAccount",
    "LossPast",
    "follow_loss",
    "loss_probabilities",
    "measure_loss_probability",
    "tells_loss",
]


def loss_probabilities(run: Run) -> NDArray[np.float64]:
    """Return the probability in each frame that a run has computed, (L,).

    NaN in frame 0, in which a tracker only begins, and wherever the tracker has no such probability. A tracker that
    takes over begins anew: its first frame has none, either.
    """
    return np.array(LossAccount().follow(run))


def measure_loss_probability(run: Run) -> Mapping[str, float | int]:
    """Return the mean of these as a measure of the run, by its name; empty where no frame has one."""
    course = evaluated_run(run.experiment, run.diagnostics)
    return evaluate((MEAN_LOSS_PROBABILITY,), replace(course, loss_probabilities=loss_probabilities(run)))


def tells_loss(experiment: Experiment, setup: Setup) -> bool:
    """Return whether a probability has to say of a run where its target is lost, since no truth says it."""
    recording = setup.footage
    return recording is not None and not recording.labelled and bool(experiment.loss_probability.on_recordings)


@dataclass(frozen=True, slots=True, eq=False)
class LossPast:
    """What is kept of the frames behind.

    Attributes:
        tracker: Name of that which computed the last of them.
        past: What its model keeps.
    """

    tracker: str = ""
    past: Past = field(default_factory=Past)


def follow_loss(
    experiment: Experiment, kept: LossPast, tracker: str, rows: Sequence[Diagnostics], *, recording: bool
) -> tuple[LossPast, list[float]]:
    """Return what is kept after some frames, and the probability in each.

    Args:
        experiment: Which declares what tells it.
        kept: After the frame before them.
        tracker: Name of that which has computed them.
        rows: Of consecutive frames.
        recording: Whether they are of a recording.
    """
    if tracker != kept.tracker:
        kept = LossPast(tracker)
    model = experiment.loss_probability.model_of(tracker, recording=recording)
    if model is None:
        return kept, [np.nan] * len(rows)
    past, told = model.follow(kept.past, rows)
    return LossPast(tracker, past), [float(one) for one in told]


class LossAccount:
    """The same of a run that goes on: what was told is not computed again.

    Attributes:
        kept: What is kept of the frames so far.
    """

    def __init__(self) -> None:
        """Begin with no frame."""
        self.kept = LossPast()
        self._rows: list[Diagnostics] | None = None
        self._told: list[float] = []

    def follow(self, run: Run) -> Sequence[float]:
        """Return the probability in each frame that the run has computed; what was told of it before is kept."""
        if self._rows is not run.diagnostics:
            # Another run, such as a branch.
            self._rows, self._told, self.kept = run.diagnostics, [], LossPast()
        begun, end = len(self._told), len(run.diagnostics)
        edges = [begun, *(one.start for one in run.timeline.segments if begun < one.start < end), end]
        recording = run.setup.footage is not None
        for start, stop in pairwise(edges):
            rows, tracker = run.diagnostics[start:stop], run.tracker_at(start)
            self.kept, told = follow_loss(run.experiment, self.kept, tracker, rows, recording=recording)
            self._told += told
        return self._told
