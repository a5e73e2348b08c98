"""What a worker makes of a recipe: its footage found on this machine, the filters that can be used, and its limits.

A run may hold so many particles at once on this server, whatever its timeline brings.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pftrack.core.model.parameters import Parameters, flat, limit_particles, revise
from pftrack.core.model.recipe import Footage, Recipe, parameter_values
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import FilterFileError
from pftrack.experiments.own.extension import extend
from pftrack.runs import reproduction
from pftrack.runs.run import Run
from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack.sources.sequence import open_sequence
from pftrack_server.sessions.spec import Problem
from pftrack_server.sessions.worker.protocol import WorkerConfig


def wire(config: WorkerConfig) -> Setup:
    """Wire the recipe's footage, which is the upload, or the simulated scene.

    Raises:
        RefusedError: The upload cannot be opened.
        RefusedError: The upload is another one, or shows no target.
        LookupError: There is no such experiment.
    """
    footage, experiment = config.run.recipe.footage, find(config.run.recipe.experiment)
    if footage is None or config.video is None:
        return experiment.simulate()
    video = Path(config.video)
    limits = dataclasses.replace(DEFAULT_LIMITS, frames=config.max_frames, pixels=config.max_pixels)
    index = FrameIndex.from_json(config.index) if config.index else None

    def open_sequence_of(footage: Footage) -> FrameSequence:
        return open_sequence(video, limits, index=index, square=footage.square)

    setup = reproduction.wire(experiment, footage, open_sequence_of)
    if setup.footage is None or not footage.name:
        return setup
    # A saved run speaks of the recording by the name that people know.
    return dataclasses.replace(setup, footage=setup.footage.model_copy(update={"name": footage.name}))


def usable_filters(recipe: Recipe) -> tuple[Mapping[str, tuple[str, ...]], Problem | None]:
    """Return the filters of a recipe; where the run needs none that cannot be used, without those, and why.

    Raises:
        FilterFileError: One that the run needs cannot be used.
    """
    needed = {recipe.tracker, *(change.values.get("tracker") for change in recipe.timeline)}
    usable, problem = dict(recipe.filters), None
    for name, texts in recipe.filters.items():
        try:
            extend(recipe.experiment, {name: texts})
        except FilterFileError as error:
            if name in needed:
                raise
            problem = Problem(file=error.file, line=error.line, text=error.problem)
            del usable[name]
    return usable, problem


def changes_between(run: Run, frame: int, later: int) -> dict[str, Any]:
    """Return what is in force in a later frame and was not in an earlier one."""
    before, chosen = flat(run.parameters_at(frame)), flat(run.parameters_at(later))
    values: dict[str, Any] = {name: value for name, value in chosen.items() if value != before[name]}
    tracker = run.tracker_at(later)
    return values if tracker == run.tracker_at(frame) else {"tracker": tracker, **values}


def uses(run: Run, tracker: str) -> bool:
    """Return whether a tracker computes any frame of a run."""
    return any(each.tracker == tracker for each in run.timeline.segments)


def limit_change(
    experiment: Experiment, parameters: Parameters, tracker: str, values: Mapping[str, object], most: int
) -> tuple[Parameters, str]:
    """Return parameters and tracker after a change.

    Args:
        experiment: Of the run.
        parameters: In force before.
        tracker: Name of the tracker before.
        values: The change.
        most: How many particles are allowed.

    Raises:
        ParameterError: A value is refused, or there would be too many particles.
    """
    tracker = str(values.get("tracker", tracker))
    changed = revise(parameters, parameter_values(values))
    limit_particles(experiment.declarations(type(changed)), flat(changed), tracker, most)
    return changed, tracker


def limit_recipe(experiment: Experiment, parameters: Parameters, recipe: Recipe, most: int) -> None:
    """Refuse a recipe that has too many particles in any of its frames.

    Args:
        experiment: That of the recipe.
        parameters: Of its setup.
        recipe: The recipe.
        most: How many particles are allowed.

    Raises:
        ParameterError: A value is refused, or there would be too many particles.
    """
    changes: dict[int, dict[str, object]] = {0: {}}
    for change in recipe.timeline:
        changes.setdefault(change.frame, {}).update(change.values)
    tracker = recipe.tracker or experiment.default_tracker
    for frame in sorted(changes):
        parameters, tracker = limit_change(experiment, parameters, tracker, changes[frame], most)
