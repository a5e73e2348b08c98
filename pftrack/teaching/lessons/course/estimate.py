"""Lesson 4: choosing one position from a whole density."""

import math

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.teaching.lessons.course.probability import Mixture
from pftrack.teaching.lessons.figure import Panel, Shown, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOW, HIGH = -3.0, 9.0
"""Positions of guesses, m."""

GRID: Floats = np.linspace(-6.0, 14.0, 1001)
"""Positions that are summed over, m: all of the density at every setting of the sliders."""

HIT = 0.15
"""A guess within this distance is almost exactly right, m."""

BEST = "mean", "median", "hits"
"""The best guess for each of the three losses, as in the panels."""
LOOK = look(__file__)


class EstimateParameters(Parameters):
    """A guess, and the second bump of the density."""

    guess: float = parameter(3, "Guess", unit="m", within=(LOW, HIGH, 0.05))
    """The position that you name."""
    weight: float = parameter(0.3, "Weight of the second bump", within=(0, 1, 0.05))
    """Probability that the target is at the second bump."""
    second: float = parameter(4, "Position of the second bump", unit="m", within=(0, 6, 0.1))
    """Centre of the second bump."""


def posterior(weight: float = 0.3, second: float = 4.0) -> Mixture:
    """Return what is known of the position: a narrow bump at 0 m and a wide one."""
    return Mixture((1.0 - weight, weight), (0.0, second), (0.6, 1.0))


def expected_losses(density: Mixture, guesses: Floats) -> Floats:
    """Return what guesses (n,) cost on average, summed over the grid.

    Returns:
        (3, n): the squared error, m^2; the absolute error, m; the share of misses by more than `HIT`.
    """
    step = GRID[1] - GRID[0]
    shares = density.density(GRID) * step
    off = GRID - guesses[:, None]
    below = np.cumsum(shares) - 0.5 * shares
    low, high = np.interp([guesses - HIT, guesses + HIT], GRID, below)
    return np.stack([(off * off) @ shares, np.abs(off) @ shares, 1.0 - (high - low)])


def exact_losses(density: Mixture, guess: float) -> tuple[float, float, float]:
    """Return the same for one guess by formulas."""
    squared = density.variance + (guess - density.mean) ** 2
    absolute = 0.0
    for share, mean, sd in zip(density.shares, density.means, density.sds, strict=True):
        off = (guess - mean) / sd
        peak = math.exp(-0.5 * off * off) * math.sqrt(2.0 / math.pi)
        absolute += share * sd * (peak + off * math.erf(off / math.sqrt(2.0)))
    low, high = density.cumulative([guess - HIT, guess + HIT])
    return squared, absolute, float(1.0 - (high - low))


def median(density: Mixture) -> float:
    """Return the position with half of the probability on either side, m, by halving an interval."""
    low, high = float(GRID[0]), float(GRID[-1])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(density.cumulative(middle)) < 0.5 else (low, middle)
    return 0.5 * (low + high)


def show(parameters: EstimateParameters, seed: int) -> Shown:
    """Show the density with the guess, and below what each guess costs."""
    del seed
    density, guess = posterior(parameters.weight, parameters.second), parameters.guess
    guesses = np.linspace(LOW, HIGH, 121)
    losses = expected_losses(density, guesses)
    squared, absolute, missed = expected_losses(density, np.array([guess]))[:, 0].tolist()
    exact_squared, exact_absolute, exact_missed = exact_losses(density, guess)
    numbers = {
        "squared": (squared, exact_squared, 1e-4),
        "absolute": (absolute, exact_absolute, 1e-4),
        "missed": (missed, exact_missed, 1e-4),
        "excess": (squared - density.variance, (guess - density.mean) ** 2, 1e-4),
    }
    best = density.mean, median(density), float(guesses[losses[2].argmin()])
    panels = _density_panel(density, parameters, best), _loss_panel(parameters, guesses, losses, best)
    return LOOK.show(panels, numbers)


def _density_panel(density: Mixture, parameters: EstimateParameters, best: tuple[float, ...]) -> Panel:
    places = np.linspace(LOW, HIGH, 241)
    curve = density.density(places)
    (first, second), (_, place) = density.shares, density.means
    return LOOK.draw(
        "density",
        {"density": (places, curve), **{name: (at,) for name, at in zip(BEST, best, strict=True)}},
        turned=parameters,
        x=(LOW, HIGH),
        y=(0.0, 0.1 * math.ceil(11.0 * float(curve.max()))),
        first=first,
        second=second,
        place=place,
        guess=parameters.guess,
    )


def _loss_panel(parameters: EstimateParameters, guesses: Floats, losses: Floats, best: tuple[float, ...]) -> Panel:
    above = losses - losses.min(axis=1, keepdims=True)
    # Three metres off is the top of the panel, else the curves would be flat where their lowest points are.
    off = int(np.abs(guesses - best[0] - 3.0).argmin())
    heights = above / np.array([[above[0, off]], [above[1, off]], [above[2].max()]])
    curves = {name: (guesses, height) for name, height in zip(BEST, heights, strict=True)}
    minima = {f"best {name}": ([at], [0.0]) for name, at in zip(BEST, best, strict=True)}
    return LOOK.draw("losses", {**curves, **minima}, turned=parameters, x=(LOW, HIGH))


def _answer(parameters: EstimateParameters, seed: int) -> Answer:
    del seed
    density = posterior(parameters.weight, parameters.second)
    (first, second), (_, place) = density.shares, density.means
    return Answer(density.mean, words=f"The mean is {first:.2g} × 0 m + {second:.2g} × {place:g} m.")


def _best(loss: int) -> float:
    """Return the guess in steps of 0.01 m that costs least on average, by one of the three losses."""
    guesses = np.linspace(-1.0, 3.0, 401)
    return float(guesses[expected_losses(posterior(), guesses)[loss].argmin()])


def _square_at(guess: float) -> float:
    return float(expected_losses(posterior(), np.array([guess]))[0, 0])


COMPUTED = Computed(
    _answer,
    {
        "best-squared": lambda: Outcome(_best(0), 1.2, 0.006),
        "least-squared": lambda: Outcome(_square_at(1.2), 3.912, 1e-4),
        "excess": lambda: Outcome(_square_at(3.0) - _square_at(1.2), 3.24, 1e-9),
        "best-absolute": lambda: Outcome(_best(1), median(posterior()), 0.006),
        "best-hit": lambda: Outcome(_best(2), 0.0, 0.02),
    },
    Demonstration(EstimateParameters(), show),
)
