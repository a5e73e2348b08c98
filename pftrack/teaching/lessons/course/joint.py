"""Lesson 2: two uncertain quantities at once, and what one reveals about the other."""

import math

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOOK = look(__file__)
EDGE = 3.5
CELLS: Floats = np.linspace(-EDGE, EDGE, 57)
"""Middles of the cells of the map."""
PLACES: Floats = np.linspace(-EDGE, EDGE, 281)
STEP = 0.05
GRID: Floats = np.linspace(-10.0, 10.0, 401)
"""Range on which sums replace integrals: nearly all of the density lies within it."""
READ_AT = 1.0
"""The x whose conditional density is read along z."""


class JointParameters(Parameters):
    """The correlation of position and measurement, and the measurement."""

    correlation: float = parameter(0.8, "Correlation r", within=(-0.95, 0.95, 0.05))
    """Correlation of x and z: 0 is none, 1 a straight line."""
    measured: float = parameter(1.2, "Cut at z", within=(-3, 3, 0.1))
    """The measured value of z, where the density is cut."""


def joint(x: Floats, z: Floats, correlation: float) -> Floats:
    """Return the density of two normal quantities of mean 0 and variance 1 at x and z, which are broadcast."""
    rest = 1.0 - correlation**2
    powers = np.square(x) - 2.0 * correlation * x * z + np.square(z)
    return np.asarray(np.exp(-0.5 * powers / rest) / (2.0 * math.pi * math.sqrt(rest)))


def conditional(x: Floats, measured: float, correlation: float) -> Floats:
    """Return p(x | z) at each x: the cut of the joint density at z, divided by its area."""
    area = STEP * joint(GRID, np.array(measured), correlation).sum()
    return np.asarray(joint(x, np.array(measured), correlation) / area)


def moments(measured: float, correlation: float) -> tuple[float, float]:
    """Return mean and variance of the rescaled cut, by sums over the grid."""
    weights = STEP * conditional(GRID, measured, correlation)
    mean = float(weights @ GRID)
    return mean, float(weights @ np.square(GRID - mean))


def show(parameters: JointParameters, seed: int) -> Shown:
    """Cut the joint density at z, and rescale the cut."""
    del seed
    r, z = parameters.correlation, parameters.measured
    mean, variance = moments(z, r)
    numbers = {"mean": (mean, r * z, 1e-5), "variance": (variance, 1.0 - r**2, 1e-5)}
    all_of_it, marginal = (-EDGE, EDGE), normal(PLACES, 0.0, 1.0)
    up = 0.0, ceiling(max(0.7, float(normal(0.0, 0.0, math.sqrt(1.0 - r * r)))))  # the rescaled cut has room
    cut = {"x": PLACES, "y": conditional(PLACES, z, r), "area": all_of_it}
    backwards = joint(np.array(READ_AT), PLACES, r) / marginal
    here = float(np.interp(z, PLACES, backwards))
    both = {"joint": (CELLS, CELLS, joint(CELLS, CELLS[:, None], r))}
    panels = (
        LOOK.draw("profile", {"before": (PLACES, marginal), "after": cut}, x=all_of_it, y=up, z=z),
        LOOK.draw("backwards", {"curve": (PLACES, backwards), "here": ([z], [here])}, x=all_of_it, y=up, here=here),
        LOOK.draw("map", both, turned=parameters, x=all_of_it, y=all_of_it, leaning=_leaning(r), z=z),
        LOOK.draw("margin", {"marginal": (marginal, PLACES), "cut": (z,)}, y=all_of_it, z=z),
    )
    return LOOK.show(panels, numbers)


def _leaning(r: float) -> str:
    if r == 0:
        return "equally wide in both directions: x and z are independent"
    return f"stretched along a line that {'rises' if r > 0 else 'falls'}"


def _answer(parameters: JointParameters, seed: int) -> Answer:
    del seed
    mean, variance = moments(parameters.measured, parameters.correlation)
    words = f"The rescaled cut has mean {mean:.3g} and variance {variance:.3g}."
    return Answer(parameters.correlation * parameters.measured, mean, words)


def _volume() -> Outcome:
    return Outcome(float(joint(GRID, GRID[:, None], 0.8).sum()) * STEP**2, 1.0, 1e-6)


def _marginal() -> Outcome:
    exact = normal(GRID, 0.0, 1.0)
    off = (
        np.abs(STEP * joint(GRID, GRID[:, None], r).sum(axis=0) - exact).max() for r in (-0.95, -0.4, 0.0, 0.8, 0.95)
    )
    return Outcome(float(max(off)), 0.0, 1e-6)


def _backwards_area() -> Outcome:
    over_z = [float(conditional(np.array(READ_AT), z, 0.8)) for z in GRID[np.abs(GRID) <= 7.0]]
    return Outcome(STEP * sum(over_z), 1.25, 0.02)


def _independent() -> Outcome:
    before = STEP * joint(GRID, GRID[:, None], 0.0).sum(axis=0)
    off = max(np.abs(conditional(GRID, z, 0.0) - before).max() for z in (-3.0, -0.7, 0.0, 1.2, 3.0))
    return Outcome(float(off), 0.0, 1e-12)


COMPUTED = Computed(
    _answer,
    {
        "volume": _volume,
        "marginal": _marginal,
        "cut-mean": lambda: Outcome(moments(1.2, 0.8)[0], 0.96, 1e-5),
        "cut-variance": lambda: Outcome(moments(1.2, 0.8)[1], 0.36, 1e-5),
        "backwards": _backwards_area,
        "independent": _independent,
    },
    Demonstration(JointParameters(), show),
)
