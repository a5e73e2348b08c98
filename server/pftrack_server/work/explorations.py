"""Explorations: what else a session's run might have been, computed beside it, at low priority.

Each is a job with its own processes. It reports findings as they come, and ends when no client polls it any more, when
it is cancelled, or with its session. Findings are stale once the session's run has changed.
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
from pftrack_server.core.errors import unavailable
from pftrack_server.jobs.jobs import Job, OnStep
from pftrack_server.sessions.session import Session
from pftrack_server.store.files import new_name
from pftrack_server.work.run_functions import explore_changes, explore_seeds
from pftrack_server.work.sources import House

LONGEST_S = 600.0


class ExplorationCreate(RequestBody):
    """What to find out about the active branch of a session."""

    kind: Literal["what-if", "ensemble"]
    frame: FrameNumber | None = Field(None, description="For what-if: a frame of the loss; default: the first lasting")
    scene: Scene = Field("same", description="For an ensemble: whether each run sees the scene of its own seed")
    seconds: Annotated[float, Field(ge=1.0, le=LONGEST_S), NOT_BOOLEAN] = Field(LONGEST_S, description="Time limit, s")


class ExplorationJob(Job[Report | Bands]):
    """What would have saved a run (a report), or what runs with other seeds do (bands)."""

    kind: Literal["exploration"] = "exploration"
    session: str
    branch: str
    stale: bool = Field(False, description="Whether the session's run has changed since")


NICENESS: Mapping[str, int] = {"ensemble": 6, "what-if": 14}
"""Both give way to sessions. A band has to follow a slider; a list fills in the background, after all other work."""

SILENCE_S = 300.0
"""A run that is followed to its end may be long, and comes after all others."""
LONGEST_BAND = 2000
"""Frames of an ensemble; longer runs are shown as far as that."""

MOST_OF_SESSION = 3
MOST_KEPT = 100
"""Runs whose latest findings are kept: their exports have them, also after the list was closed."""
MOST_PROCESSES = 4
"""Of one exploration; each has a part of the changes. Several explorations share them."""

BANDS = TypeAdapter(Bands)


class Exploration(ExplorationJob):
    """An exploration with what clients are not told.

    Attributes:
        body: What was asked.
        run: Identity of the explored run.
        now: Returns the identity of the session's present run.
        parts: What each of its processes has found so far.
    """

    body: ExplorationCreate
    run: tuple[str, str]
    now: Callable[[], tuple[str, str]]
    parts: dict[int, dict[str, Any]] = Field(default_factory=dict)

    @property
    def report(self) -> Report | None:
        """What all processes have found about changes."""
        return join([read_record(self.parts[number]) for number in sorted(self.parts)])

    def refresh(self) -> None:
        """Take over the findings so far."""
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
            ApiError: Too much is under way (503).
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
                raise unavailable("Nothing was found in this time; ask again, and for longer.")
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
            async with asyncio.TaskGroup() as group:  # one that fails ends all
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
    """Return the identity of a session's run: the session's name, and the recipe."""
    return session.spec.id, session.spec.run.recipe.model_dump_json()
