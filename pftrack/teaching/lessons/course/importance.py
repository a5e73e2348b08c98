"""Lesson 8: weighted draws from one density represent another one.

Wanted is p = N(1, 0.5^2), sampled is q = N(c, s^2). Both are Gaussian, so the moments of the weight p/q under q, the
integrals of p^k / q^(k - 1), have closed forms. They give the number of effective draws and the error of an average.
"""

import math
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

MEAN, SD = 1.0, 0.5
"""Mean and standard deviation of the wanted density."""
LOOK = look(__file__)
LOW, HIGH = -4.0, 5.0
AXIS: Floats = np.linspace(LOW, HIGH, 361)
EDGES: Floats = np.linspace(LOW, HIGH, 46)
MOST_DRAWS, MOST_STEMS = 5000, 400
"""Largest number of draws, and number of shown ones: a screen has no room for more."""
FEW = 10
"""Effective draws below which no tolerance of their number is given."""
ROUNDING = 1e-9
"""Tolerance of a number without randomness."""
REPEATS, MANY = 200, 2000
"""Repetitions of the checks, and draws of each."""
CHOICES = 0.3, 0.5, 1.0, 2.0
"""Spreads that the question offers."""


class ImportanceParameters(Parameters):
    """The density that is sampled, and how often."""

    spread: float = parameter(1, "Spread s", within=(0.2, 4, 0.05))
    """Standard deviation of the proposal q; that of p is 0.5."""
    centre: float = parameter(0, "Centre c", within=(-3, 4, 0.05))
    """Mean of the proposal q; that of p is 1."""
    draws: int = parameter(200, "Draws N", within=(10, MOST_DRAWS, 10))
    """Number of draws."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """N(centre, spread^2), which is sampled in the place of p."""

    centre: float
    spread: float

    def draw(self, rng: Stream, count: int) -> ParticleSet:
        """Return (count, 1) draws with weights in proportion to p/q."""
        # The first of the largest number of draws, so they are the same for every count.
        drawn = self.centre + self.spread * rng.standard_normal((MOST_DRAWS, 1))[:count]
        return ParticleSet(drawn, normalise(self.log_ratio(drawn[:, 0]))[0], np.arange(count))

    def log_ratio(self, x: Floats) -> Floats:
        """Return log p/q at each x, up to a constant."""
        return np.asarray(0.5 * np.square((x - self.centre) / self.spread) - 0.5 * np.square((x - MEAN) / SD))

    def moment(self, order: int) -> float:
        """Return E_q[(p/q)^order], which is infinite where q is too narrow."""
        ours, its = SD**-2, self.spread**-2
        left = order * ours - (order - 1) * its
        if left <= 0.0:
            return math.inf
        apart = order * (order - 1) * ours * its * (MEAN - self.centre) ** 2 / (2.0 * left)
        if apart > 700.0:
            return math.inf
        return math.sqrt(ours**order / its ** (order - 1) / left) * math.exp(apart)

    @property
    def share(self) -> float:
        """The effective share of many draws, 1 / integral of p^2/q; 0 where that is infinite."""
        return 1.0 / self.moment(2)

    def share_sd(self, count: int) -> float | None:
        """Return the standard deviation of the share of `count` draws; None where it is infinite or too large.

        The share is the squared mean weight over the mean squared weight; both are linearised.
        """
        square, third, fourth = (self.moment(order) for order in (2, 3, 4))
        if not math.isfinite(fourth) or count * self.share < FEW:
            return None
        variance = 4.0 * (square - 1.0) - 4.0 * (third - square) / square + (fourth - square**2) / square**2
        sd = math.sqrt(max(variance, 0.0) / count) / square
        return sd if 3.0 * sd < self.share else None

    def mean_sd(self, count: int) -> float | None:
        """Return the standard deviation of the weighted mean of many draws; None where it is infinite."""
        left = 2.0 * SD**-2 - self.spread**-2
        if left <= 0.0 or count * self.share < FEW:
            return None
        middle = (2.0 * MEAN * SD**-2 - self.centre * self.spread**-2) / left
        return math.sqrt(self.moment(2) * (1.0 / left + (middle - MEAN) ** 2) / count)


def show(parameters: ImportanceParameters, seed: int) -> Shown:
    """Draw from q, weigh by p/q, and compare with p."""
    proposal = Proposal(parameters.centre, parameters.spread)
    count = parameters.draws
    cloud = proposal.draw(Stream(seed, 0, Purpose.TRACK), count)
    size = cloud.effective_sample_size
    mean = float(cloud.weights @ cloud.states[:, 0])
    share_sd, mean_sd = proposal.share_sd(count), proposal.mean_sd(count)
    numbers = {
        "share": (size / count, proposal.share, None if share_sd is None else 3.0 * share_sd + ROUNDING),
        "mean": (mean, MEAN, None if mean_sd is None else 3.0 * mean_sd),
    }
    panels = (_densities(cloud, parameters, mean), _weights(cloud, proposal), _sizes(cloud, proposal))
    return LOOK.show(panels, numbers)


def _densities(cloud: ParticleSet, parameters: ImportanceParameters, mean: float) -> Panel:
    heights = np.histogram(cloud.states[:, 0], EDGES, weights=cloud.weights)[0] / np.diff(EDGES)
    wanted, sampled = normal(AXIS, MEAN, SD), normal(AXIS, parameters.centre, parameters.spread)
    return LOOK.draw(
        "densities",
        {"wanted": (AXIS, wanted), "sampled": (AXIS, sampled), "draws": (EDGES, heights), "mean": (mean,)},
        turned=parameters,
        x=(LOW, HIGH),
        y=(0.0, ceiling(max(heights.max(), wanted.max(), min(sampled.max(), 1.2)))),
        mean=mean,
        wanted=MEAN,
    )


def _weights(cloud: ParticleSet, proposal: Proposal) -> Panel:
    # Where there are too many, the heaviest and the first of them.
    heaviest = np.argsort(-cloud.weights, kind="stable")[: MOST_STEMS // 2]
    shown = (
        np.union1d(heaviest, np.arange(min(len(cloud), MOST_STEMS // 2))) if len(cloud) > MOST_STEMS else slice(None)
    )
    here, weights = cloud.states[shown, 0], (len(cloud) * cloud.weights)[shown]
    top = ceiling(max(float(weights.max()), 1.0))
    # Scaled as the weights are, which add up to the number of draws.
    logs = (
        proposal.log_ratio(AXIS)
        - proposal.log_ratio(cloud.states[heaviest[:1], 0])
        + math.log(len(cloud) * cloud.weights[heaviest[0]])
    )
    ratio = np.exp(np.minimum(logs, math.log(2.0 * top)))
    return LOOK.draw(
        "weights",
        {"ratio": (AXIS, np.where(ratio <= top, ratio, np.nan)), "draws": (here, weights)},
        x=(LOW, HIGH),
        y=(0.0, top),
        count=len(cloud),
        heaviest=100 * float(cloud.weights.max()),
    )


def _sizes(cloud: ParticleSet, proposal: Proposal) -> Panel:
    count, size = len(cloud), cloud.effective_sample_size
    traces = {"size": (np.array([size]),), "expected": (count * proposal.share,)}
    return LOOK.draw("size", traces, y=(0.0, float(count)), count=count, size=size)


def _answer(parameters: ImportanceParameters, seed: int) -> Answer:
    shares = {f"{spread:g}": Proposal(parameters.centre, spread).share for spread in CHOICES}
    said = ", ".join(f"{100 * share:.2g} % at s = {spread}" for spread, share in shares.items())
    sizes = (
        Proposal(parameters.centre, spread).draw(Stream(seed, 0, Purpose.TRACK), parameters.draws).effective_sample_size
        for spread in CHOICES
    )
    ours = ", ".join(f"{size:.0f}" for size in sizes)
    words = f"The effective share is {said}; of the {parameters.draws} draws of this seed, {ours} are effective."
    return Answer(max(shares, key=lambda spread: shares[spread]), words=words)


def _repeat(spread: float) -> tuple[Floats, Floats]:
    """Return effective shares and weighted means (REPEATS,) of draws from N(0, spread^2)."""
    proposal = Proposal(0.0, spread)
    clouds = [proposal.draw(Stream(1, repeat, Purpose.TRACK), MANY) for repeat in range(REPEATS)]
    shares = np.array([cloud.effective_sample_size for cloud in clouds]) / MANY
    return shares, np.array([cloud.weights @ cloud.states[:, 0] for cloud in clouds])


def _share(spread: float, exact: float) -> Outcome:
    return Outcome(float(_repeat(spread)[0].mean()), exact, 0.02 * exact)


def _mean() -> Outcome:
    return Outcome(float(_repeat(1.0)[1].mean()), MEAN, 0.004)


def _narrow_share() -> Outcome:
    return Outcome(float(np.median(_repeat(0.3)[0])), 0.0, 0.02)


def _narrow_error() -> Outcome:
    wide, narrow = (np.sqrt(np.square(_repeat(spread)[1] - MEAN).mean()) for spread in (1.0, 0.3))
    return Outcome(float(wide / narrow), 0.0, 0.1)


COMPUTED = Computed(
    _answer,
    {
        "share-at-1": lambda: _share(1.0, 0.3735),
        "share-at-2": lambda: _share(2.0, 0.3059),
        "mean": _mean,
        "narrow-share": _narrow_share,
        "narrow-error": _narrow_error,
    },
    Demonstration(ImportanceParameters(), show, random=True),
)
