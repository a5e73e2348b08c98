"""Explorations: what else a session's run might have been, computed beside it, at low priority.

Each is a job with processes of its own. It tells what it has found while it goes on, and ends when nobody asks any
more, when it is cancelled, or with its session. What it has found of a run that has changed since is stale.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from pftrack.analysis.counterfactuals import Report, join, read_record, record
from pftrack.analysis.other_seeds import Bands, Scene
from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.refusal import ConflictError
from pftrack.process import Budget
from pftrack_server.core.bodies import FrameNumber, RequestBody
from pftrack_server.core.errors import UnavailableError
from pftrack_server.jobs.jobs import Job, OnStep
from pftrack_server.sessions.session import Session
from pftrack_server.store.files import new_name
from pftrack_server.work.run_functions import explore_changes, explore_seeds
from pftrack_server.work.sources import House

LONGEST_S = 600.0


class ExplorationCreate(RequestBody):
    """What to find out of the active branch of a session."""

    kind: Literal["what-if", "ensemble"]
    frame: FrameNumber | None = Field(None, description="Of what-if, a frame of the loss; by default the first lasting")
    scene: Scene = Field("same", description="Of ensemble, whether each run sees what its own seed makes of the scene")
    seconds: Annotated[float, Field(ge=1.0, le=LONGEST_S), NOT_BOOLEAN] = Field(LONGEST_S, description="Time limit, s")


class ExplorationJob(Job[Report | Bands]):
    """What would have saved a run (a report), or what runs with other seeds do (bands)."""

    kind: Literal["exploration"] = "exploration"
    session: str
    branch: str
    stale: bool = Field(False, description="Whether the session's run is no longer the one that this is about")


NICENESS: Mapping[str, int] = {"ensemble": 6, "what-if": 14}
"""They come after every session. A band follows a slider, and is soon there; a list fills in the background, after all
other work."""

SILENCE_S = 300.0
"""A run that is followed to its end may be long, and comes after all others."""
LONGEST_BAND = 2000
"""Frames of an ensemble; longer runs are shown as far as that."""

MOST_OF_SESSION = 3
MOST_KEPT = 100
"""Of how many runs it is kept what was found last: after the list is closed the run can still be exported with it."""
MOST_PROCESSES = 4
"""Of one exploration; each has a part of the changes. Several explorations share them."""

BANDS = TypeAdapter(Bands)


class Exploration(ExplorationJob):
    """An exploration under way, with what is told to nobody.

    Attributes:
        body: What was asked.
        run: What tells its run from all others.
        now: Returns the same of the run that its session has now.
        parts: What each of its processes has found so far.
    """

    body: ExplorationCreate
    run: tuple[str, str]
    now: Callable[[], tuple[str, str]]
    parts: dict[int, dict[str, Any]] = Field(default_factory=dict)

    @property
    def report(self) -> Report | None:
        """What all processes have found of changes."""
        return join([read_record(self.parts[number]) for number in sorted(self.parts)])

    def refresh(self) -> None:
        """Say what has been found so far."""
        self.stale = self.now() != self.run
        found = self.report if self.body.kind == "what-if" else None
        if found is not None:
            self.result, self.done, self.total = found, found.done, found.total
        elif self.parts and self.body.kind == "ensemble":
            self.result = BANDS.validate_python(self.parts[0])


class Explorations:
    """All explorations of a server."""

    def __init__(self, house: House) -> None:
        self._house = house
        self._last: dict[tuple[str, str], Exploration] = {}

    async def explore(self, session: Session, body: ExplorationCreate) -> Exploration:
        """Begin an exploration of the active branch.

        Raises:
            ConflictError: The session has as many under way as it may have.
            UnavailableError: Too much is under way.
        """
        house = self._house
        config = await house.manager.config(session.spec)
        mine = [each for each in house.jobs.under_way(Exploration) if each.session == session.spec.id]
        if len(mine) >= MOST_OF_SESSION:
            raise ConflictError(f"A session explores at most {MOST_OF_SESSION} questions at once; wait, or cancel one.")
        spec, now = session.spec, partial(_run, session)
        job = Exploration(
            id=new_name(), name=body.kind, session=spec.id, branch=spec.branch, body=body, run=now(), now=now
        )
        asked: list[tuple[Any, ...]] = [(explore_seeds, config, LONGEST_BAND, body.scene, body.seconds)]
        if body.kind == "what-if":
            among = 1 + len(house.jobs.under_way(Exploration))
            count = max(min(house.settings.sweep_jobs, MOST_PROCESSES) // among, 1)
            shares = [(number, count) for number in range(count)]
            asked = [(explore_changes, config, body.frame, share, body.seconds) for share in shares]

        async def work(_: OnStep) -> Report | Bands:
            await self._compute(session, job, asked)
            job.refresh()
            if job.result is None:
                raise UnavailableError("Nothing was found in this time; ask again, and for longer.")
            return job.result

        return house.jobs.begin(job, work)

    async def _compute(self, session: Session, job: Exploration, asked: Sequence[tuple[Any, ...]]) -> None:
        """Have each part computed in a process of its own."""
        budget = Budget(
            memory_bytes=self._house.settings.worker_memory_bytes,
            cpu_seconds=2 * job.body.seconds + SILENCE_S,
            silence_s=SILENCE_S,
            niceness=NICENESS[job.body.kind],
        )
        try:
            async with asyncio.TaskGroup() as group:  # of which one that fails ends all, each of them once
                for number, each in enumerate(asked):
                    group.create_task(self._compute_part(session, job, number, each, budget))
        except BaseExceptionGroup as errors:
            raise errors.exceptions[0] from None

    async def _compute_part(
        self, session: Session, job: Exploration, number: int, asked: tuple[Any, ...], budget: Budget
    ) -> None:
        keep = partial(self._keep, job, number)
        keep(await self._house.tasks.run_beside(*asked, budget=budget, on_step=keep, stopped=lambda: not session.live))

    def _keep(self, job: Exploration, number: int, found: dict[str, Any]) -> None:
        job.parts[number] = found
        if job.body.kind == "what-if" and self._last.get(job.run) is not job:
            self._last.pop(job.run, None)
            self._last[job.run] = job
            if len(self._last) > MOST_KEPT:
                self._last.pop(next(iter(self._last)))

    def found_of(self, session: Session) -> dict[str, Any] | None:
        """Return the record of what would have saved the run of a session as it is, where that was asked."""
        last = self._last.get(_run(session))
        report = last.report if last else None
        return None if report is None else record(report)


def _run(session: Session) -> tuple[str, str]:
    """Return what tells the run of a session from all others: its name, and what makes the run."""
    return session.spec.id, session.spec.run.recipe.model_dump_json()
