"""The manager: all sweeps of a server, from the request to the end, also across restarts."""

import asyncio
import contextlib
import json
from dataclasses import replace
from math import prod

import structlog
from pydantic import BaseModel

from pftrack.core.model.parameters import Value
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.process import UNLIMITED
from pftrack.sources.sequence import Recording
from pftrack.sweep import Plan
from pftrack.sweep.axis import SweepError
from pftrack_server.core.errors import not_found, unavailable
from pftrack_server.core.resource_limits import mebibytes
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.store import Store
from pftrack_server.store.database import SweepRow, UploadRow
from pftrack_server.store.files import new_name, now
from pftrack_server.store.filters import FilterFiles
from pftrack_server.sweeps import functions
from pftrack_server.sweeps.planning import BYTES_A_RUN, EstimateRequest, SweepCreate, as_plan, within_limits
from pftrack_server.sweeps.results import upload_of
from pftrack_server.sweeps.sweep import CANCELLED, DELETED, STOPPED, Sweep, default_title
from pftrack_server.uploads.intake import recording_of


class ValuesPublic(BaseModel):
    """The first values of a planned axis, and their number."""

    name: str
    count: int
    first: list[Value]


class EstimatePublic(BaseModel):
    """The size of a sweep before it starts.

    `seconds` is null if it was not measured; `problem` is the reason why this server would refuse the sweep now.
    """

    runs: int
    conditions: int
    cells: int
    frames: int
    axes: list[ValuesPublic]
    jobs: int
    bytes: int
    seconds: float | None = None
    problem: str | None = None


log = structlog.get_logger(__name__)

MEASURE_S = 60.0
MOST_REMEMBERED = 64
SHOWN_VALUES = 24


class Sweeps:
    """All sweeps of a server; call all methods in the event loop's thread."""

    def __init__(self, settings: Settings, store: Store, tasks: ChildTasks, filters: FilterFiles) -> None:
        self._settings = settings
        self._filters = filters
        self._store = store
        self._tasks = tasks
        self._sweeps: dict[str, Sweep] = {}
        self._measuring = asyncio.Lock()
        self._measured: dict[str, float] = {}
        # Guards counting and taking places, and keeps a starting sweep from being deleted.
        self._command_lock = asyncio.Lock()
        self._writing = asyncio.Lock()

    async def open(self) -> None:
        """Load the stored sweeps; none of them is running."""
        for row in reversed(await asyncio.to_thread(self._store.all, SweepRow)):
            try:
                sweep = await asyncio.to_thread(self._sweep, row)
            except (SweepError, ValueError, TypeError, LookupError, AttributeError) as error:
                log.warning("a stored sweep is damaged and left out", sweep=row.id, error=repr(error))
                continue
            self._sweeps[sweep.row.id] = sweep
            if row.state == "running":
                with contextlib.suppress(SweepError):
                    await sweep.look()
                finished = self._store.files.sweep(sweep.row.id).exists()
                sweep.row.state, sweep.row.message = ("done", None) if finished else ("stopped", STOPPED)
                await self._keep(sweep)

    async def close(self) -> None:
        """End all processes; all results are on disk."""
        await asyncio.gather(*(sweep.close(STOPPED) for sweep in self.all))

    @property
    def all(self) -> list[Sweep]:
        """All sweeps, newest first."""
        return sorted(self._sweeps.values(), key=lambda sweep: sweep.row.created, reverse=True)

    def get(self, name: str) -> Sweep:
        """Return a sweep.

        Raises:
            ApiError: It does not exist (404).
        """
        sweep = self._sweeps.get(name)
        if sweep is None:
            raise not_found("This sweep does not exist; it may have been deleted.")
        return sweep

    async def estimate(self, body: EstimateRequest) -> EstimatePublic:
        """Return the size of a sweep and, if requested, the measured time that it would take.

        Raises:
            RefusedError: The plan in the body is unknown, out of bounds or too large.
        """
        plan = await asyncio.to_thread(as_plan, body, self._settings, self._store, self._filters)
        problem = None
        try:
            within_limits(plan, self._settings)
            await self._check_room(plan)
        except RefusedError as error:
            problem = str(error)
        return EstimatePublic(
            runs=plan.runs,
            conditions=plan.conditions,
            cells=prod(plan.shape[:2]),
            frames=plan.frames,
            axes=[
                ValuesPublic(name=axis.name, count=len(axis.values), first=list(axis.values[:SHOWN_VALUES]))
                for axis in plan.axes
            ],
            jobs=self._settings.sweep_jobs,
            bytes=plan.runs * BYTES_A_RUN,
            seconds=await self._measure(plan) if body.measure else None,
            problem=problem,
        )

    async def create(self, body: SweepCreate) -> Sweep:
        """Begin a new sweep.

        Raises:
            RefusedError: The plan in the body is unknown, out of bounds or too large.
            ApiError: The server's limit on running sweeps, stored sweeps or disk space is reached (503).
        """
        plan = await asyncio.to_thread(as_plan, body, self._settings, self._store, self._filters)
        within_limits(plan, self._settings)
        async with self._command_lock:
            await self._check_room(plan)
            row = SweepRow(
                id=new_name(),
                title=body.title or default_title(plan),
                experiment=plan.experiment,
                plan=json.dumps(plan.as_dict()),
                state="stopped",
                runs=plan.runs,
                done=0,
                problems=0,
                seconds=0.0,
                created=now(),
            )
            sweep = await asyncio.to_thread(self._sweep, row)
            self._sweeps[sweep.row.id] = sweep
            try:
                await self._keep(sweep)
                await sweep.start()
            except BaseException:
                # Its process may have started, and must not continue without it.
                with contextlib.suppress(Exception):
                    await self._remove(row.id)
                raise
            return sweep

    async def cancel(self, sweep: Sweep) -> None:
        """Stop computing a sweep.

        Raises:
            ConflictError: The sweep is not running.
        """
        if sweep.row.state != "running":
            raise ConflictError("The sweep is not running.")
        await sweep.stop(CANCELLED)

    async def resume(self, sweep: Sweep) -> None:
        """Resume a sweep.

        Raises:
            ConflictError: The sweep is running or complete.
            ApiError: The server's limit on running sweeps is reached (503).
        """
        async with self._command_lock:
            if sweep.row.state == "running":
                raise ConflictError("The sweep is running already.")
            if sweep.row.state == "done":
                raise ConflictError("The sweep is complete; there is nothing left to compute.")
            self._check_places()
            await sweep.start()

    async def remove(self, name: str) -> None:
        """Delete a sweep with all its results, even one with damaged stored data.

        Raises:
            ApiError: It does not exist (404).
        """
        async with self._command_lock:
            await self._remove(name)

    async def _remove(self, name: str) -> None:
        sweep = self._sweeps.pop(name, None)
        if sweep is not None:
            await sweep.close(DELETED)
        async with self._writing:
            await asyncio.to_thread(self._store.discard, SweepRow, name)

    def uses(self, upload: UploadRow) -> bool:
        """Return whether a running sweep needs an upload."""
        running = (sweep.plan.footage for sweep in self.all if sweep.row.state == "running")
        return any(footage is not None and footage.sha256 == upload.sha256 for footage in running)

    async def _find_recording(self, plan: Plan) -> Recording | None:
        """Return the recording of a plan; None if it has none.

        Raises:
            ConflictError: The recording no longer exists.
        """
        if plan.footage is None:
            return None
        upload = await asyncio.to_thread(upload_of, self._store, plan.footage, "sweep")
        return await recording_of(self._store, self._settings, self._tasks, upload.id)

    # ------------------------------------------------------------ limits

    async def _check_room(self, plan: Plan) -> None:
        settings = self._settings
        if len(self._sweeps) >= settings.max_sweeps:
            raise unavailable(f"The server keeps at most {settings.max_sweeps} sweeps; delete one first.")
        self._check_places()
        wanted, used = plan.runs * BYTES_A_RUN, await asyncio.to_thread(self._used_bytes, self.all)
        if used + wanted > settings.max_sweeps_bytes:
            raise unavailable(
                f"The sweep may need {mebibytes(wanted)}; of the {mebibytes(settings.max_sweeps_bytes)} for all "
                f"sweeps {mebibytes(used)} are in use. Delete one first, or ask for fewer runs."
            )
        await asyncio.to_thread(self._store.disk_budget.check, wanted)

    def _check_places(self) -> None:
        running = sum(sweep.row.state == "running" for sweep in self._sweeps.values())
        if running >= self._settings.max_sweeps_running:
            most = self._settings.max_sweeps_running
            what = "1 sweep" if most == 1 else f"{most} sweeps"
            raise unavailable(f"The server computes at most {what} at a time; wait, or cancel one.")

    def _used_bytes(self, sweeps: list[Sweep]) -> int:
        """Return the bytes of all files of sweeps; this reads the size of each file."""
        return sum(
            self._store.files.sweep_bytes(sweep.row.id)
            if sweep.row.state != "running"
            else sweep.plan.runs * BYTES_A_RUN
            for sweep in sweeps
        )

    # ------------------------------------------------------------ time

    async def _measure(self, plan: Plan) -> float:
        """Return the time that a plan takes, s, measured on a few of its runs in another process."""
        key = json.dumps(plan.as_dict())
        if key not in self._measured:
            async with self._measuring:
                if key not in self._measured:
                    jobs = self._settings.sweep_jobs
                    recording = await self._find_recording(plan)
                    filters = await asyncio.to_thread(self._trusted, plan)
                    told = plan.as_dict(), jobs, recording, filters
                    budget = replace(UNLIMITED, silence_s=MEASURE_S, file_bytes=0)
                    seconds = await self._tasks.run_beside(functions.measure, *told, budget=budget)
                    while len(self._measured) >= MOST_REMEMBERED:
                        del self._measured[next(iter(self._measured))]
                    self._measured[key] = seconds
        return self._measured[key]

    # ------------------------------------------------------------ store

    def _sweep(self, row: SweepRow) -> Sweep:
        plan = Plan.from_dict(json.loads(row.plan), outlined=True)
        out, filters = self._store.files.sweep(row.id), self._trusted(plan)
        return Sweep(row, plan, out, self._settings, self._tasks, self._keep, self._find_recording, filters)

    def _trusted(self, plan: Plan) -> tuple[str, ...]:
        """Return the texts of a plan's filters that are files of the server's owner."""
        return self._store.files.filters_of(plan.single(0).recipe) if plan.filters else ()

    async def _keep(self, sweep: Sweep) -> None:
        """Store the changes of a sweep, unless it was deleted."""
        async with self._writing:
            if sweep.row.id in self._sweeps:
                await asyncio.to_thread(self._store.save, sweep.row)
