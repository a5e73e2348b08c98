"""Figures of lessons that show every kind of trace, made of the types that lessons use."""

import numpy as np

from pftrack.teaching.lessons.figure import (
    Axis,
    Bars,
    Curve,
    Figure,
    Handle,
    HeatMap,
    Histogram,
    Panel,
    Rule,
    Scatter,
    Stems,
    StripChart,
    Tree,
)

RNG = np.random.default_rng(5)
X = np.linspace(-4.0, 4.0, 161)


def _normal(x: np.ndarray, mean: float, sigma: float) -> np.ndarray:
    return np.asarray(np.exp(-(((x - mean) / sigma) ** 2) / 2) / (sigma * np.sqrt(2 * np.pi)))


BELOW = Axis(title="position", low=-4.0, high=4.0, unit="m")
DENSITIES = Panel(
    id="densities",
    title="Belief before and after",
    x=BELOW,
    y=Axis(title="density", low=0.0, high=1.0, unit="1/m"),
    traces=(
        Histogram(
            title="draws", ink="hidden", edges=np.linspace(-2, 2, 17), heights=_normal(np.linspace(-2, 2, 16), 0, 0.8)
        ),
        Curve(title="prior", ink="prediction", x=X, y=_normal(X, -1, 1), area=(-1.0, 1.0)),
        Curve(title="likelihood", ink="observation", x=X, y=_normal(X, 1.5, 0.6)),
        Curve(title="posterior", ink="estimate", x=X, y=_normal(X, 0.8, 0.5)),
        Curve(title="exact", ink="truth", x=X, y=_normal(X, 0.84, 0.5), dashed=True),
        Rule(title="mean", ink="estimate", at=0.8),
    ),
    handles=(Handle(parameter="z", at=1.5), Handle(parameter="height", at=0.25, along="y")),
    words="The posterior lies between prior and likelihood, with its mean at 0.8 m.",
)
STEMS = Panel(
    id="stems",
    title="Weights",
    x=BELOW,
    y=Axis(title="weight", low=0.0, high=1.0, hidden=True),
    traces=(Stems(title="draws", ink="second", x=RNG.normal(0, 1.2, 40), y=RNG.uniform(0.1, 0.9, 40)),),
    words="Forty draws of unequal weight.",
    row=1,
    share=(0.6, 1.0),
)
PLANE = HeatMap(
    title="joint density",
    x=np.linspace(-3, 3, 61),
    y=np.linspace(-3, 3, 61),
    values=_normal(np.linspace(-3, 3, 61)[:, None] - 0.8 * np.linspace(-3, 3, 61), 0, 0.6)
    * _normal(np.linspace(-3, 3, 61), 0, 1),
)
HEAT = Panel(
    id="heat",
    title="Over the plane",
    x=Axis(title="z", low=-3.0, high=3.0),
    y=Axis(title="x", low=-3.0, high=3.0),
    traces=(
        PLANE,
        Curve(title="mean", ink="truth", x=[-3, 3], y=[-2.4, 2.4]),
        Scatter(title="draws", ink="lost", x=RNG.normal(0, 1, 30), y=RNG.normal(0, 1, 30)),
    ),
    handles=(Handle(parameter="cut", at=1.2),),
    words="A ridge from the lower left to the upper right.",
)
ERROR = Panel(
    id="error",
    title="Error",
    x=Axis(title="samples", low=10, high=10_000, log=True),
    y=Axis(title="rms error", low=0.005, high=0.6, log=True, unit="m"),
    traces=(
        StripChart(title="measured", ink="estimate", x=[10, 100, 1000, 10_000], y=[0.47, 0.152, 0.0488, 0.0146]),
        Curve(title="one over the root of N", ink="truth", x=[10, 10_000], y=[0.474, 0.015], dashed=True),
    ),
    words="The error falls as the root of the number of samples.",
    row=1,
)
DOORS = Panel(
    id="cloud",
    title="Particles",
    x=Axis(title="across", low=0, high=10, unit="m"),
    y=Axis(title="up", low=0, high=5, unit="m"),
    traces=(
        Scatter(title="particles", x=RNG.uniform(0, 10, 300), y=RNG.uniform(0, 5, 300)),
        Scatter(title="doors", ink="prediction", x=[2, 5, 8], y=[1, 4, 2], size_px=10),
        Rule(title="floor", ink="hidden", at=0.5, along="y", dashed=True),
    ),
    row=1,
)
SCHEMES = Panel(
    id="bars",
    title="Offspring",
    x=Axis(title="", low=-0.5, high=3.5, names=("multinomial", "residual", "stratified", "systematic")),
    y=Axis(title="variance", low=0, high=16),
    traces=(
        Bars(title="measured", heights=[15.24, 2.1, 1.6, 1.364]),
        Bars(title="exact", ink="truth", heights=[15.21, 2.0, 1.58, 1.36]),
    ),
)
SHARES = Panel(
    id="shares",
    title="Weights as shares of one bar",
    x=Axis(title="share", low=0, high=1),
    y=Axis(title="", low=0, high=1.3, hidden=True),
    traces=(
        Bars(title="weights", ink="observation", heights=[0.37, 0.23, 0.17, 0.12, 0.07, 0.04], stacked=True),
        Stems(title="comb", ink="lost", x=np.arange(20) / 20 + 0.02, y=np.full(20, 1.15)),
    ),
    row=1,
    share=(0.5, 1.0),
)
ANCESTRY = Panel(
    id="tree",
    title="Ancestry",
    x=Axis(title="step", low=-0.3, high=6.3),
    y=Axis(title="", low=-0.7, high=9.7, hidden=True),
    traces=(
        Tree(
            title="descent",
            parents=np.vstack([np.full(10, np.nan), np.sort(RNG.integers(0, 10, (6, 10)), axis=1)]),
            weights=RNG.uniform(0.1, 1, (7, 10)),
        ),
    ),
    row=1,
)
GAPS = Panel(
    id="strip",
    title="Effective sample size",
    x=Axis(title="step", low=0, high=30),
    y=Axis(title="ESS", low=0, high=100),
    traces=(
        StripChart(
            title="with resampling",
            x=np.arange(31),
            y=np.where(np.arange(31) % 10 == 5, np.nan, 60 + 20 * np.sin(np.arange(31))),
        ),
        StripChart(title="without", ink="lost", x=np.arange(31), y=100 * np.exp(-np.arange(31) / 6)),
    ),
    words="Without resampling it falls to nothing.",
)

EVERY: dict[str, Figure] = {
    "curves": Figure(panels=(DENSITIES, STEMS)),
    "plane": Figure(panels=(HEAT, GAPS, ERROR, DOORS)),
    "bars": Figure(panels=(SCHEMES, SHARES, ANCESTRY)),
}
"""Between them every kind of trace."""
