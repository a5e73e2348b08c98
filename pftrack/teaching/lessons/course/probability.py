"""Lesson 1: a position has a density, and the area under it is a probability."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Generator, Purpose, Stream
from pftrack.teaching.lessons.figure import Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome


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


LOOK = look(__file__)
LOW, HIGH = -5.0, 5.0
PLACES: Floats = np.linspace(LOW, HIGH, 401)
MOST = 20_000
"""Draws: all are made for every N, so the first ones stay when N grows."""


class ProbabilityParameters(Parameters):
    """Draws, bins, an interval, and a bump that can be squeezed."""

    count: int = parameter(500, "Draws N", within=(10, MOST, 10))
    """Number of drawn positions."""
    bin_width: float = parameter(0.25, "Bin width", unit="m", within=(0.05, 2, 0.05))
    """Width of the bars of the histogram."""
    low: float = parameter(-1, "From a", unit="m", within=(LOW, HIGH, 0.1))
    """Start of the interval."""
    high: float = parameter(1, "To b", unit="m", within=(LOW, HIGH, 0.1))
    """End of the interval."""
    squeeze: float = parameter(0.5, "Width of the left bump", unit="m", within=(0.1, 1, 0.05))
    """Standard deviation of the left bump."""


def two_bumps(left_sd: float = 0.5) -> Mixture:
    """Return the density of the lesson, in metres."""
    return Mixture((0.6, 0.4), (-1.5, 1.0), (left_sd, 1.0))


def draws(density: Mixture, seed: int, count: int) -> Floats:
    """Return the first (count,) positions of a seed, in metres."""
    return density.sample(Stream(seed, 0, Purpose.SCENE), MOST)[:count]


def histogram(drawn: Floats, bin_width: float) -> tuple[Floats, Floats]:
    """Return edges (n + 1,) at multiples of the bin width around all draws, and heights (n,): an estimated density."""
    first, last = math.floor(drawn.min() / bin_width), math.floor(drawn.max() / bin_width) + 1
    bins = np.floor(drawn / bin_width).astype(np.int64) - first
    counts = np.bincount(bins, minlength=last - first)
    return np.arange(first, last + 1) * bin_width, counts / (len(drawn) * bin_width)


def probability(density: Mixture, low: float, high: float) -> float:
    """Return the exact area over an interval."""
    below_low, below_high = density.cumulative([low, high])
    return float(below_high - below_low)


def counting_tolerance(exact: float, count: int) -> float:
    """Return the tolerance of a counted share: 3.3 standard deviations, which one draw in a thousand exceeds.

    One more draw in the interval always may be.
    """
    return 3.3 * math.sqrt(exact * (1.0 - exact) / count) + 1.0 / count


def show(parameters: ProbabilityParameters, seed: int) -> Shown:
    """Draw positions, and compare their share in the interval with the area under the density."""
    density, count = two_bumps(parameters.squeeze), parameters.count
    low, high = sorted((parameters.low, parameters.high))
    drawn = draws(density, seed, count)
    edges, heights = histogram(drawn, parameters.bin_width)
    exact = probability(density, low, high)
    share = float(np.mean((low < drawn) & (drawn <= high)))
    area = float(heights @ np.diff(edges))
    curve = density.density(PLACES)
    numbers = {
        "share": (share, exact, counting_tolerance(exact, count)),
        "area": (area, 1.0, 1e-9),
        "highest": (float(curve.max()),),
    }
    top = ceiling(max(0.5, curve.max(), np.sort(heights)[-2:].mean()) * 1.02)
    panel = LOOK.draw(
        "density",
        {
            **({"one": (1.0,)} if top > 1.0 else {}),
            "density": {"x": PLACES, "y": curve, "area": (low, high)},
            "draws": (edges, heights),
        },
        turned=parameters,
        x=(LOW, HIGH),
        y=(0.0, top),
        squeeze=parameters.squeeze,
        highest=curve.max(),
        count=count,
        low=low,
        high=high,
    )
    return LOOK.show([panel], numbers)


def _answer(parameters: ProbabilityParameters, seed: int) -> Answer:
    density = two_bumps(parameters.squeeze)
    low, high = sorted((parameters.low, parameters.high))
    drawn = draws(density, seed, parameters.count)
    inside = int(np.sum((low < drawn) & (drawn <= high)))
    words = f"Of the {parameters.count} draws, {inside} lie there: {inside / parameters.count:.3f} of them."
    return Answer(probability(density, low, high), inside / parameters.count, words)


def _reference() -> Floats:
    return draws(two_bumps(), 1, MOST)


def _area() -> Outcome:
    edges, heights = histogram(_reference(), 0.25)
    return Outcome(float(heights @ np.diff(edges)), 1.0, 1e-9)


def _count() -> Outcome:
    drawn = _reference()
    return Outcome(float(np.mean((drawn > -1.0) & (drawn <= 1.0))), probability(two_bumps(), -1.0, 1.0), 0.0106)


def _distribution() -> Outcome:
    below = two_bumps().cumulative(np.sort(_reference()))
    steps = np.arange(MOST + 1) / MOST
    furthest = max(np.abs(steps[1:] - below).max(), np.abs(steps[:-1] - below).max())
    return Outcome(float(furthest), 0.0, 1.63 / math.sqrt(MOST))


def _peak() -> Outcome:
    return Outcome(float(normal(0.0, 0.0, 0.2)), 1.9947, 5e-5)


COMPUTED = Computed(
    _answer,
    {
        "histogram-area": _area,
        "counting": _count,
        "distribution": _distribution,
        "peak": _peak,
    },
    Demonstration(ProbabilityParameters(), show, random=True),
)
