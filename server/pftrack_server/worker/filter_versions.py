"""Versions of filters from files: which a run needs and can use, and what is kept when another one takes over."""

from collections.abc import Mapping
from typing import Any

from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Recipe
from pftrack.experiments.own.extension import extend
from pftrack.experiments.own.sliders import FilterFileError
from pftrack.runs.run import Run
from pftrack_server.schemas.snapshot import Problem


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
