"""The probability that a tracker has lost its target, by a regression on what the rows of its run say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.series import Series
from pftrack.experiments.shared.loss_probability.features import Memory, remember
from pftrack.experiments.shared.loss_probability.logistic import Logistic
from pftrack.experiments.shared.loss_probability.signals import read_signals

__all__ = ["LossModel", "Past"]


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """What a model keeps of the frames behind it.

    Attributes:
        memory: Of the signals; None before the first frame.
        estimates: The last two.
    """

    memory: Memory | None = None
    estimates: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class LossModel:
    """What says how probable it is that a tracker has lost its target.

    Attributes:
        signals: Names of what is read of each frame.
        regression: On the features of these, in the order of `feature_names`.
        series: What the rows of the tracker have, by name.
    """

    signals: tuple[str, ...]
    regression: Logistic
    series: Mapping[str, Series] = field(default_factory=dict)

    def follow(self, past: Past, rows: Sequence[Diagnostics]) -> tuple[Past, NDArray[np.float64]]:
        """Return what is kept after some frames, and the probability in each, (L,).

        Args:
            past: After the frame before them; what is empty begins with the first of these, in which a tracker does
                nothing but begin, so that its probability is not known.
            rows: Of consecutive frames.
        """
        if not rows:
            return past, np.zeros(0)
        past, features = follow_features(self.signals, self.series, past, rows)
        said = self.regression.probabilities(features)
        return past, np.concatenate([np.full(len(rows) - len(said), np.nan), said])


def follow_features(
    signals: Sequence[str], series: Mapping[str, Series], past: Past, rows: Sequence[Diagnostics]
) -> tuple[Past, NDArray[np.float64]]:
    """Return what is kept after some frames, and the features of each but one in which a tracker begins."""
    estimates = (*past.estimates, *(row.estimate for row in rows))[-2:]
    memory, before = past.memory, past.estimates
    if memory is None:
        memory, before, rows = Memory.empty(len(signals)), (rows[0].estimate,), rows[1:]
    if rows:
        memory, features = remember(memory, read_signals(signals, series, rows, before))
    else:
        features = np.zeros((0, 0))
    return Past(memory, estimates), features
