"""Switching: how many particles each sampler should provide, judged by the last posterior.

While the target is in view the posterior is narrow and the prediction can be trusted. When it widens, whether because
the target is hidden or because the dynamics are wrong, the observation should have more say. The switching particle
filters of Bando 2007 compare the posterior standard deviation with thresholds; they differ in how hard the switch is.
Both rules return the number of particles for the observation sampler of `auxiliary.step`.
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled

__all__ = ["exceeds", "hard", "soft"]


@compiled
def exceeds(sigma: Floats, gamma: float) -> bool:
    """Tell whether any posterior standard deviation (d,) exceeds the threshold gamma, in the same unit."""
    for deviation in sigma:  # noqa: SIM110 - `any` of a generator cannot be compiled
        if deviation > gamma:
            return True
    return False


@compiled
def hard(sigma: Floats, gamma: float, count: int) -> int:
    """All particles from the observation sampler if any sigma exceeds gamma, else none.

    This is the rule of the h-SPF (Bando 2007, ch. 3 section 2.1).

    Args:
        sigma: (d,) posterior standard deviations of the last frame.
        gamma: Threshold, in the unit of sigma; Bando uses the target's radius.
        count: N.
    """
    return count if exceeds(sigma, gamma) else 0


@compiled
def soft(sigma: Floats, gamma_min: float, gamma_max: float, count: int) -> int:
    """A share that rises linearly from none at gamma_min to all at gamma_max (s-SPF; Bando 2007, eqs. 3.6 and 3.7).

    The largest sigma decides; the number is rounded to the nearest, halves to even.

    Args:
        sigma: (d,) posterior standard deviations of the last frame.
        gamma_min: Below this none are drawn by observation.
        gamma_max: Above this all are; not less than gamma_min. If both are equal, the switch is hard.
        count: N.

    Raises:
        ValueError: There is no sigma, or one is NaN.
    """
    widest = 0.0
    for axis in range(sigma.shape[0]):
        widest = max(widest, sigma[axis])
        if np.isnan(sigma[axis]):
            widest = np.nan
            break
    if sigma.shape[0] == 0 or np.isnan(widest):
        raise ValueError("expected posterior standard deviations (d,), got none or NaN")
    if gamma_max <= gamma_min:
        return count if widest > gamma_max else 0
    return int(np.rint(count * min(max((widest - gamma_min) / (gamma_max - gamma_min), 0.0), 1.0)))
