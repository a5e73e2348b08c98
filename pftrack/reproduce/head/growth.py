"""The pose by a face model that grows from the mean to the person's own, beside both of them.

There is no reference for it: its own bar is the mean model, which it must beat, and the driver's own face,
which it can at best come near. The people are others than those on which the model's noise was chosen
(`trackers.head.growth`).
"""

import numpy as np

from pftrack.reproduce.finding import Finding, Own, claim
from pftrack.reproduce.head.people import errors_of
from pftrack.reproduce.head.trials import Model, Trial, VideoTrials, run_trials
from pftrack.reproduce.pool import Pool

__all__ = ["growth"]

OURS = Own("this project, beyond Bando 2007, ch. 4 section 5.5")
PEOPLE = range(300, 306)
TRIALS = 2
MODELS: tuple[Model, ...] = ("mean", "growing", "individual")


def growth(pool: Pool) -> list[Finding]:
    """Compare the errors of the mixture over six people, two trials each."""
    trials = tuple(Trial("pf-asd", model, seed) for model in MODELS for seed in range(TRIALS))
    drives = pool.map(run_trials, [VideoTrials(person, trials) for person in PEOPLE])
    mean, grown, own = (errors_of(drives, "pf-asd", model) for model in MODELS)
    by_mean, by_grown, by_own = (float(np.median(errors)) for errors in (mean, grown, own))
    better = float(np.mean(grown < mean))
    name = "head: six people, face that grows"
    return [
        claim(
            f"{name}, median error, degrees (below the mean model's, {by_mean:.2f})",
            by_grown,
            holds=by_grown < by_mean,
            source=OURS,
        ),
        claim(
            f"{name}, median error over the own face's, {by_own:.2f} degrees (at most a fifth more)",
            by_grown / by_own,
            holds=by_grown < 1.2 * by_own,
            source=OURS,
        ),
        claim(
            f"{name}: share whom it tracks better than the mean model (more than half)",
            better,
            holds=better > 0.5,
            source=OURS,
        ),
    ]
