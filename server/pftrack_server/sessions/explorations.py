"""Explorations: what else a session's run might have been, computed beside it, at low priority.

Each is a job with processes of its own. It tells what it has found while it goes on, and ends when nobody asks any
more, when it is cancelled, or with its session.
"""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from pftrack.analysis.counterfactuals.report import Report, join, read_record, record
from pftrack.core.model.recipe import Recipe
from pftrack.process import Budget
from pftrack_server.errors import ConflictError, NotFoundError, UnavailableError
from pftrack_server.schemas.explorations import (
    EnsemblePublic,
    ExplorationCreate,
    ExplorationPublic,
    Result,
    WhatIfPublic,
)
from pftrack_server.sessions.manager import Manager
from pftrack_server.sessions.session import Session
from pftrack_server.settings import Settings
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.explorations import explore_changes, explore_seeds
from pftrack_server.tasks.jobs import Job, Jobs, failure_of

NICENESS: Mapping[str, int] = {"ensemble": 6, "what-if": 14}
"""They come after every session. A band follows a slider, and is soon there; a list fills for as long as one looks."""

SILENCE_S = 60.0
LONGEST_BAND = 2000
"""Frames of an ensemble; longer runs are shown as far as that."""

MOST_OF_SESSION = 3
MOST_DROPPED = 100
"""Of how many sessions it is kept what was found last."""
MOST_PROCESSES = 4
"""Of one exploration; each has a part of the changes."""


@dataclass
class _About:
    """What is known of an exploration from the start, and what each of its processes has found so far."""

    session: str
    branch: str
    recipe: Recipe
    body: ExplorationCreate
    found: dict[int, dict[str, Any]] = field(default_factory=dict)


class Explorations(Jobs[_About, Result]):
    """All explorations of a server.

    Args:
        settings: What the server allows.
        manager: It knows the sessions.
        tasks: Where they are computed.
    """

    def __init__(self, settings: Settings, manager: Manager, tasks: ChildTasks) -> None:
        super().__init__("exploration")
        self._settings, self._manager, self._tasks = settings, manager, tasks
        self._dropped: dict[str, _About] = {}

    async def explore(self, session: Session, body: ExplorationCreate) -> Job[_About, Result]:
        """Begin an exploration of the active branch.

        Raises:
            ConflictError: The session has as many under way as it may have.
            NotFoundError: It shall go on with what another one has found, and there is no such exploration.
            UnavailableError: Too much is under way.
        """
        config = await self._manager.config(session.spec)
        mine = [job for job in self.peek() if job.about.session == session.spec.id and not job.task.done()]
        if len(mine) >= MOST_OF_SESSION:
            raise ConflictError(
                f"A session explores at most {MOST_OF_SESSION} questions at a time; wait, or cancel one."
            )
        spec = session.spec
        about = _About(spec.id, spec.branch, spec.run.recipe, body)
        known = None if body.after is None else _known(self.of(session, body.after).about, about)
        computed = spec.run.computed
        asked: list[tuple[Any, ...]] = [(explore_seeds, config, LONGEST_BAND, body.scene, body.seconds)]
        if body.kind == "what-if":
            count = min(self._settings.sweep_jobs, MOST_PROCESSES)
            shares = [(number, count) for number in range(count)]
            asked = [(explore_changes, config, computed, body.frame, share, known, body.seconds) for share in shares]
        return self.begin(about, lambda _: self._compute(session, about, asked))

    async def _compute(self, session: Session, about: _About, asked: Sequence[tuple[Any, ...]]) -> Result:
        """Have each part computed in a process of its own, and return what they come to."""
        budget = Budget(
            memory_bytes=self._settings.worker_memory_bytes,
            cpu_seconds=2 * about.body.seconds + SILENCE_S,
            silence_s=SILENCE_S,
            niceness=NICENESS[about.body.kind],
        )
        try:
            async with asyncio.TaskGroup() as group:  # of which one that fails ends all, each of them once
                for number, each in enumerate(asked):
                    group.create_task(self._compute_part(session, about, number, each, budget))
        except BaseExceptionGroup as errors:
            raise errors.exceptions[0] from None
        result = _read(about)
        if result is None:
            raise UnavailableError("Nothing was found in this time; ask again, and for longer.")
        return result

    async def _compute_part(
        self, session: Session, about: _About, number: int, asked: tuple[Any, ...], budget: Budget
    ) -> None:
        keep = partial(about.found.__setitem__, number)
        keep(await self._tasks.run_beside(*asked, budget=budget, on_step=keep, stopped=lambda: not session.live))

    def found_of(self, session: Session) -> dict[str, Any] | None:
        """Return the record of what would have saved the run of a session as it is, where that was asked."""
        recipe = session.spec.run.recipe
        for about in [*(job.about for job in reversed(self.peek())), *reversed(self._dropped.values())]:
            if about.body.kind == "what-if" and (about.session, about.recipe) == (session.spec.id, recipe):
                report = _join(about)
                if report is not None:
                    return record(report)
        return None

    def on_drop(self, job: Job[_About, Result]) -> None:
        """Keep what was found last of a session: whoever closes the list may still export the run with it."""
        if job.about.body.kind == "what-if" and job.about.found:
            self._dropped.pop(job.about.session, None)
            self._dropped[job.about.session] = job.about
            if len(self._dropped) > MOST_DROPPED:
                self._dropped.pop(next(iter(self._dropped)))

    def of(self, session: Session, name: str) -> Job[_About, Result]:
        """Return an exploration of a session, which then goes on.

        Raises:
            NotFoundError: The session has none of this name.
        """
        job = self.get(name)
        if job.about.session != session.spec.id:
            raise NotFoundError("There is no such exploration in this session.")
        return job


def exploration_view(job: Job[_About, Result]) -> ExplorationPublic:
    """Return an exploration as everybody outside sees it."""
    about = job.about
    known = {"id": job.id, "session": about.session, "branch": about.branch, "kind": about.body.kind}
    found = _read(about)
    if not job.task.done():
        return ExplorationPublic(**known, state="computing", result=found, message=None)
    message = failure_of(job)
    if message is None:
        return ExplorationPublic(**known, state="done", result=job.task.result(), message=None)
    return ExplorationPublic(**known, state="failed", result=found, message=message)


def _read(about: _About) -> Result | None:
    """Return what has been found so far; None where nothing can be said."""
    if about.body.kind == "ensemble":
        return EnsemblePublic.model_validate(about.found[0]) if about.found else None
    report = _join(about)
    return None if report is None else WhatIfPublic.model_validate(report.as_dict())


def _join(about: _About) -> Report | None:
    """Return what all processes have found of changes."""
    return join([read_record(about.found[number]) for number in sorted(about.found)])


def _known(before: _About, now: _About) -> Report | None:
    """Return what was found before of the same run; None where something else was asked of it."""
    if any(each.body.kind != "what-if" for each in (before, now)):
        return None
    if (before.branch, before.recipe, before.body.frame) != (now.branch, now.recipe, now.body.frame):
        return None
    return _join(before)
