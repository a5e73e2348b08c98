"""Fits: numbers of a session's tracker, fitted to what it has seen by a child, while the session goes on."""

import asyncio
from collections.abc import Callable
from typing import Any, TypeAlias

from pftrack.core.model.recipe import Recipe
from pftrack_server.runs.service import footage_here
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.fits import FitOrder, fit_run
from pftrack_server.tasks.jobs import Job, Jobs
from pftrack_server.uploads.intake import limits_of

Fitting: TypeAlias = Job[None, dict[str, Any]]
"""A fit under way, and then what came of it."""


class Fits(Jobs[None, dict[str, Any]]):
    """All fits of a server."""

    def __init__(self, settings: Settings, store: Store, tasks: ChildTasks) -> None:
        super().__init__("fit")
        self._settings = settings
        self._store = store
        self._tasks = tasks

    def fit(self, recipe: Recipe, computed: int, position: int, names: tuple[str, ...]) -> Fitting:
        """Begin to fit numbers of a run.

        Args:
            recipe: Of the run.
            computed: The last frame that belongs to it.
            position: The frame whose tracker and values are the beginning.
            names: Of the numbers.

        Raises:
            UnavailableError: There are as many under way as there may be.
        """
        self.check_room()

        async def work(on_step: Callable[[int, int], None]) -> dict[str, Any]:
            video = await footage_here(self._store, self._settings, self._tasks, recipe.footage)
            filters = await asyncio.to_thread(self._store.files.filters_of, recipe)
            order = FitOrder(recipe.model_dump(mode="json"), computed, position, names, filters)
            limits, cpu_seconds = limits_of(self._settings), self._settings.worker_cpu_seconds
            found: dict[str, Any] = await self._tasks.run_long(
                fit_run, order, video, limits, cpu_seconds=cpu_seconds, on_step=on_step
            )
            return found

        return self.begin(None, work)
