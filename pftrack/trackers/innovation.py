"""What the update of a Kalman filter is made of, for people who look into a frame: innovation, gain, and limits."""

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.kalman import Innovation
from pftrack.model.part import Amount, Part, Residual
from pftrack.numerics.statistics import chi_square_limit

__all__ = ["innovation_parts"]


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
    limit = chi_square_limit(len(names))
    return (*parts, Amount("normalised innovation squared", innovation.normalised_squared, limit=limit))
