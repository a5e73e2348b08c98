"""Success curves: the share of trials whose error on an axis is below a threshold, over the threshold (fig. 4.16).

A curve is steep: all trials of a method see the same video, and their errors lie within a few tenths of a degree. A
rate at one threshold therefore says little about another renderer, and it is the curve's *place* that is compared: by
how much it has to be moved along the thresholds to agree with the reference at all thresholds that are known.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.reproduce.finding import CHOSEN, Finding, claim, compare
from pftrack.reproduce.head.trials import Model, TrialResult

__all__ = ["AXES", "curves", "success_rates"]

SOURCE = "Bando 2007, ch. 4 fig. 4.16; reference implementation"

AXES = ("pitch", "yaw", "roll")
THRESHOLDS_DEG = (0.5, 1.5, 2.0, 2.5, 3.0)
RATES: dict[Model, tuple[tuple[float, ...], ...]] = {
    "mean": ((0.0, 0.0, 0.95, 1.0, 1.0), (0.0, 0.0, 0.0, 0.5, 0.85), (1.0, 1.0, 1.0, 1.0, 1.0)),
    "individual": ((0.0, 0.85, 1.0, 1.0, 1.0), (0.0, 0.0, 1.0, 1.0, 1.0), (0.95, 1.0, 1.0, 1.0, 1.0)),
}
"""Of driver 99 with the mixture, by axis and threshold."""

SLACK = 0.1
"""Two trials of twenty may be on the other side of a threshold."""

FARTHEST_DEG, STEP_DEG = 3.0, 0.01
TOLERANCE_DEG = 0.7
"""0.4 of the mean over three axes, times their root."""

GAIN_AT = {"pitch": 1.5, "yaw": 2.0}
"""Thresholds in degrees at which the reference's own face succeeds and the mean model does not."""


def success_rates(
    courses: Sequence[TrialResult], axis: int, thresholds_deg: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the share of trials whose mean absolute error on an axis is below each threshold, (n,)."""
    errors = np.array([course.errors_deg[axis] for course in courses])
    rates: NDArray[np.float64] = (errors < thresholds_deg[:, None]).mean(axis=1)
    return rates


def curves(by_model: dict[Model, list[TrialResult]]) -> list[Finding]:
    """Compare the curves of driver 99, tracked by the mixture, given the trials by face model."""
    findings = []
    for model, references in RATES.items():
        for axis, name in enumerate(AXES):
            moved = _distance_deg(by_model[model], axis, np.array(references[axis]))
            result = f"head: success curve of {name}, {model} model, by how much it lies elsewhere, degrees"
            findings.append(compare(result, moved, 0.0, TOLERANCE_DEG, SOURCE, ground=CHOSEN))
    for name, threshold in GAIN_AT.items():
        axis, at = AXES.index(name), np.array([threshold])
        own, other = (success_rates(by_model[model], axis, at)[0] for model in ("individual", "mean"))
        result = f"head: success within {threshold} degrees of {name}: the own face succeeds more often (gain)"
        findings.append(claim(result, float(own - other), holds=own > other, source=SOURCE))
    return findings


def _distance_deg(courses: Sequence[TrialResult], axis: int, references: NDArray[np.float64]) -> float:
    """Return by how little a curve has to be moved, to one side or the other, to meet the reference."""
    thresholds = np.array(THRESHOLDS_DEG)
    for moved in np.arange(0.0, FARTHEST_DEG, STEP_DEG):
        low = success_rates(courses, axis, thresholds - moved)
        high = success_rates(courses, axis, thresholds + moved)
        if (low - SLACK <= references).all() and (references <= high + SLACK).all():
            return float(moved)
    return float("nan")
