"""Checks of what else a run might have been: other seeds, and changes one at a time, from one of its frames on."""

from collections.abc import Iterator

import numpy as np

from pftrack.analysis.counterfactuals import alternatives
from pftrack.core.model.recipe import Change
from pftrack.experiments.experiment import Experiment
from pftrack.runs.many import Trial, read_blocks
from pftrack.testing.check import FRAMES, SEED, Check, demand, each_tracker, straight

BEGIN = FRAMES - 4
OTHER_SEED = SEED + 1


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield checks of each tracker."""
    yield from each_tracker(
        experiment,
        [
            ("other seeds from a frame on are a branch with these seeds", _other_seeds_are_branches),
            ("every change that is tried of a run can be computed", _changes_can_be_computed),
        ],
    )


def _other_seeds_are_branches(experiment: Experiment, tracker: str) -> None:
    branch = straight(experiment, tracker).run.branch(BEGIN, {"seed": OTHER_SEED})
    one = Trial(experiment, branch.source, branch.timeline, OTHER_SEED, branch.current.state)
    for block in read_blocks(branch.source, branch.timeline.history, BEGIN + 1, FRAMES - 1):
        one.take(block)
    branch.finish()
    errors = np.array([np.nan if row.error is None else row.error for row in branch.diagnostics[BEGIN + 1 :]])
    demand(
        np.array_equal(one.errors, errors, equal_nan=True),
        f"runs that go on from frame {BEGIN} with the seed {OTHER_SEED} come to other errors than a branch: "
        f"{one.errors.tolist()} for {errors.tolist()}",
    )


def _changes_can_be_computed(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    state = run.branch(BEGIN).current.state
    for each in alternatives(run, BEGIN + 1):
        if each.kind == "tracker":  # each follows each other one in a check of its own
            continue
        timeline = run.timeline.insert(Change(BEGIN + 1, each.values)) if each.values else run.timeline
        one = Trial(experiment, run.source, timeline, OTHER_SEED, state)
        try:
            for block in read_blocks(run.source, timeline.history, BEGIN + 1, BEGIN + 1):
                one.take(block)
        except Exception as error:  # noqa: BLE001 - it is another package's
            demand(False, f"{each.title} must be computed, got {type(error).__name__}: {error}")
