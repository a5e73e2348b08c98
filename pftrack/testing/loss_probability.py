"""Checks of loss probabilities: each that is declared is one, the same whichever way it is told, and rises with a loss.

Of two things the sign is known: a tracker that looks for its target has not got it, and where less is like the target
than was before, the target is less likely to be there. Of others it is not. A filter that is seized by a look-alike, or
by a wall, has a better log evidence there than it had behind the pillar, its particles carry more, and its estimate
rests. So these may have weights of either sign, each beside all others.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.loss_probability import Past, feature_names
from pftrack.testing.check import Check, demand, each_tracker, straight


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, each for every tracker."""
    yield from each_tracker(
        experiment,
        [
            ("its loss probability is one, told at once or frame by frame", _is_probability),
            ("its loss probability rises when it searches, or when little is like its target", _rises),
        ],
    )


def _is_probability(experiment: Experiment, tracker: str) -> None:
    declared = experiment.quality.loss_probability
    for name in {**declared.models, **declared.refused}:
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


def _rises(experiment: Experiment, tracker: str) -> None:
    model = experiment.quality.loss_probability.models.get(tracker)
    if model is None:
        return
    rows = straight(experiment, tracker).run.diagnostics
    _, told = model.follow(Past(), rows)
    likeness = {one.name: 0.0 for one in model.series.values() if one.role == "likeness"}
    shown = {name: value for name, value in likeness.items() if name in model.signals}
    worse = {}
    if "searching" in model.signals and rows[-1].searching is False:
        worse["it searches"] = replace(rows[-1], searching=True)
    if shown.keys() & rows[-1].series.keys():
        worse["nothing is like its target"] = replace(rows[-1], series={**rows[-1].series, **shown})
    for what, row in worse.items():
        _, found = model.follow(Past(), [*rows[:-1], row])
        demand(
            bool(found[-1] >= told[-1]),
            f"the loss probability of {tracker} must not fall when {what}, got {found[-1]} after {told[-1]}",
        )
