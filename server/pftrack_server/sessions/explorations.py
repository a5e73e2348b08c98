"""Explorations: what else a session's run might have been, computed beside it, at low priority.

Each is a job with a process of its own. It tells what it has found while it goes on, and ends when nobody asks any
more, when it is cancelled, or with its session.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pftrack.process import Budget
from pftrack_server.errors import ConflictError, NotFoundError
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

__all__ = ["Explorations", "exploration_view"]

NICENESS = 12
"""They come after every session, and after sweeps as well: they go with what is left of the processors."""

SILENCE_S = 60.0
LONGEST_BAND = 2000
"""Frames of an ensemble; longer runs are shown as far as that."""

MOST_OF_SESSION = 3


@dataclass
class _About:
    """What is known of an exploration from the start, and what it has found so far."""

    session: str
    branch: str
    body: ExplorationCreate
    found: dict[str, Any] | None = None


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

    def explore(self, session: Session, body: ExplorationCreate) -> Job[_About, Result]:
        """Begin an exploration of the active branch.

        Raises:
            ConflictError: The session has as many under way as it may have.
            UnavailableError: Too much is under way.
        """
        mine = [job for job in self.peek() if job.about.session == session.spec.id and not job.task.done()]
        if len(mine) >= MOST_OF_SESSION:
            raise ConflictError(
                f"A session explores at most {MOST_OF_SESSION} questions at a time; wait, or cancel one."
            )
        spec, about = session.spec, _About(session.spec.id, session.spec.branch, body)
        config, computed = self._manager.config(spec), spec.run.computed
        budget = Budget(
            memory_bytes=config.memory_bytes,
            cpu_seconds=2 * body.seconds + SILENCE_S,
            silence_s=SILENCE_S,
            niceness=NICENESS,
        )

        async def compute(_: Callable[[int, int], None]) -> Result:
            def keep(found: dict[str, Any]) -> None:
                about.found = found

            if body.kind == "what-if":
                asked: tuple[Any, ...] = (explore_changes, config, computed, body.frame, body.seconds)
            else:
                asked = (explore_seeds, config, LONGEST_BAND, body.scene, body.seconds)
            ended = lambda: not session.live  # noqa: E731 - asked ten times a second
            return _read(body, await self._tasks.run_beside(*asked, budget=budget, on_step=keep, stopped=ended))

        return self.begin(about, compute)

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
    found = None if about.found is None else _read(about.body, about.found)
    if not job.task.done():
        return ExplorationPublic(**known, state="computing", result=found, message=None)
    message = failure_of(job)
    if message is None:
        return ExplorationPublic(**known, state="done", result=job.task.result(), message=None)
    return ExplorationPublic(**known, state="failed", result=found, message=message)


def _read(body: ExplorationCreate, found: dict[str, Any]) -> Result:
    return (WhatIfPublic if body.kind == "what-if" else EnsemblePublic).model_validate(found)
