"""Search: the maximum of a function of a few positive numbers.

Noises and sharpnesses are scales: what matters is the factor between two of them, so the search goes over logarithms.
One number is found by golden section with parabolas (Brent 1973, ch. 5), several by the simplex of Nelder and Mead
(1965). Both need only values, which suits particle filters: with the same random numbers in all trials their evidence
is a function of the settings, but one with small steps, where resampling picks another particle. If the model is linear
with Gaussian noise, expectation maximisation finds the numbers without a search.
"""

import contextlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy

from pftrack.core.arrays import Floats
from pftrack.core.model.model import LinearChain, NoiseScale
from pftrack.filters.learning.online_em import fit_noise

# it loads its parts when they are asked for: scipy.optimize takes half a second


Objective: TypeAlias = Callable[[tuple[float, ...]], float]

Loss: TypeAlias = Callable[[Floats], float]

FACTOR = 2.0
"""Factor of each number in the first simplex."""
TOLERANCE = 0.02
"""Difference of a number's logarithm below which two values are equal."""


def maximise(
    objective: Objective, begin: Sequence[float], bounds: Sequence[tuple[float, float]], *, evaluations: int
) -> tuple[tuple[float, ...], float]:
    """Return the best place that was found, and the value there, which is at least that of the beginning.

    Args:
        objective: The function; it is asked at each place once.
        begin: First values: positive numbers, within their bounds.
        bounds: Least and largest value of each number, positive.
        evaluations: Largest number of evaluations.

    Raises:
        ValueError: A number or bound is not positive, or there are none.
    """
    if not begin or any(it <= 0 for it in begin) or any(low <= 0 or high <= low for low, high in bounds):
        raise ValueError(f"numbers and bounds must be positive, got {tuple(begin)} in {tuple(bounds)}")
    asked: dict[tuple[float, ...], float] = {}
    limits = np.log(np.asarray(bounds, dtype=np.float64))

    def ask(logarithms: Floats) -> float:
        inside = np.clip(np.atleast_1d(logarithms), limits[:, 0], limits[:, 1])
        place = tuple(
            min(max(math.exp(it), low), high) for it, (low, high) in zip(inside.tolist(), bounds, strict=True)
        )
        if place not in asked:
            if len(asked) >= evaluations:
                raise _SpentError
            asked[place] = objective(place)
        return -asked[place]

    start = tuple(float(it) for it in begin)
    asked[start] = objective(start)
    with contextlib.suppress(_SpentError):
        _descend(ask, np.log(np.asarray(start)), limits)
    best = max(asked, key=lambda place: (asked[place], place == start))
    return best, asked[best]


class _SpentError(Exception):
    """The objective has been evaluated as often as allowed."""


def _descend(ask: Loss, start: Floats, limits: Floats) -> None:
    if len(start) == 1:
        # From all of a wide range golden section may miss a narrow peak: the neighbourhood first.
        near = np.clip([start[0] - math.log(10.0), start[0] + math.log(10.0)], *limits[0])
        found = _section(ask, near)
        at_edge = min(abs(found - near)) < 2 * TOLERANCE
        if at_edge and not np.isclose(found, limits[0]).any():
            _section(ask, limits[0])
        return
    step = math.log(FACTOR)
    up = np.where(start + step <= limits[:, 1], step, -step)
    simplex = np.vstack([start, start + np.diag(up)])
    options = {"initial_simplex": simplex, "xatol": TOLERANCE, "fatol": 1e-4, "adaptive": len(start) > 2}
    scipy.optimize.minimize(ask, start, method="Nelder-Mead", bounds=limits, options=options)


def _section(ask: Loss, between: Floats) -> float:
    found = scipy.optimize.minimize_scalar(ask, bounds=tuple(between), method="bounded", options={"xatol": TOLERANCE})
    return float(found.x)


@dataclass(frozen=True, slots=True, eq=False)
class LinearHalf:
    """The half of a run that numbers are fitted to, as a linear model.

    Attributes:
        chains: The model, with the values to begin with.
        scales: Noise that each number scales.
    """

    chains: tuple[LinearChain, ...]
    scales: tuple[NoiseScale, ...]


def maximise_linear(
    half: LinearHalf, begin: Sequence[float], bounds: Sequence[tuple[float, float]]
) -> tuple[tuple[float, ...], int]:
    """Return the values under which the half is most probable, and the number of steps.

    Args:
        half: The observations.
        begin: The values with which its chains were made, positive.
        bounds: Least and largest value of each number.
    """
    numbers = tuple(zip(half.scales, begin, bounds, strict=True))
    reach = {scale.kind: (scale.factor(value, low), scale.factor(value, high)) for scale, value, (low, high) in numbers}
    found = fit_noise(half.chains, reach)
    values = (scale.scale(value, found.factors[scale.kind]) for scale, value, _ in numbers)
    inside = (min(max(value, low), high) for value, (low, high) in zip(values, bounds, strict=True))
    return tuple(inside), found.steps
