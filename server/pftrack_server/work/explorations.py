"""Explorations: variants of a session's run, computed in parallel to it at low priority.

Each is a job with its own processes. It reports findings as they arrive, and ends when no client polls it any more,
when it is cancelled, or with its session. Findings are stale once the session's run has changed.
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
    """The exploration of a session's active branch to begin."""

    kind: Literal["what-if", "ensemble"]
    frame: FrameNumber | None = Field(None, description="For what-if: a frame of the loss (default: the first lasting)")
    scene: Scene = Field("same", description="For an ensemble: whether each run sees the scene of its own seed")
    seconds: Annotated[float, Field(ge=1.0, le=LONGEST_S), NOT_BOOLEAN] = Field(LONGEST_S, description="Time limit, s")


class ExplorationJob(Job[Report | Bands]):
    """Changes that would have saved a run (a report), or runs with other seeds (bands)."""

    kind: Literal["exploration"] = "exploration"
    session: str
    branch: str
    stale: bool = Field(False, description="Whether the session's run has changed since then")


NICENESS: Mapping[str, int] = {"ensemble": 6, "what-if": 14}
"""Niceness by kind; both give way to sessions. Bands must follow a slider; a list fills in the background."""

SILENCE_S = 300.0
"""Allowed silence, s: computing to the end of a long run takes longest."""
LONGEST_BAND = 2000
"""Most frames of an ensemble; longer runs are cut."""

MOST_OF_SESSION = 3
MOST_KEPT = 100
"""Most runs whose latest findings are kept for their exports, even after the list was closed."""
MOST_PROCESSES = 4
"""Processes of one exploration, each with a part of the changes; several explorations share them."""

BANDS = TypeAdapter(Bands)


class Exploration(ExplorationJob):
    """An exploration with fields that clients do not see.

    Attributes:
        body: The request.
        run: Identity of the explored run.
        now: Returns the identity of the session's present run.
        parts: Findings of each of its processes so far.
    """

    body: ExplorationCreate
    run: tuple[str, str]
    now: Callable[[], tuple[str, str]]
    parts: dict[int, dict[str, Any]] = Field(default_factory=dict)

    @property
    def report(self) -> Report | None:
        """Findings of all processes about changes."""
        return join([read_record(self.parts[number]) for number in sorted(self.parts)])

    def refresh(self) -> None:
        """Update the result with the findings so far."""
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
            ConflictError: The session's limit of explorations is reached.
            ApiError: Too many jobs are running (503).
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
                raise unavailable("Nothing was found in this time; ask again with more time.")
            return job.result

        return house.jobs.begin(job, work)

    async def _compute(self, session: Session, job: Exploration, asked: Sequence[tuple[Any, ...]]) -> None:
        """Compute each part in a process of its own."""
        budget = Budget(
            memory_bytes=self._house.settings.worker_memory_bytes,
            cpu_seconds=2 * job.body.seconds + SILENCE_S,
            silence_s=SILENCE_S,
            niceness=NICENESS[job.body.kind],
        )
        try:
            async with asyncio.TaskGroup() as group:  # a failing part ends all
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
        """Return the what-if record of a session's present run, if it was requested."""
        last = self._last.get(_run(session))
        report = last.report if last else None
        return None if report is None else record(report)


def _run(session: Session) -> tuple[str, str]:
    """Return the identity of a session's run: the session's name, and the recipe."""
    return session.spec.id, session.spec.run.recipe.model_dump_json()
