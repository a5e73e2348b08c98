"""Lesson 5: predict, correct, repeat; on a grid of positions and exactly.

The grid does not assume Gaussians: a prediction blurs its density, a measurement multiplies it by the likelihood. The
Kalman filter does the same with two numbers.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.matrices import solve_system
from pftrack.core.numerics.random import Gaussian
from pftrack.filters import kalman
from pftrack.filters.dynamics import random_walk
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOOK = look(__file__)
PRIOR_VARIANCE = 9.0
MEASURED = (0.3, 1.9, 1.1, 2.8, 3.9, 3.0, 5.2, 4.6)
"""Positions in m; more measurements meet them again backwards, as if the target turned round."""

GRID: Floats = np.arange(-80.0, 80.0, 0.1)
"""Positions, m: wide enough for sixty predictions, and fine enough for sixty measurements."""


class RecursionParameters(Parameters):
    """The steps, and the noises of motion and measurements."""

    rounds: int = parameter(4, "Rounds", within=(0, 30, 1))
    """Number of rounds, each a prediction and a measurement."""
    predictions: int = parameter(0, "Extra predictions", within=(0, 30, 1))
    """Number of predictions after the rounds, without a measurement."""
    measurements: int = parameter(0, "Extra measurements", within=(0, 30, 1))
    """Number of measurements after the extra predictions."""
    motion: float = parameter(1, "Motion noise q", unit="m²", within=(0, 3, 0.1))
    """Variance of the motion in a step."""
    noise: float = parameter(2, "Measurement noise r", unit="m²", within=(0.5, 9, 0.1))
    """Variance of the measurement error."""
    hidden: bool = parameter(False, "No measurement")
    """Whether the target is hidden, so a measurement is missing."""

    @property
    def steps(self) -> str:
        """The steps in order: `p` is a prediction, `m` a measurement."""
        return "pm" * self.rounds + "p" * self.predictions + "m" * self.measurements


@dataclass(frozen=True, slots=True)
class Moment:
    """The belief in the position after a step.

    Attributes:
        step: Its letter; empty before the first.
        measurement: Its measurement, m.
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
        parameters: The steps.
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
    # Where the density is almost 0, rounding may leave it slightly negative.
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


_CHECKED: Floats = np.arange(-40.0, 40.0, 0.05)
"""Positions on which the checks are made, m."""


def show(parameters: RecursionParameters, seed: int) -> Shown:
    """Show the density before and after the last step, and how the variance went up and down."""
    del seed
    past = list(moments(GRID, parameters))
    last = past[-1]
    mean, variance = spread(GRID, last.density)
    now = {"tolerance": 1e-4, "reveals": len(past) > 1}
    numbers = {
        "variance": {"value": variance, "exact": last.variance, **now},
        "mean": {"value": mean, "exact": float(last.exact.mean[0]), **now},
        "steady": {"value": _steady_variance(parameters)},
    }
    return LOOK.show((_density_panel(past, parameters.noise), _variance_panel(past)), numbers)


def _steady_variance(parameters: RecursionParameters) -> float:
    """Return the variance after a measurement that the next round comes back to."""
    motion, noise = parameters.motion, parameters.noise
    return 0.5 * (math.sqrt(motion**2 + 4.0 * motion * noise) - motion)


def _density_panel(past: list[Moment], noise: float) -> Panel:
    last, seen, after = past[-1], np.abs(GRID) <= 12.0, len(past) > 1
    places, exact = GRID[seen], normal(GRID, float(last.exact.mean[0]), math.sqrt(last.variance))[seen]
    curves = {"exact": exact, "grid": last.density[seen]}
    name, known = "", "The prior: the target is about 0 m, with a variance of 9 m²."
    if after:
        before = past[-2]
        name = "predicted" if before.step == "p" else "known" if before.step else "prior"
        curves["before"] = before.density[seen]
        known = f"Before the last step: mean {before.exact.mean[0]:.2f} m, variance {before.variance:.2f} m². The last "
        known += "step is a prediction." if last.step == "p" else "step brings no measurement."
    if last.measurement is not None:
        curves["likelihood"] = normal(places, last.measurement, math.sqrt(noise))
        known = known.replace("brings no measurement", f"is a measurement of {last.measurement:g} m")
    highest = max(float(np.max(curve)) for trace, curve in curves.items() if trace != "grid")
    return LOOK.draw(
        "density",
        {
            trace: {"x": places, "y": curve, "reveals": after and trace in {"exact", "grid"}}
            for trace, curve in curves.items()
        },
        y=(0.0, ceiling(1.05 * highest)),
        before=name,
        measured=last.measurement or 0.0,
        when="after" if after else "prior",
        known=known,
    )


def _variance_panel(past: list[Moment]) -> Panel:
    variances = np.array([moment.variance for moment in past])
    on_grid = np.array([spread(GRID, moment.density)[1] for moment in past])
    steps, last = np.arange(len(past)), max(len(past) - 1, 1)
    traces: dict[str, Any] = {
        "exact": (steps[:last], variances[:last]),
        "grid": (steps[:last], on_grid[:last]),
        "last exact": (steps[last - 1 :], variances[last - 1 :]),
        "last grid": (steps[last - 1 :], on_grid[last - 1 :]),
    }
    for name, chosen in (
        ("predicted", [moment.step == "p" for moment in past]),
        ("measured", [moment.measurement is not None for moment in past]),
    ):
        at = steps[np.array(chosen)]
        known, newest = at[at < last], at[at == last]
        if len(known):
            traces[name] = known, on_grid[known]
        if len(newest):
            traces[f"{'last' if len(known) else 'first'} {name}"] = newest, on_grid[newest]
    recent = ", ".join(f"{variance:.2f}" for variance in variances[:last][-6:])
    up = 0.0, ceiling(1.05 * float(variances.max()))
    return LOOK.draw("variance", traces, x=(0.0, max(10.0, float(last))), y=up, recent=recent)


def _answer(parameters: RecursionParameters, seed: int) -> Answer:
    del seed
    *_, before, after = moments(GRID, parameters)
    words = f"1/{before.variance:.3g} + 1/{parameters.noise:g} is 1/{after.variance:.3g}."
    return Answer(after.variance, spread(GRID, after.density)[1], words)


def _reference() -> list[Moment]:
    """Return the eight rounds that the lesson shows."""
    return list(moments(_CHECKED, RecursionParameters(rounds=len(MEASURED))))


def _added_information() -> Outcome:
    past = _reference()
    variances = [spread(_CHECKED, moment.density)[1] for moment in past]
    rises = [variances[number] - variances[number - 1] for number in range(1, len(past)) if past[number].step == "p"]
    return Outcome(max(rises, key=lambda rise: abs(rise - 1.0)), 1.0, 1e-4)


def _densities() -> Outcome:
    apart = [
        np.abs(it.density - normal(_CHECKED, float(it.exact.mean[0]), math.sqrt(it.variance))).max()
        for it in _reference()
    ]
    return Outcome(float(max(apart)), 0.0, 1e-6)


def _moments() -> Outcome:
    apart = [np.subtract(spread(_CHECKED, it.density), (it.exact.mean[0], it.variance)) for it in _reference()]
    return Outcome(float(np.abs(apart).max()), 0.0, 1e-6)


def _sequential() -> float:
    return float(_reference()[-1].exact.mean[0])


def _batch() -> float:
    """Return the mean of the last position given all measurements at once, from their joint Gaussian."""
    rounds = np.arange(1, len(MEASURED) + 1)
    covariance = PRIOR_VARIANCE + np.minimum.outer(rounds, rounds) + 2.0 * np.eye(len(rounds))
    return float((PRIOR_VARIANCE + rounds) @ solve_system(covariance, np.array(MEASURED)))


COMPUTED = Computed(
    _answer,
    {
        "predict-adds": _added_information,
        "grid-densities": _densities,
        "grid-moments": _moments,
        "one-by-one": lambda: Outcome(_sequential(), _batch(), 1e-9),
        "reference": lambda: Outcome(_sequential(), 4.34281, 5e-6),
    },
    Demonstration(RecursionParameters(), show),
)
