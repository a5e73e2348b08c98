"""References: names of runs on this server: a saved run, a session's branch or a run of a sweep.

| reference | is |
|---|---|
| `run` | a saved run |
| `session:branch` | the present recipe of a session's branch |
| `sweep:run` | a run of a sweep |
| either with `:tracker` | the same by another tracker, from frame 0 on |
"""

import asyncio
import dataclasses
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple

from pydantic import Field, model_validator

from pftrack.core.model.recipe import Recipe
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.runs.record import Record
from pftrack_server.core.bodies import RequestBody
from pftrack_server.core.errors import not_found
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.jobs import Jobs, OnStep
from pftrack_server.sessions.create import SessionCreate, as_spec, new_spec
from pftrack_server.sessions.manager import Manager
from pftrack_server.sessions.spec import FIRST, Bookmark, SessionSpec
from pftrack_server.sessions.worker.protocol import WorkerConfig
from pftrack_server.store import Store
from pftrack_server.store.database import RunRow
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.sweeps.results import session_spec, upload_of
from pftrack_server.work.run_functions import read_record


class ComparedRun(RequestBody):
    """A run to compare, given by a reference or by its recipe."""

    reference: str | None = Field(None, max_length=200, description="`run`, `session:branch`, `sweep:run`[`:tracker`]")
    recipe: Recipe | None = None
    upload: str | None = Field(None, max_length=64, description="Name of the upload that holds the recipe's footage")

    @model_validator(mode="after")
    def _one_of_both(self) -> "ComparedRun":
        if (self.reference is None) == (self.recipe is None):
            raise ValueError("A run to compare needs either a reference or a recipe")
        return self


class House(NamedTuple):
    """The server's services for runs.

    Attributes:
        settings: Settings of the server.
        store: Holds saved runs and uploads.
        manager: Holds the sessions.
        sweeps: Sweeps of the server.
        tasks: Runs confined processes.
        jobs: The running jobs.
        wait_for: Waits for an experiment to be compiled; raises an error if it takes longer.
    """

    settings: Settings
    store: Store
    manager: Manager
    sweeps: Sweeps
    tasks: ChildTasks
    jobs: Jobs
    wait_for: Callable[[str], Awaitable[None]]

    async def config(self, spec: SessionSpec) -> WorkerConfig:
        """Return a confined process's configuration for the active branch of a spec, without checkpoints."""
        return dataclasses.replace(await self.manager.config(spec), states=None)

    async def compute(
        self,
        on_step: OnStep,
        function: Callable[..., Any],
        *arguments: object,
        **limits: Any,  # noqa: ANN401 - of `run_long`
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Call a function of `run_functions` in a confined process, and return its result."""
        seconds = self.settings.worker_cpu_seconds
        return await self.tasks.run_long(function, *arguments, cpu_seconds=seconds, on_step=on_step, **limits)


async def reopen(store: Store, tasks: ChildTasks, row: RunRow) -> SessionSpec:
    """Return the spec of a session that continues a saved run.

    Raises:
        RefusedError: The record cannot be read.
        ConflictError: Its file or its video is missing.
    """
    path = store.files.record(row.id)
    if not path.exists():
        raise ConflictError("The file of this run is missing.")
    saved = Record.model_validate(await tasks.run(read_record, str(path)))
    footage = saved.recipe.footage
    upload = await asyncio.to_thread(upload_of, store, footage, "run") if footage else None
    return new_spec(
        saved.recipe.with_footage(name=upload.name) if upload else saved.recipe,
        upload=upload.id if upload else None,
        position=min(row.position, saved.computed - 1),
        computed=saved.computed - 1,
        bookmarks=[Bookmark(**{**mark, "branch": FIRST}) for mark in row.bookmarks],
    )


class NamedRun(NamedTuple):
    """The recipe of a run, and its title if it has one."""

    spec: SessionSpec
    title: str | None


async def find_run(run: ComparedRun, house: House) -> NamedRun:
    """Return the recipe of a run to compare.

    Raises:
        ApiError: The run does not exist (404).
        ConflictError: The recording of a saved run is missing, or a run of a sweep could not be computed.
        RefusedError: The reference is not valid, or names an unknown tracker.
        ParameterError: The experiment of a recipe is unknown.
    """
    if run.recipe is not None:
        body = SessionCreate(recipe=run.recipe, upload=run.upload)
        return NamedRun(await asyncio.to_thread(as_spec, body, house.store), None)
    reference = run.reference or ""
    match reference.split(":"):
        case [name]:
            return await _of_saved_run(name, house)
        case [name, place, *tracker] if len(tracker) <= 1:
            if place.isdecimal():
                return await _of_sweep(name, int(place), *tracker, house=house)
            return _of_session(name, place, *tracker, house=house)
    raise RefusedError(
        f"Expected run, session:branch or sweep:run, got {reference[:64]!r}.", field="reference", value=reference
    )


async def _of_saved_run(name: str, house: House) -> NamedRun:
    row = await asyncio.to_thread(house.store.get, RunRow, name)
    if row is None:
        raise not_found(f"The saved run {name[:32]!r} is not here; it was deleted, or is on another server.")
    return NamedRun(await reopen(house.store, house.tasks, row), row.title)


def _of_session(name: str, place: str, tracker: str | None = None, *, house: House) -> NamedRun:
    session = house.manager.find(name)
    branch = session.spec.branches.get(place) if session else None
    if session is None or branch is None:
        raise not_found(f"The branch {place[:32]!r} of a session {name[:32]!r} is not here; it was ended.")
    recipe, title = branch.run.recipe, f"{session.snapshot.name}, {branch.title}"
    if tracker is not None:
        trackers = (*find_experiment(recipe.experiment).trackers, *recipe.filters)
        if tracker not in trackers:
            known = ", ".join(trackers)
            raise RefusedError(
                f"{session.description.title} has the trackers {known}, not {tracker[:32]!r}.", field="reference"
            )
        recipe = recipe.model_copy(update={"tracker": tracker})
    recipe = recipe.with_footage(truth=session.spec.truth)
    return NamedRun(new_spec(recipe, upload=session.spec.upload), None if tracker else title)


async def _of_sweep(name: str, run: int, tracker: str | None = None, *, house: House) -> NamedRun:
    sweep = house.sweeps.get(name)
    spec = await asyncio.to_thread(session_spec, house.store, sweep.row.id, sweep.plan, sweep.results, run, tracker)
    return NamedRun(spec, f"{sweep.view().title}, run {run}")
