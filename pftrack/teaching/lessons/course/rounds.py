"""What lesson 5 computes: predictions and measurements, on a grid of positions and exactly.

The grid knows nothing of Gaussians: a prediction blurs its density, a measurement multiplies it by the likelihood. The
Kalman filter beside it does the same in two numbers.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Gaussian
from pftrack.filters import kalman
from pftrack.filters.dynamics import random_walk
from pftrack.teaching.lessons.course.densities import normal

PRIOR_VARIANCE = 9.0
MEASURED = (0.3, 1.9, 1.1, 2.8, 3.9, 3.0, 5.2, 4.6)
"""Positions in m; whoever measures more often meets them again backwards, as if the target turned round."""

GRID: Floats = np.arange(-80.0, 80.0, 0.1)
"""Positions, m: wide enough for sixty predictions, and fine enough for sixty measurements."""


class RecursionParameters(Parameters):
    """What is done, and how uncertain motion and measurements are."""

    # fmt: off
    rounds: int = parameter(
        4, "Rounds", "How often a prediction and then a measurement is made, at the beginning.", within=(0, 30, 1))
    predictions: int = parameter(
        0, "Predictions after them", "How many predictions follow in a row, without a measurement.", within=(0, 30, 1))
    measurements: int = parameter(
        0, "Measurements after those", "How many measurements follow in a row.", within=(0, 30, 1))
    motion: float = parameter(
        1, "Motion noise q", "Variance of how far the target moves in a step.", unit="m²", within=(0, 3, 0.1))
    noise: float = parameter(
        2, "Measurement noise r", "Variance of the error of a measurement.", unit="m²", within=(0.5, 9, 0.1))
    hidden: bool = parameter(
        False, "No measurement", "Whether the target is hidden, so that measuring brings nothing.")
    # fmt: on

    @property
    def steps(self) -> str:
        """What is done, one step after the other: `p` is a prediction, `m` a measurement."""
        return "pm" * self.rounds + "p" * self.predictions + "m" * self.measurements


@dataclass(frozen=True, slots=True)
class Moment:
    """What is known of the position after a step.

    Attributes:
        step: Its letter; empty before the first.
        measurement: What was measured in it, m.
        density: (n,) on the grid, 1/m.
        exact: The same by the Kalman filter.
    """

    step: str
    measurement: float | None
    density: Floats
    exact: Gaussian

    @property
    def variance(self) -> float:
        """The exact variance, m^2."""
        return float(self.exact.covariance[0, 0])


def moments(grid: Floats, parameters: RecursionParameters) -> Iterator[Moment]:
    """Yield what is known at first and after each step.

    Args:
        grid: (n,) positions in equal steps, m.
        parameters: What is done.
    """
    walk, noise = random_walk(1, math.sqrt(parameters.motion)), np.array([[parameters.noise]])
    exact = Gaussian(np.zeros(1), np.array([[PRIOR_VARIANCE]]))
    density, measured = normal(grid, 0.0, math.sqrt(PRIOR_VARIANCE)), 0
    yield Moment("", None, density, exact)
    for step in parameters.steps:
        measurement = None
        if step == "p":
            density, exact = _blur(grid, density, parameters.motion), kalman.predict(exact, walk)
        elif not parameters.hidden:
            measurement = _measurement(measured)
            measured += 1
            density = _weight(grid, density, normal(grid, measurement, math.sqrt(parameters.noise)))
            exact, _ = kalman.update(exact, np.array([measurement]), np.eye(1), noise)
        yield Moment(step, measurement, density, exact)


def _measurement(number: int) -> float:
    """Return a measurement by its number, m."""
    turn = 2 * (len(MEASURED) - 1)
    return MEASURED[min(number % turn, turn - number % turn)]


def _blur(grid: Floats, density: Floats, variance: float) -> Floats:
    """Return the density of the sum of a position and a normal step: their convolution, by Fourier transform."""
    frequencies = 2.0 * np.pi * np.fft.rfftfreq(len(grid), grid[1] - grid[0])
    transform = np.fft.rfft(density) * np.exp(-0.5 * variance * frequencies**2)
    # Where next to nothing is, rounding may leave a little less than nothing.
    return np.maximum(np.fft.irfft(transform, len(grid)), 0.0)


def _weight(grid: Floats, density: Floats, likelihood: Floats) -> Floats:
    """Return prior times likelihood, rescaled to unit area."""
    product = density * likelihood
    rescaled: Floats = product / (product.sum() * (grid[1] - grid[0]))
    return rescaled


def spread(grid: Floats, density: Floats) -> tuple[float, float]:
    """Return mean, m, and variance, m^2, of a density on a grid."""
    shares = density / density.sum()
    mean = float(shares @ grid)
    return mean, float(shares @ (grid - mean) ** 2)
