"""Scores: how good probabilities are, beside what came of it.

- Brier score: mean of (p - y)^2 (Brier, Verification of forecasts expressed in terms of probability, 1950).
- Reliability: of the frames in which p was said, how many were lost; the expected calibration error is the mean of the
  difference over ten bins of equal width, weighed by their frames (Naeini, Cooper, Hauskrecht, Obtaining well
  calibrated probabilities using Bayesian binning, 2015).
- Receiver operating characteristic: share of the lost frames that are told over the share of the others that are,
  for every threshold; its area is the chance that a lost frame has the greater probability of the two.
- Delay: frames from the beginning of a loss to the first in which the probability is at least a half.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["BINS", "Bin", "Delays", "Roc", "brier", "calibration_error", "delays", "reliability", "roc"]

BINS = 10
CERTAIN = 0.5
LASTING = 5
"""Losses that last shorter than this are over before anything could be said."""


@dataclass(frozen=True, slots=True)
class Bin:
    """The frames whose probability lies in one of the bins: how many, the mean of it, and how many were lost."""

    frames: int
    probability: float
    lost: float


@dataclass(frozen=True, slots=True)
class Roc:
    """Receiver operating characteristic.

    Attributes:
        false_alarms: Share of the frames not lost whose probability is at least a threshold, from none to all.
        told: Share of the lost ones, by the same thresholds.
        area: Under the curve; NaN where all frames are lost, or none.
    """

    false_alarms: NDArray[np.float64]
    told: NDArray[np.float64]
    area: float


@dataclass(frozen=True, slots=True)
class Delays:
    """How soon losses were told.

    Attributes:
        losses: How many there were that lasted.
        told: How many of them were told before they ended.
        frames: Of each that was told, the frames until it was.
    """

    losses: int
    told: int
    frames: tuple[int, ...]

    @property
    def share(self) -> float:
        """Share of the losses that were told before they ended."""
        return self.told / self.losses if self.losses else float("nan")

    @property
    def median(self) -> float:
        """Frames until half of all losses were told, those that never were included; infinite if fewer were."""
        waits = np.sort(np.array([*self.frames, *[np.inf] * (self.losses - self.told)]))
        return float(waits[(len(waits) - 1) // 2]) if len(waits) else float("nan")


def brier(probabilities: NDArray[np.float64], lost: NDArray[np.bool_]) -> float:
    """Return the mean squared difference of probabilities (L,) and outcomes (L,)."""
    return float(np.mean(np.square(probabilities - lost)))


def reliability(probabilities: NDArray[np.float64], lost: NDArray[np.bool_]) -> tuple[Bin, ...]:
    """Return the frames by their probability, without the bins that have none."""
    places = np.minimum((BINS * probabilities).astype(int), BINS - 1)
    inside = (places == place for place in range(BINS))
    return tuple(
        Bin(int(chosen.sum()), float(probabilities[chosen].mean()), float(lost[chosen].mean()))
        for chosen in inside
        if chosen.any()
    )


def calibration_error(bins: Sequence[Bin]) -> float:
    """Return the expected calibration error."""
    total = sum(one.frames for one in bins)
    return sum(one.frames * abs(one.probability - one.lost) for one in bins) / total


def roc(probabilities: NDArray[np.float64], lost: NDArray[np.bool_]) -> Roc:
    """Return what a threshold tells of the frames that are lost, and of those that are not."""
    order = np.argsort(-probabilities, kind="stable")
    # Those with the same probability come at once.
    last = np.append(np.diff(probabilities[order]) != 0.0, True)
    told = np.concatenate([[0], np.cumsum(lost[order])[last]])
    wrong = np.concatenate([[0], np.cumsum(~lost[order])[last]])
    if not told[-1] or not wrong[-1]:
        return Roc(np.zeros(0), np.zeros(0), float("nan"))
    told, wrong = told / told[-1], wrong / wrong[-1]
    return Roc(wrong, told, float(np.sum(np.diff(wrong) * (told[1:] + told[:-1]) / 2.0)))


def delays(runs: Sequence[tuple[NDArray[np.float64], NDArray[np.bool_]]]) -> Delays:
    """Return how soon the losses of runs were told, by the probabilities and outcomes of each."""
    found: list[int | None] = []
    for probabilities, lost in runs:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
        for begin, end in edges.reshape(-1, 2):
            if end - begin >= LASTING:
                said = np.flatnonzero(probabilities[begin:end] >= CERTAIN)
                found.append(int(said[0]) if len(said) else None)
    frames = tuple(one for one in found if one is not None)
    return Delays(len(found), len(frames), frames)
