"""Scores: what some frames of a run come to, by the filter's own word and by the truth.

Where a likelihood leaves out a constant of the frame, a sharper one has another constant, and its evidence cannot be
compared. What can is how much more probable the frame is where the filter had expected the target than anywhere in the
picture: the evidence beside the mean likelihood over all places. That is a score for predicting the place among all
places, and it has no constant left (Bishop 2006, section 4.3: a softmax over places).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.particles import normalise
from pftrack.runs.consistency import Consistency, measure_consistency
from pftrack.runs.coverage import Counts, count_held, pool_counts
from pftrack.runs.run import Run

__all__ = ["Score", "compute_evidence", "score"]

MOST_BELOW: Final = 50.0
"""By how much the log evidence of a frame may be below the run's median where it is not exact: one in which all
particles happen to have a weight of zero would hide all other frames."""


@dataclass(frozen=True, slots=True)
class Score:
    """What some frames come to, over several runs.

    Attributes:
        evidence: (L,) log evidence of each frame, nats, as a mean over the runs.
        coverage: Share of the reports in which a band of 50 or 95 % held the truth, by that share; empty where no truth
            is known or no band is told.
        consistency: How large errors and innovations are in the deviations that were told.
    """

    evidence: NDArray[np.float64]
    coverage: Mapping[float, float]
    consistency: Consistency

    @property
    def mean(self) -> float:
        """Mean log evidence of a frame, nats."""
        return float(self.evidence.mean())

    def as_dict(self) -> dict[str, Any]:
        """Return its numbers as JSON values by name; the evidence as its mean."""
        coverage = {f"{100 * promised:g}": share for promised, share in self.coverage.items()}
        return {"log_evidence": self.mean, "coverage": coverage, **self.consistency.as_dict()}


def compute_evidence(run: Run, levelled: Sequence[int] = ()) -> NDArray[np.float64]:
    """Compute a run to its end, and return its log evidence in each frame (T,), nats.

    Args:
        run: At its frame 0.
        levelled: Frames in which it is taken beside the mean likelihood all over the picture; if there are any, the
            others count for nothing and are NaN.

    Raises:
        ValueError: The likelihood over the picture is wanted and the tracker has none.
    """
    levels, wanted, before = {}, frozenset(levelled), run.current
    for step in run:
        if step.frame.index in wanted:
            levels[step.frame.index] = _level(run, before.state, step)
        before = step
    evidence = np.array([row.log_evidence for row in run.diagnostics])
    evidence = np.where(np.isnan(evidence), -np.inf, evidence)
    if wanted:
        evidence -= np.array([levels.get(frame, np.nan) for frame in range(len(evidence))])
    exact = run.experiment.trackers[run.tracker].linear is not None
    return evidence if exact else _bound(evidence)


def _bound(evidence: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return log evidence (T,) none of which is too far below the others; NaN stays."""
    possible = evidence[np.isfinite(evidence)]
    usual = float(np.median(possible)) if len(possible) else 0.0
    return np.where(np.isnan(evidence), evidence, np.maximum(evidence, usual - MOST_BELOW))


def _level(run: Run, before: Any, step: Any) -> float:  # noqa: ANN401 - the state of any family
    likelihood, image = run.experiment.trackers[step.tracker].likelihood, step.frame.image_rgb
    if likelihood is None or image is None:
        raise ValueError(f"{step.tracker_title} has no likelihood over a picture")
    found = likelihood.map(before, step.state, step.frame, step.parameters, (image.shape[1], image.shape[0]))
    _, log_sum = normalise(found.log_likelihoods.ravel())
    return log_sum - float(np.log(found.log_likelihoods.size))


def score(runs: Sequence[Run], evidence: Sequence[NDArray[np.float64]], first: int, end: int) -> Score:
    """Return what some frames of several runs come to.

    Args:
        runs: Of the same recording and settings with other random numbers, computed to that end.
        evidence: (T,) log evidence of each run, nats, NaN in frames that count for nothing.
        first: The first frame that counts.
        end: The frame after the last.

    Raises:
        ValueError: There is no run, or none of these frames counts.
    """
    among = np.mean([one[first:end] for one in evidence], axis=0) if runs else np.zeros(0)
    known = among[~np.isnan(among)]
    if not len(known):
        raise ValueError(f"no frame from {first} to {end - 1} counts")
    coverage = _coverage([count_held(run, first, end) for run in runs])
    return Score(known, coverage, measure_consistency(runs, first, end))


def _coverage(counts: Sequence[Counts]) -> dict[float, float]:
    """Return the coverage of the first band that the experiment declares."""
    pooled = pool_counts(counts)
    of = pooled[0].of if pooled else ""
    return {one.promised: one.share for one in pooled if one.of == of}
