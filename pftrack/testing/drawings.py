"""Checks of drawings: finite, within reach, on declared layers, in declared worlds, and stable from frame to frame."""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Ellipsoids, Picture, Primitive, World, WorldDrawing
from pftrack.core.model.faults import faults
from pftrack.experiments.experiment import Experiment
from pftrack.testing.check import FRAMES, CheckError, demand, each_tracker, straight
from pftrack.vision.rendering import render_beside

REACH = 10.0
"""How many times the picture's longer side a coordinate may lie from its corner: what is further is a mistake."""

PLACES = (
    "positions",
    "centre",
    "centres",
    "half_axes",
    "origin",
    "vertices",
    "segments",
    "position",
    "apex",
    "corners",
)

ROUNDING = 1e-4
"""Of the largest entry of a covariance, as a share: they are drawn from 32 bits."""

WORLD_REACH = 1.01
"""How many radii of a world a coordinate may lie from its middle; what is further is cut off."""


def _draw(experiment: Experiment, tracker: str) -> Iterator[tuple[int, Drawing]]:
    yield from enumerate(straight(experiment, tracker).drawings)


@each_tracker("a drawing holds what can be shown")
def _drawings_have_no_faults(experiment: Experiment, tracker: str) -> None:
    for frame, drawing in _draw(experiment, tracker):
        for name, clause in faults(drawing).items():
            raise CheckError(f"{name} in frame {frame} cannot be shown: {clause}")


@each_tracker("drawings keep to the picture and to declared layers")
def _drawings_are_sound(experiment: Experiment, tracker: str) -> None:
    for frame, drawing in _draw(experiment, tracker):
        _demand_sound(experiment, drawing, frame)
        if frame in {0, FRAMES - 1}:
            shape = render_beside(drawing).shape
            fits = shape == (drawing.height, max(shape[1], drawing.width), 3)
            demand(fits, f"frame {frame} is rendered to the shape {shape}")


def _demand_sound(experiment: Experiment, drawing: Drawing, frame: int) -> None:
    first = next(iter(drawing.primitives.values()), None)
    demand(isinstance(first, Picture), f"the drawing of frame {frame} must begin with the picture, got {first!r:.60}")
    demand("\n" not in drawing.caption, f"the caption of frame {frame} must be one line, got {drawing.caption!r}")
    for name, item in drawing.primitives.items():
        _demand_layer(experiment, name, item)
        if isinstance(item, Picture):
            shape = item.image_rgb.shape
            wanted = (drawing.height, drawing.width, 3)
            demand(shape == wanted, f"the picture of frame {frame} must have the shape {wanted}, got {shape}")
        _demand_finite(name, item, frame)
        most = REACH * max(drawing.width, drawing.height)
        for part, values in _places(item):
            far = float(np.abs(values).max(initial=0.0))
            demand(far <= most, f"{part} of {name} in frame {frame} must lie within {most:g} px, got {far:g} px")


def _demand_layer(experiment: Experiment, name: str, item: Primitive) -> None:
    demand(item.layer in experiment.shown_layers, f"{name} is drawn on the layer {item.layer!r}, which is not declared")


@each_tracker("what is drawn in a world keeps to it")
def _worlds_are_sound(experiment: Experiment, tracker: str) -> None:
    for world in experiment.worlds:
        stated = world.name and world.title and world.unit
        demand(stated, f"the world {world.name!r} must have a name, a title and a unit")
    for frame, drawing in _draw(experiment, tracker):
        drawn = tuple(each.world for each in drawing.worlds)
        demand(
            drawn == experiment.worlds,
            f"the drawing of frame {frame} must have the worlds that are declared, {_named(experiment.worlds)}, got "
            f"{_named(drawn)}",
        )
        for each in drawing.worlds:
            _demand_within(experiment, each, frame)


def _demand_within(experiment: Experiment, drawn: WorldDrawing, frame: int) -> None:
    world = drawn.world
    for name, item in drawn.primitives.items():
        _demand_layer(experiment, name, item)
        _demand_finite(name, item, frame)
        for part, values in _places(item):
            far = float(np.linalg.norm(values - np.array(world.middle), axis=-1).max(initial=0.0))
            demand(
                far <= WORLD_REACH * world.radius,
                f"{part} of {name} in frame {frame} must lie within {world.radius:g} {world.unit} of the middle of "
                f"the world {world.name!r}, got {far:.4g} {world.unit}",
            )


def _named(worlds: tuple[World, ...]) -> str:
    return ", ".join(world.name for world in worlds) or "none"


def _places(item: Primitive) -> Iterator[tuple[str, Floats]]:
    for field in fields(item):
        if field.name in PLACES:
            yield field.name, np.asarray(getattr(item, field.name), dtype=np.float64)


def _demand_finite(name: str, item: Primitive, frame: int) -> None:
    for part, values in _places(item):
        demand(np.isfinite(values).all(), f"{part} of {name} in frame {frame} must be finite")
    if isinstance(item, Ellipsoids):
        spread = item.covariances.astype(np.float64)
        demand(np.isfinite(spread).all(), f"covariances of {name} in frame {frame} must be finite")
        least = float(np.linalg.eigvalsh(spread).min(initial=0.0))
        size = float(np.abs(spread).max(initial=0.0))
        symmetric = np.allclose(spread, np.swapaxes(spread, 1, 2), atol=ROUNDING * size)
        demand(
            symmetric and least >= -ROUNDING * size,
            f"covariances of {name} in frame {frame} must be symmetric and not negative, got the eigenvalue {least:g}",
        )


@each_tracker("what has a name in a drawing stays what it is")
def _names_are_stable(experiment: Experiment, tracker: str) -> None:
    known: dict[str, tuple[str, str]] = {}
    for frame, drawing in _draw(experiment, tracker):
        in_worlds = {
            f"{each.world.name} {name}": item for each in drawing.worlds for name, item in each.primitives.items()
        }
        for name, item in (drawing.primitives | in_worlds).items():
            is_now = type(item).__name__, item.layer
            was = known.setdefault(name, is_now)
            demand(
                is_now == was,
                f"{name} is a {is_now[0]} on the layer {is_now[1]!r} in frame {frame}, and was a {was[0]} on "
                f"{was[1]!r} before; a viewer updates by name what it already shows",
            )


@each_tracker("a drawing shows no future")
def _no_future_is_drawn(experiment: Experiment, tracker: str) -> None:
    known = straight(experiment, tracker)
    early = known.drawings[FRAMES // 2]
    late = experiment.draw(known.steps[FRAMES // 2], known.run.diagnostics)
    same = early.caption == late.caption and early.primitives.keys() == late.primitives.keys()
    same = same and np.array_equal(render_beside(early), render_beside(late))
    demand(same, f"frame {FRAMES // 2} is drawn differently once later frames are computed")


@each_tracker("a second run can be drawn beside it")
def _a_second_run_is_drawn(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    there = straight(experiment, experiment.default_tracker, seed=0).run.current.diagnostics
    before = experiment.draw(run.current, run.diagnostics)
    drawing = experiment.draw(run.current, run.diagnostics, there)
    _demand_sound(experiment, drawing, FRAMES - 1)
    more = drawing.primitives.keys() - before.primitives.keys()
    demand(more, "nothing is drawn of a second run beside the first")


@each_tracker("a tracker that joins it is drawn")
def _a_joined_tracker_is_drawn(experiment: Experiment, tracker: str) -> None:
    """Draw a step that a tracker took of which the experiment's own code knows neither name nor title."""
    known = straight(experiment, tracker)
    title = experiment.trackers[tracker].title
    step = replace(known.steps[-1], tracker="joined-later", tracker_title="Joined later")
    try:
        drawn = experiment.draw(step, known.run.diagnostics)
    except Exception as error:
        raise CheckError(
            f"a step of a tracker that joins the experiment must be drawn, got {type(error).__name__}: {error}"
        ) from error
    names_it = title not in known.drawings[-1].caption or step.tracker_title in drawn.caption
    demand(names_it, f"the caption of a step must name the tracker that took it by its title, got {drawn.caption!r}")
