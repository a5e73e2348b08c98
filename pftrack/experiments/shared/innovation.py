"""What Kalman filters tell of their updates: innovation, gain, and how far off measurements were.

The normalised innovation squared (NIS) tells whether a filter is consistent, without the truth: on average it should be
as large as numbers are measured, and above its limit in one frame of twenty. Larger, the filter is too sure of itself;
smaller, it could be surer (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.part import Amount, Part, Residual
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.filters.kalman import Innovation, NormalisedInnovation

__all__ = ["NIS", "innovation_parts", "measure_innovation"]

NIS = (
    Series(
        "nis",
        "normalised innovation squared",
        role="nis",
        reductions=(Reduction("mean_nis", "mean normalised innovation squared", "mean"),),
    ),
    Series(
        "nis_freedom",
        "numbers measured",
        role="nis_freedom",
        reductions=(Reduction("mean_nis_freedom", "mean numbers measured in a frame", "mean"),),
    ),
    Series("nis_limit", "limit of 95 %", role="nis_limit"),
)
"""Of every tracker that predicts its measurement as a Gaussian; a frame without a measurement has none of them."""

LIMIT_DIGITS = 6


def measure_innovation(innovation: NormalisedInnovation | None) -> Mapping[str, SeriesValue]:
    """Return the values of `NIS`; none where nothing was measured."""
    if innovation is None:
        return {}
    squared, freedom = innovation
    return {"nis": squared, "nis_freedom": float(freedom), "nis_limit": _limit(freedom)}


def innovation_parts(
    names: tuple[str, ...], unit: str, measurement: NDArray[np.float64], innovation: Innovation
) -> tuple[Part, ...]:
    """Return the innovation of each value, the gain, and the normalised innovation squared with its limit of 95 %.

    Args:
        names: Of the m values of the measurement.
        unit: Of all of them.
        measurement: (m,).
        innovation: Of it; value i is that of the state's coordinate i.
    """
    deviations = np.sqrt(innovation.covariance.diagonal())
    parts: list[Part] = []
    for axis, name in enumerate(names):
        found, expected = float(measurement[axis]), float(measurement[axis] - innovation.values[axis])
        parts.append(Residual(f"innovation, {name}", found, expected, float(deviations[axis]), unit))
    parts += [Amount(f"gain, {name}", float(innovation.gain[axis, axis])) for axis, name in enumerate(names)]
    squared, freedom = innovation.normalised
    return (*parts, Amount("normalised innovation squared", squared, limit=_limit(freedom)))


@lru_cache(maxsize=64)
def _limit(freedom: int) -> float:
    # Rounded, since the last digits of a quantile hang on the library that computes it.
    return round(chi_square_limit(freedom), LIMIT_DIGITS)
