"""What a lecturer's lesson shows: a run of an experiment, or a figure of the course with other parameters."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from pftrack.core.model.parameters import Parameters, declarations, revise
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.timeline import Change, Timeline
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack.teaching.lessons.answers import all_columns, figure_numbers
from pftrack.teaching.lessons.lecturers.document import Place
from pftrack.teaching.lessons.lecturers.findings import Findings
from pftrack.teaching.lessons.lecturers.head import Head, near
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Scenario
from pftrack.teaching.lessons.registry import find as find_lesson

__all__ = ["body_of"]

BESIDE: Final = ("tracker", "seed")
"""What can be unlocked beside parameters."""


def body_of(head: Head, found: Findings) -> tuple[Scenario | Demonstration | None, Mapping[str, Any]]:
    """Return what a lesson shows, and numbers of the shape that its own will have; None where something is wrong.

    Args:
        head: What was written.
        found: Where it is noted what is wrong.
    """
    if (head.experiment is None) == (head.figure is None):
        found.add(("experiment",) if head.experiment else (), "a lesson names either an `experiment` or a `figure`")
        return None, {}
    return _demonstration(head, found) if head.figure is not None else _scenario(head, found)


def _scenario(head: Head, found: Findings) -> tuple[Scenario | None, Mapping[str, Any]]:
    experiment = found.attempt(("experiment",), lambda: find_experiment(str(head.experiment)))
    if experiment is None:
        return None, {}
    setup = experiment.simulate()
    tracker = head.tracker or experiment.default_tracker
    if tracker not in experiment.trackers:
        found.add(("tracker",), f"{experiment.id} has no tracker {tracker}; {near(tracker, experiment.trackers)}")
        tracker = experiment.default_tracker
    seed = head.seed or 0
    if seed > LARGEST_SEED:
        found.add(("seed",), f"`seed` must be a whole number between 0 and {LARGEST_SEED}")
    if head.parameters:
        found.add(("parameters",), "`parameters` are those of a figure; write those of an experiment in `timeline`")
    _check_names(head, experiment, type(setup.parameters), found)
    timeline = Timeline.begin(setup.parameters, tracker, tuple(experiment.trackers))
    for number, change in enumerate(head.timeline):
        timeline = _apply_change(timeline, Change(change.frame, change.values), ("timeline", number, "values"), found)
    at = {name: value for name, value in head.question.at.items() if name != "seed"}
    _apply_change(timeline, Change(0, at), ("question", "at"), found)
    if found.problems:
        return None, {}
    available = setup.open_source(seed, timeline.parameters_at(0)).frame_count
    frames = head.frames or available or experiment.frames
    _check_frames(head, min(frames, available or frames), found)
    recipe = Recipe(experiment=experiment.id, tracker=tracker, seed=seed, frames=frames, timeline=timeline.changes)
    return Scenario(recipe, head.unlocked, head.frame, head.plots, head.layers), all_columns(experiment, frames)


def _check_frames(head: Head, frames: int, found: Findings) -> None:
    if head.frames is not None and head.frames > frames:
        found.add(("frames",), f"`frames` is {head.frames}, and this scene has {frames}; say fewer, or leave it out")
    if head.frame >= frames:
        found.add(("frame",), f"`frame` is {head.frame}, and the last of {frames} frames is {frames - 1}")
    for number, change in enumerate(head.timeline):
        if change.frame >= frames:
            message = f"this change comes in frame {change.frame}, and the last is {frames - 1}"
            found.add(("timeline", number), message)


def _apply_change(timeline: Timeline, change: Change, place: Place, found: Findings) -> Timeline:
    model: type[Parameters] = type(timeline.parameters_at(0))
    known = {it.name for it in declarations(model)} | {"tracker"}
    values = {}
    for name, value in change.values.items():
        if name in known:
            values[name] = value
        else:
            found.add((*place, name), f"there is no parameter {name}; {near(name, known)}")
    changed = found.attempt(place, lambda: timeline.insert(Change(change.frame, values)))
    return changed or timeline


def _check_names(head: Head, experiment: Experiment, model: type[Parameters], found: Findings) -> None:
    known = [*(it.name for it in declarations(model)), *BESIDE]
    for number, name in enumerate(head.unlocked):
        if name not in known:
            message = f"`unlocked` names {name}, which {experiment.id} does not have; {near(name, known)}"
            found.add(("unlocked", number), message)
    shown = {"plots": [plot.id for plot in experiment.plots], "layers": [layer.name for layer in experiment.layers]}
    for field, names in shown.items():
        for number, name in enumerate(getattr(head, field)):
            if name not in names:
                message = f"`{field}` names {name}, which {experiment.id} does not have; {near(name, names)}"
                found.add((field, number), message)


def _demonstration(head: Head, found: Findings) -> tuple[Demonstration | None, Mapping[str, Any]]:
    lesson: Lesson | None = found.attempt(("figure",), lambda: find_lesson(str(head.figure)))
    for name in ("tracker", "frames", "timeline", "unlocked", "plots", "layers", "frame"):
        if name in head.model_fields_set:
            found.add((name,), f"`{name}` is of an experiment; a figure has `parameters` and `seed`, all unlocked")
    if lesson is None:
        return None, {}
    if not isinstance(lesson.body, Demonstration):
        experiment = lesson.body.recipe.experiment
        found.add(("figure",), f"the lesson {lesson.id} shows no figure; name its `experiment`, {experiment}")
        return None, {}
    body = lesson.body
    parameters = found.attempt(("parameters",), lambda: revise(body.parameters, head.parameters))
    at = found.attempt(("question", "at"), lambda: revise(parameters or body.parameters, head.question.at))
    if parameters is None or at is None:
        return None, {}
    seed = body.seed if head.seed is None else head.seed
    return replace(body, parameters=parameters, seed=seed), figure_numbers(body, at, seed)
