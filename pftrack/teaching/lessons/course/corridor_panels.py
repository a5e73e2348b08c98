"""The corridor drawn: all steps so far, the particles as they are weighed, and as they are redrawn."""

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.particles import ParticleSet
from pftrack.teaching.lessons.course.axes import ceiling
from pftrack.teaching.lessons.course.corridor import (
    BIN_M,
    BINS_M,
    CELL_M,
    CELLS_M,
    DOORS_M,
    LENGTH_M,
    STEPS,
    Corridor,
    Exact,
    Walk,
    assign_bins,
)
from pftrack.teaching.lessons.figure import Axis, Curve, Handle, HeatMap, Histogram, Panel, Rule, Scatter, Stems

__all__ = ["resampled_panel", "steps_so_far", "weigh"]

MOST_STEMS, MOST_DOTS = 400, 50
"""Particles that are drawn of a step, spread evenly over all of them."""
COARSE = 4
"""Cells to a point of a curve."""
PER_COLUMN = 10
"""Cells to a column of the map."""


def steps_so_far(redrawn: list[NDArray[np.float64]], walk: Walk, exact: Exact, step: int) -> Panel:
    """Return the map of all steps: what can be known, and up to one of them where particles and robot are."""
    columns = exact.given.reshape(STEPS + 1, -1, PER_COLUMN).mean(axis=2)
    # The root, since at first it is spread over all of the corridor and at last over a few metres.
    known = np.sqrt(columns)
    every = max(len(redrawn[0]) // MOST_DOTS, 1)
    dots = np.array([places[::every] for places in redrawn])
    steps = np.arange(STEPS + 1.0)
    return Panel(
        id="steps",
        title="All steps: the exact density; up to this one the particles, and the robot",
        x=Axis(title="", low=0.0, high=LENGTH_M, hidden=True),
        y=Axis(title="step", low=-0.5, high=STEPS + 0.5),
        traces=(
            HeatMap(
                title="root of the exact density",
                ink="truth",
                x=CELLS_M.reshape(-1, PER_COLUMN).mean(axis=1),
                y=steps,
                values=known,
            ),
            *_doors(),
            Scatter(
                title="particles",
                ink="prediction",
                x=dots.ravel(),
                y=np.repeat(steps[: step + 1], dots.shape[1]),
                size_px=3.0,
            ),
            Curve(title="the robot", ink="second", x=walk.positions_m[: step + 1], y=steps[: step + 1]),
        ),
        handles=(Handle(parameter="step", at=float(step), along="y"),),
        words=(
            f"After {step} steps the robot is truly at {walk.positions_m[step]:.3g} m; the exact density has its peak "
            f"at {CELLS_M[np.argmax(exact.given[step])]:.3g} m."
        ),
        row=0,
        share=(1.2, 1.0),
    )


def weigh(cloud: ParticleSet, walk: Walk, exact: Exact, corridor: Corridor, step: int) -> Panel:
    """Return the particles of a step with their weights, and the likelihood that gives them."""
    count = len(cloud)
    every = max(count // MOST_STEMS, 1)
    heights = count * cloud.weights
    weight, sensed = np.ones(len(CELLS_M)), "nothing yet"
    if step:
        door = bool(walk.doors[step - 1])
        likelihood = corridor.likelihood(CELLS_M, door)
        weight = likelihood / (exact.predicted[step - 1] @ likelihood * CELL_M)
        sensed = "a door" if door else "no door"
    return Panel(
        id="weighed",
        title=f"Step {step}: particles predicted, and weighed by what was sensed, which is {sensed}",
        x=Axis(title="", low=0.0, high=LENGTH_M, hidden=True),
        y=Axis(title="weight", low=0.0, high=ceiling(max(float(heights.max()), float(weight.max())))),
        traces=(
            Curve(title="weight by the likelihood", ink="observation", x=CELLS_M[::COARSE], y=weight[::COARSE]),
            *_doors(),
            Stems(title="predicted particles", ink="prediction", x=cloud.states[::every, 0], y=heights[::every]),
        ),
        words=f"The robot sensed {sensed}. Of {count} particles {cloud.effective_sample_size:.3g} carry the weight.",
        row=1,
        share=(0.8, 1.0),
    )


def resampled_panel(places: NDArray[np.float64], walk: Walk, exact: Exact, step: int) -> Panel:
    """Return the particles of a step after they were redrawn, and the exact density."""
    density = exact.given[step]
    heights = assign_bins(places, np.full(len(places), 1.0 / len(places))) / BIN_M
    return Panel(
        id="redrawn",
        title=f"Step {step}: redrawn in proportion to the weights",
        x=Axis(title="position", unit="m", low=0.0, high=LENGTH_M),
        y=Axis(title="p", unit="1/m", low=0.0, high=ceiling(max(float(density.max()), float(heights.max())))),
        traces=(
            Curve(title="exact density", ink="truth", x=CELLS_M[::COARSE], y=density[::COARSE]),
            *_doors(),
            Histogram(title="particles", ink="estimate", edges=BINS_M, heights=heights),
            Rule(title="the robot", ink="second", at=float(walk.positions_m[step])),
        ),
        words=(
            f"Most particles are near {BINS_M[np.argmax(heights)] + 0.5 * BIN_M:.3g} m; the exact density has its peak "
            f"at {CELLS_M[np.argmax(density)]:.3g} m."
        ),
        row=2,
    )


def _doors() -> tuple[Rule, ...]:
    return tuple(
        Rule(title="doors" if place == DOORS_M[0] else "", ink="observation", at=place, dashed=True)
        for place in DOORS_M
    )
