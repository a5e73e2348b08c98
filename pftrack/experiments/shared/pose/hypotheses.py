"""Two filters of the same features: one takes them all for visible, the other doubts those that look like nothing.

A feature that looks like nothing is covered, or the solid has moved and its pose is behind. One frame does not tell
which: who believes the features follows every cover, and who doubts them stands still before a head that turns in
an unexpected way. So both accounts are kept, each as a filter with a pose of its own, and as they part the pictures
decide. It is a filter of multiple models (Blom & Bar-Shalom, IEEE Transactions on Automatic Control 33, 1988) without
mixing, since the mean of two poses of which one is wrong is wrong as well.

The log odds of the two are those of how well all features look like themselves where either pose has them, discounted
from frame to frame. A feature that looks like nothing in either place counts for neither, so that a cover does not. The
filter that doubts is left only where the odds say so clearly; a filter that is far behind begins again from the other.
"""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Generator
from pftrack.experiments.shared.pose import layered
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered, Settings
from pftrack.filters import adaptive
from pftrack.filters.layers import UpperLayer
from pftrack.vision.likelihoods.hidden import compare, log_fits

__all__ = ["Rival", "step"]

S = TypeVar("S")

DISCOUNT = 0.8
"""Of what was known in the last frame this share counts."""

BETTER = 2.0
"""Log odds by which all features are believed once some were doubted."""

CLEAR = 5.0
"""Log odds at which nothing is taken to be hidden."""

HOPELESS = 20.0
"""Log odds by which a filter is so far behind that it begins again from the other."""


@dataclass(frozen=True, slots=True)
class Rival(Generic[S]):
    """The filter that is not believed now.

    Attributes:
        layers: Its state.
        doubting: Whether it is the one that doubts features; the one that is believed then takes all for visible.
        log_odds: For the filter that doubts, against the one that does not; discounted.
    """

    layers: Layered[S]
    doubting: bool
    log_odds: float

    @property
    def all_visible(self) -> bool:
        """Whether the odds say clearly that no feature is hidden."""
        return self.log_odds < -CLEAR


def step(
    believed: Layered[S],
    rival: Rival[S] | None,
    layer: UpperLayer[S],
    log_likelihoods: tuple[FeatureLikelihood, FeatureLikelihood],
    settings: Settings,
    rng: Generator,
) -> tuple[Layered[S], Rival[S]]:
    """Advance both filters by one observation, and return the one that is believed and the other.

    Args:
        believed: The filter that was believed.
        rival: The other; None at first, when the one that doubts is believed and the other begins where it is.
        layer: The upper layer.
        log_likelihoods: Of positions in the observation, for the one that was believed and for the other: a template
            looks different in another pose.
        settings: How to track, with the odds of hidden features.
        rng: The frame's generator.
    """
    rival = rival or Rival(believed, doubting=False, log_odds=0.0)
    own, others = log_likelihoods
    trusting = replace(settings, hidden_weight=0.0)
    one = layered.step(believed, layer, own, trusting if rival.doubting else settings, rng)
    other = layered.step(rival.layers, layer, others, settings if rival.doubting else trusting, rng)
    doubts, trusts = (other, one) if rival.doubting else (one, other)
    log_odds = DISCOUNT * rival.log_odds + compare(_fits(doubts, layer, settings), _fits(trusts, layer, settings))
    doubted = log_odds > 0.0 if rival.doubting else log_odds >= -BETTER
    best, behind = (doubts, trusts) if doubted else (trusts, doubts)
    if doubted == rival.doubting:
        # What was believed in the last frame were the particles of the other filter: none of these descends from them.
        best = replace(best, features=adaptive.orphan(best.features))
    if abs(log_odds) > HOPELESS:
        behind, log_odds = best, 0.0
    return best, Rival(behind, doubting=not doubted, log_odds=log_odds)


def _fits(after: Layered[S], layer: UpperLayer[S], settings: Settings) -> NDArray[np.float64]:
    """Return how well each feature looks like itself where a filter's pose has it, (F,) log likelihoods."""
    if after.log_likelihoods is None:
        raise ValueError("a filter is compared after a step, not at its beginning")
    expected = layer.project(after.upper).positions
    return log_fits(after.log_likelihoods, after.features.positions, expected, settings.tolerance_px)
