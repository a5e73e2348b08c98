"""Checks of drawings: finite, within reach of the picture, on declared layers, and stable from frame to frame."""

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from pftrack.drawing import Drawing, Picture, Primitive
from pftrack.experiment import Experiment
from pftrack.rendering import render
from pftrack.testing.check import FRAMES, Check, begun, demand, each_tracker

__all__ = ["checks"]

REACH = 10.0
"""How many times the picture's longer side a coordinate may lie from its corner: what is further is a mistake."""

PLACES = ("positions", "centre", "half_axes", "origin", "vertices", "segments", "position", "apex", "corners")


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, each for every tracker."""
    yield from each_tracker(
        experiment,
        [
            ("drawings keep to the picture and to declared layers", _drawings_are_sound),
            ("what has a name in a drawing stays what it is", _names_are_stable),
            ("a drawing shows no future", _no_future_is_drawn),
            ("a second run can be drawn beside it", _a_second_run_is_drawn),
        ],
    )


def _drawn(experiment: Experiment, tracker: str) -> Iterator[tuple[int, Drawing]]:
    run = begun(experiment, tracker)
    for step in run:
        yield step.diagnostics.frame, experiment.draw(step, run.diagnostics)


def _drawings_are_sound(experiment: Experiment, tracker: str) -> None:
    for frame, drawing in _drawn(experiment, tracker):
        _demand_sound(experiment, drawing, frame)
        if frame in {0, FRAMES - 1}:
            shape = render(drawing).shape
            demand(shape == (drawing.height, drawing.width, 3), f"frame {frame} is rendered to the shape {shape}")


def _demand_sound(experiment: Experiment, drawing: Drawing, frame: int) -> None:
    first = next(iter(drawing.primitives.values()), None)
    demand(isinstance(first, Picture), f"the drawing of frame {frame} must begin with the picture, got {first!r:.60}")
    demand("\n" not in drawing.caption, f"the caption of frame {frame} must be one line, got {drawing.caption!r}")
    for name, item in drawing.primitives.items():
        demand(
            item.layer in experiment.shown_layers, f"{name} is drawn on the layer {item.layer!r}, which is not declared"
        )
        if isinstance(item, Picture):
            shape = item.image_rgb.shape
            wanted = (drawing.height, drawing.width, 3)
            demand(shape == wanted, f"the picture of frame {frame} must have the shape {wanted}, got {shape}")
        _demand_within(name, item, drawing, frame)


def _demand_within(name: str, item: Primitive, drawing: Drawing, frame: int) -> None:
    most = REACH * max(drawing.width, drawing.height)
    for part in (field.name for field in fields(item) if field.name in PLACES):
        values = np.asarray(getattr(item, part))
        demand(np.isfinite(values).all(), f"{part} of {name} in frame {frame} must be finite")
        far = float(np.abs(values).max(initial=0.0))
        demand(far <= most, f"{part} of {name} in frame {frame} must lie within {most:g} px, got {far:g} px")


def _names_are_stable(experiment: Experiment, tracker: str) -> None:
    known: dict[str, tuple[str, str]] = {}
    for frame, drawing in _drawn(experiment, tracker):
        for name, item in drawing.primitives.items():
            is_now = type(item).__name__, item.layer
            was = known.setdefault(name, is_now)
            demand(
                is_now == was,
                f"{name} is a {is_now[0]} on the layer {is_now[1]!r} in frame {frame}, and was a {was[0]} on "
                f"{was[1]!r} before; a viewer updates by name what it already shows",
            )


def _no_future_is_drawn(experiment: Experiment, tracker: str) -> None:
    run = begun(experiment, tracker)
    early = experiment.draw(run.seek(FRAMES // 2), run.diagnostics)
    run.finish()
    late = experiment.draw(run.seek(FRAMES // 2), run.diagnostics)
    same = early.caption == late.caption and early.primitives.keys() == late.primitives.keys()
    same = same and np.array_equal(render(early), render(late))
    demand(same, f"frame {FRAMES // 2} is drawn differently once later frames are computed")


def _a_second_run_is_drawn(experiment: Experiment, tracker: str) -> None:
    run, other = begun(experiment, tracker), begun(experiment, seed=0)
    step, there = run.finish(), other.finish().diagnostics
    before = experiment.draw(step, run.diagnostics)
    drawing = experiment.draw(step, run.diagnostics, there)
    _demand_sound(experiment, drawing, FRAMES - 1)
    more = drawing.primitives.keys() - before.primitives.keys()
    demand(more, "nothing is drawn of a second run beside the first")
