"""Checks of loss probabilities: each that is declared is one, and the same whichever way it is told."""

from collections.abc import Iterator

import numpy as np

from pftrack.experiment import Experiment
from pftrack.loss_probability.features import feature_names
from pftrack.loss_probability.model import Past
from pftrack.testing.check import Check, demand, each_tracker, straight

__all__ = ["checks"]


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, each for every tracker."""
    yield from each_tracker(
        experiment, [("its loss probability is one, told at once or frame by frame", _is_probability)]
    )


def _is_probability(experiment: Experiment, tracker: str) -> None:
    declared = experiment.loss_probability
    for name in {*declared.models, *declared.refused, *declared.on_recordings}:
        demand(
            name in experiment.trackers, f"{experiment.id} has no tracker {name!r}, of which its loss probability is"
        )
    model = declared.models.get(tracker)
    if model is None:
        return
    wanted, given = len(feature_names(model.signals)), len(model.regression.weights)
    demand(given == wanted, f"the loss probability of {tracker} must weigh {wanted} features, got {given}")
    rows = straight(experiment, tracker).run.diagnostics
    _, told = model.follow(Past(), rows)
    demand(bool(np.isnan(told[0])), f"the loss probability of frame 0 must not be known, got {told[0]}")
    inside = (told[1:] >= 0.0) & (told[1:] <= 1.0)
    demand(bool(inside.all()), f"loss probabilities must be between 0 and 1, got {told[1:][~inside]}")
    past, one_by_one = Past(), []
    for row in rows:
        past, found = model.follow(past, [row])
        one_by_one += found.tolist()
    same = np.array_equal(one_by_one, told, equal_nan=True)
    demand(same, f"the loss probability of {tracker} is another one where it is told frame by frame")
