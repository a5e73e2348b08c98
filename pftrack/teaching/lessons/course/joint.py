"""Lesson 2: two uncertain quantities at once, and what learning one says of the other."""

import math

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.recipe import Change, Recipe
from pftrack.teaching.lessons.course.densities import ceiling, normal
from pftrack.teaching.lessons.figure import Axis, Curve, Figure, Handle, HeatMap, Panel, Rule, Scatter
from pftrack.teaching.lessons.lesson import (
    Answer,
    Check,
    Demonstration,
    Lesson,
    Mistake,
    Number,
    Outcome,
    Question,
    Scenario,
    Shown,
)

EDGE = 3.5
CELLS: Floats = np.linspace(-EDGE, EDGE, 57)
"""Middles of the cells of the map."""
PLACES: Floats = np.linspace(-EDGE, EDGE, 281)
STEP = 0.05
GRID: Floats = np.linspace(-10.0, 10.0, 401)
"""On which sums stand for integrals: nearly all of the density lies within it."""
READ_AT = 1.0
"""The x whose conditional density is read along z."""


class JointParameters(Parameters):
    """How closely position and measurement go together, and what was measured."""

    # fmt: off
    correlation: float = parameter(
        0.8, "Correlation r", "How closely x and z go together: 0 is not at all, 1 would be on a line.",
        within=(-0.95, 0.95, 0.05))
    measured: float = parameter(
        1.2, "Cut at z", "The value of z that was learned, where the density is cut.", within=(-3, 3, 0.1))
    # fmt: on


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
    numbers = (
        Number("Mean of x, given z", mean, r * z, 1e-5, reveals=True),
        Number("Variance of x, given z: its mean squared distance from the mean", variance, 1.0 - r**2, 1e-5),
    )
    return Shown(Figure(panels=(_profile(r, z), _backwards(r, z), _map(r, z), _margin(z))), numbers)


def _profile(r: float, z: float) -> Panel:
    return Panel(
        id="profile",
        title="What is known of x",
        x=Axis(title="x", low=-EDGE, high=EDGE),
        y=Axis(title="density", low=0.0, high=_height(r)),
        traces=(
            Curve(title="before z is learned, p(x)", ink="prediction", x=PLACES, y=normal(PLACES, 0.0, 1.0)),
            Curve(
                title="after: the cut, rescaled, p(x | z)",
                ink="estimate",
                x=PLACES,
                y=conditional(PLACES, z, r),
                area=(-EDGE, EDGE),
                reveals=True,
            ),
        ),
        words=f"The marginal density of x is a bump at 0, of variance 1. The cut of the map is made at z = {z:g}.",
        row=0,
        share=(2.0, 3.0),
    )


def _backwards(r: float, z: float) -> Panel:
    curve = joint(np.array(READ_AT), PLACES, r) / normal(PLACES, 0.0, 1.0)
    here = float(np.interp(z, PLACES, curve))
    return Panel(
        id="backwards",
        title="Read the other way",
        x=Axis(title="z", low=-EDGE, high=EDGE),
        y=Axis(title="density", low=0.0, high=_height(r)),
        traces=(
            Curve(title="p(x = 1 | z)", ink="second", x=PLACES, y=curve),
            Scatter(title="at this z", ink="estimate", x=[z], y=[here], size_px=9.0),
        ),
        words=f"p(x = 1 | z) as a curve over z is {here:.3g} at the cut; its area is no longer one.",
        row=0,
        share=(2.0, 2.0),
    )


def _map(r: float, z: float) -> Panel:
    return Panel(
        id="map",
        title="Density of x and z together",
        x=Axis(title="x", low=-EDGE, high=EDGE),
        y=Axis(title="z", low=-EDGE, high=EDGE),
        traces=(HeatMap(title="joint density p(x, z)", x=CELLS, y=CELLS, values=joint(CELLS, CELLS[:, None], r)),),
        handles=(Handle(parameter="measured", at=z, along="y"),),
        words=f"One bump around the middle, {_leaning(r)}; a cut across it at z = {z:g}.",
        row=1,
        share=(3.0, 3.0),
    )


def _margin(z: float) -> Panel:
    return Panel(
        id="margin",
        title="What is known of z",
        x=Axis(title="density", low=0.0, high=0.5),
        y=Axis(title="z", low=-EDGE, high=EDGE),
        traces=(
            Curve(title="marginal p(z)", ink="prediction", x=normal(PLACES, 0.0, 1.0), y=PLACES),
            Rule(title="the cut", ink="estimate", at=z, along="y"),
        ),
        words=f"The marginal density of z is a bump at 0, of variance 1, whatever r is; the cut is at z = {z:g}.",
        row=1,
        share=(3.0, 2.0),
    )


def _height(r: float) -> float:
    """Return where axes of density end, so that the rescaled cut has room."""
    return ceiling(max(0.7, float(normal(0.0, 0.0, math.sqrt(1.0 - r * r)))))


def _leaning(r: float) -> str:
    if r == 0:
        return "as wide one way as the other: x and z are independent"
    return f"drawn out along a line that {'rises' if r > 0 else 'falls'}, the more closely the nearer r = {r:g} is to 1"


def _answer(parameters: JointParameters, seed: int) -> Answer:
    del seed
    mean, variance = moments(parameters.measured, parameters.correlation)
    words = f"The rescaled cut has the mean {mean:.3g} and the variance {variance:.3g}."
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


LESSON = Lesson(
    id="joint",
    number=2,
    title="Joint, marginal, conditional, independent",
    idea=(
        "Two uncertain quantities, a position $x$ and a measurement $z$, have a density over the plane. Adding it up "
        "along one axis leaves the *marginal* density of the other. Learning $z$ cuts the surface along a line; the "
        "cut, rescaled to area one, is the *conditional* density\n\n"
        "$$p(x \\mid z) = \\frac{p(x, z)}{p(z)}.$$\n\n"
        "If the cut looks the same wherever we make it, $z$ tells nothing about $x$: they are *independent*. Read "
        "along the other axis, over $z$, the same numbers have another area than one."
    ),
    body=Demonstration(JointParameters(), show),
    notice="The rescaled cut is narrower than what was known before, and equally narrow wherever z is.",
    tries=(
        "Set r to 0 and move the cut: what is known of x stays as it was.",
        "Set r to 0.95: whoever knows z nearly knows x.",
        "Turn r to its negative: a large z now speaks for a small x.",
    ),
    question=Question(
        text="With r = 0.8, we learn that z = 1.2. Where will the density of x have its middle then?",
        kind="point",
        panel="profile",
        answer=_answer,
        tolerance=0.12,
        bounds=(-EDGE, EDGE),
        words=(
            "Go along the cut in the map: it is brightest at $r z$ = 0.8 × 1.2 = 0.96. A measurement that is only "
            "partly about x moves us only part of the way."
        ),
        mistakes=(
            Mistake(
                1.2,
                "That is z itself. Many a z of 1.2 comes from a smaller x, as there are more of these, and chance.",
            ),
            Mistake(
                0.0,
                "That is where x was before. Only if r were 0, would z tell nothing about it.",
            ),
            Mistake(
                1.5,
                "That is z / r, the line of the map read the other way: for which x this z is the one to expect.",
            ),
            Mistake((-EDGE, -0.2), "With a positive r, a positive z speaks for a positive x."),
        ),
    ),
    checks=(
        Check("volume", "The volume under the joint density is 1.", _volume),
        Check("marginal", "The marginal density of x is N(0, 1), whatever r is; the greatest difference.", _marginal),
        Check(
            "cut-mean",
            "At r = 0.8 and z = 1.2, the mean of the rescaled cut is r z = 0.96.",
            lambda: Outcome(moments(1.2, 0.8)[0], 0.96, 1e-5),
        ),
        Check(
            "cut-variance",
            "At r = 0.8, its variance is 1 - r² = 0.36.",
            lambda: Outcome(moments(1.2, 0.8)[1], 0.36, 1e-5),
        ),
        Check("backwards", "At r = 0.8, p(x = 1 | z) added up over z is 1 / r = 1.25, not 1.", _backwards_area),
        Check(
            "independent",
            "At r = 0, p(x | z) is p(x) wherever the cut is; the greatest difference.",
            _independent,
        ),
    ),
    uses=(
        Scenario(
            Recipe(experiment="fish", tracker="guided", timeline=(Change(0, {"tank": "strong rudder"}),)),
            unlocked=("correlated_changes", "sample_count", "seed"),
            frame=44,
            plots=("error", "bend", "heading"),
            words=(
                "Turning and bending of a fish go together, and the filter has learned how: the leaning ellipse "
                "beside the picture. Here a rudder turns the fish the other way, and in frame 44 the estimate is 53 "
                "px off. Without *Correlated changes*, the two independent, it is never more than 18 px."
            ),
        ),
    ),
)
