"""Densities that several lessons draw."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from pftrack.core.arrays import Floats
from pftrack.core.numerics.random import Generator


def ceiling(value: float) -> float:
    """Return the next of 1, 1.5, 2, 3, 5, 7 and their powers of ten that is no less than a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0) if value <= factor * power)


def normal(x: ArrayLike, mean: float, sd: float) -> Floats:
    """Return the density of N(mean, sd^2) at each x."""
    off = (np.asarray(x, dtype=np.float64) - mean) / sd
    return np.asarray(np.exp(-0.5 * off * off) / (math.sqrt(2.0 * math.pi) * sd))


@dataclass(frozen=True, slots=True)
class Mixture:
    """A sum of normal densities, each with its share.

    Attributes:
        shares: (n,), which add up to one.
        means: (n,).
        sds: (n,), standard deviations.
    """

    shares: tuple[float, ...]
    means: tuple[float, ...]
    sds: tuple[float, ...]

    @property
    def mean(self) -> float:
        """The mean of the whole."""
        return sum(share * mean for share, mean, _ in self._bumps)

    @property
    def variance(self) -> float:
        """The variance of the whole: the mean of the squares less the square of the mean."""
        return sum(share * (sd**2 + mean**2) for share, mean, sd in self._bumps) - self.mean**2

    def density(self, x: ArrayLike) -> Floats:
        """Return the density at each x."""
        return np.asarray(sum(share * normal(x, mean, sd) for share, mean, sd in self._bumps))

    def cumulative(self, x: ArrayLike) -> Floats:
        """Return the probability of being at most x, for each x."""
        at = np.asarray(x, dtype=np.float64)
        return np.asarray(sum(share * ndtr((at - mean) / sd) for share, mean, sd in self._bumps))

    def sample(self, rng: Generator, count: int) -> Floats:
        """Return (count,) draws: a uniform number chooses the bump of each, a normal one its place there."""
        chosen = np.searchsorted(np.cumsum(self.shares)[:-1], rng.random(count), side="right")
        drawn: Floats = np.take(self.means, chosen) + np.take(self.sds, chosen) * rng.standard_normal(count)
        return drawn

    @property
    def _bumps(self) -> tuple[tuple[float, float, float], ...]:
        return tuple(zip(self.shares, self.means, self.sds, strict=True))
