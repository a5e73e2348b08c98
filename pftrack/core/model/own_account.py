"""What a tracker says of itself, as measures of a run: of all that are on a recording of which no truth is known.

It may be wrong: a tracker that follows the wrong thing says that it follows. So these numbers compare trackers and
parameters, and prove nothing. How true its probability is that the target is lost was measured in simulated scenes
(`pftrack.experiments.shared.loss_probability`); it is a measure of a run there where a sweep asks for it.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.measures import EvaluatedRun, Measure

__all__ = ["MEAN_LOSS_PROBABILITY", "own_account"]


def own_account(unit: str) -> tuple[Measure, ...]:
    """Return the measures of a run by the tracker's own account.

    Args:
        unit: Of its estimates.
    """
    return (
        Measure(
            "following_share",
            "Says that it follows",
            "Share of the frames in which the tracker does not look for its target; unknown for one that never looks.",
            "share",
            _following,
        ),
        Measure(
            "mean_deviation",
            "Stated deviation",
            "Mean over the frames of the posterior standard deviation, over all components (root mean square).",
            "mean",
            _deviation,
            unit=unit,
            better="lower",
        ),
    )


def _loss_probability(course: EvaluatedRun) -> NDArray[np.float64]:
    if course.loss_probabilities is None:
        return np.full(len(course.errors), np.nan)
    return course.loss_probabilities


MEAN_LOSS_PROBABILITY = Measure(
    "mean_loss_probability",
    "Probability that the target is lost",
    "Mean over the frames after the first of the probability that the target is lost, as the tracker can tell without "
    "a look at the truth; unknown for one that cannot, and on recordings, where it is not calibrated.",
    "mean",
    _loss_probability,
    better="lower",
)


def _following(course: EvaluatedRun) -> NDArray[np.float64]:
    return 1.0 - course.searching if course.searching is not None else np.full(len(course.errors), np.nan)


def _deviation(course: EvaluatedRun) -> NDArray[np.float64]:
    if course.deviations is None:
        return np.full(len(course.errors), np.nan)
    return np.where(np.isfinite(course.deviations), course.deviations, np.nan)
