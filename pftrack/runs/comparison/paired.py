"""Two runs frame by frame: where their estimates part, and how much better one of them did.

The frames of a run are no independent trials: an error that is large in one frame is large in the next. So the interval
of their mean difference is that of a few long stretches (`pftrack.core.numerics.statistics.dependent_mean_interval`).
It speaks of these two runs, of their one seed; what other seeds would give is a question for a sweep.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.series import to_json
from pftrack.core.numerics.statistics import dependent_mean_interval

__all__ = ["CONFIDENCE", "Divergence", "Paired", "find_divergence", "paired_difference"]

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Divergence:
    """Where two runs part.

    Attributes:
        first: Place of one run in the comparison.
        second: Place of the other.
        frame: The first frame in which their estimates differ, if only in the last bit; None if they never do.
    """

    first: int
    second: int
    frame: int | None

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Paired:
    """How much one run's frames differ from another's in a quantity.

    Attributes:
        first: Place of one run in the comparison.
        second: Place of the other.
        name: Of the quantity: "error", or that of a measure which is a share of frames.
        title: What it is called.
        unit: Of the difference; empty for a pure number or a difference of shares.
        better: Whether a "higher" or a "lower" value is better.
        frames: In how many frames both runs have it.
        mean: Of the second run's value minus the first's, over those frames; NaN where there are none.
        low: Lower end of its 95 % interval; NaN where that is not applicable.
        high: Upper end.
    """

    first: int
    second: int
    name: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    frames: int
    mean: float
    low: float
    high: float

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values; what is not a number becomes None."""
        return {name: to_json(value) if isinstance(value, float) else value for name, value in asdict(self).items()}


def find_divergence(one: Sequence[Sequence[float]], other: Sequence[Sequence[float]]) -> int | None:
    """Return the first frame in which estimates differ to the bit; None if they agree as far as both are known.

    Args:
        one: Estimates of a run by frame, (d,) each.
        other: Those of the other run, from the same frame on.
    """
    return next((frame for frame, pair in enumerate(zip(one, other, strict=False)) if not _same(*pair)), None)


def _same(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(one) == len(other) and bool(np.array_equal(one, other, equal_nan=True))


def paired_difference(one: NDArray[np.float64], other: NDArray[np.float64]) -> tuple[int, float, float, float]:
    """Return how many frames two runs have a value in, the mean of the other's minus the one's, and its interval.

    Args:
        one: (L,) values of the frames of a run; what is not finite is left out.
        other: (L,) those of the other run.
    """
    known = np.isfinite(one) & np.isfinite(other)
    gains = other[known] - one[known]
    mean = float(gains.mean()) if len(gains) else np.nan
    return len(gains), mean, *dependent_mean_interval(gains, CONFIDENCE)
