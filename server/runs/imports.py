"""Imports: saved runs that were sent and are computed once before they are kept, which may take minutes.

Each is a job that tells how far it is and can be cancelled. It lives in memory: nothing of a run that was sent has been
promised to anybody before it is kept. It goes on for as long as somebody asks for it: whoever has closed the page no
longer waits, and others do, for its place.
"""

import asyncio
import contextlib
import shutil
import time
from collections.abc import Coroutine
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import structlog

from server.errors import ApiError, ClientGoneError, NotFoundError, UnavailableError
from server.runs.service import bring_in
from server.settings import Settings
from server.store import Store
from server.store.files import new_name
from server.store.tables import RunRow
from server.tasks.child_tasks import ChildTasks
from server.uploads.multipart import Received

__all__ = ["Import", "Imports"]

log = structlog.get_logger(__name__)

MOST_AT_WORK = 32
KEPT_S = 600.0
"""So long it can be asked what came of an import."""
LOOK_S = 15.0
"""Time between two looks whether somebody has asked for an import that is under way."""
MOST_LOOKS = 10
"""Looks without a question after which it is dropped: 150 s, since browsers let a hidden page ask once a minute only.
They are counted, so that a while in which this very process was stopped is one look and not hundreds of seconds."""


@dataclass
class Import:
    """A run that is being brought in.

    Attributes:
        id: Its name.
        name: Of the file that was sent.
        done: Frames computed.
        total: Frames to compute; 0 until that is known.
        task: What brings it in, and then its result.
        ended: When that ended (monotonic, s).
        unasked: Looks since somebody asked for it.
    """

    id: str
    name: str
    done: int = 0
    total: int = 0
    task: asyncio.Task[RunRow] = field(init=False)
    ended: float | None = None
    unasked: int = 0

    def step(self, done: int, total: int) -> None:
        """Take note of how far it is."""
        self.done, self.total = done, total


class Imports:
    """All imports of a server."""

    def __init__(self, settings: Settings, store: Store, tasks: ChildTasks) -> None:
        self._settings = settings
        self._store = store
        self._tasks = tasks
        self._all: dict[str, Import] = {}

    @property
    def all(self) -> list[Import]:
        """Those under way, and those that ended a while ago, the newest first; looking at them asks for all."""
        self._forget()
        for each in self._all.values():
            each.unasked = 0
        return list(reversed(self._all.values()))

    def get(self, name: str) -> Import:
        """Return an import, which then goes on.

        Raises:
            NotFoundError: There is none, or it ended long ago.
        """
        self._forget()
        if name not in self._all:
            raise NotFoundError("There is no such import; it may have been cancelled, or ended long ago.")
        self._all[name].unasked = 0
        return self._all[name]

    def begin(self, folder: Path, received: Received) -> Import:
        """Begin to bring in a file that has arrived in a folder of its own, which is removed in the end.

        Raises:
            UnavailableError: There are as many under way as there may be.
        """
        self._forget()
        if sum(not each.task.done() for each in self._all.values()) >= MOST_AT_WORK:
            shutil.rmtree(folder, ignore_errors=True)
            raise UnavailableError(f"The server brings in at most {MOST_AT_WORK} runs at a time; wait, or cancel one.")
        made = Import(new_name(), received.names[0])
        work = bring_in(self._store, self._tasks, self._settings, folder, received, made.step)
        made.task = asyncio.ensure_future(_to_the_end(made, work))
        # Nobody has to ask for what came of it.
        made.task.add_done_callback(lambda task: None if task.cancelled() else task.exception())
        self._all[made.id] = made
        return made

    async def cancel(self, name: str) -> None:
        """End an import, and forget it.

        Raises:
            NotFoundError: There is none.
        """
        found = self.get(name)
        await _cancel(found)
        self._all.pop(name, None)

    async def close(self) -> None:
        """End all imports."""
        await asyncio.gather(*(_cancel(each) for each in self._all.values()))

    def _forget(self) -> None:
        now = time.monotonic()
        for each in list(self._all.values()):
            if each.ended is not None and now - each.ended > KEPT_S:
                del self._all[each.id]


async def _to_the_end(job: Import, work: Coroutine[Any, Any, RunRow]) -> RunRow:
    try:
        return await _while_wanted(job, work)
    except ApiError:
        raise
    except Exception:
        # Its client may have gone: nobody else would write it down.
        log.exception("an import failed", name=job.name)
        raise
    finally:
        job.ended = time.monotonic()


async def _while_wanted(job: Import, work: Coroutine[Any, Any, RunRow]) -> RunRow:
    working = asyncio.ensure_future(work)
    try:
        while not (await asyncio.wait({working}, timeout=LOOK_S))[0]:
            job.unasked += 1
            if job.unasked >= MOST_LOOKS:
                raise ClientGoneError(
                    f"Nobody asked for this run for {LOOK_S * MOST_LOOKS:g} s while it was computed, so that was "
                    "stopped; send it again."
                )
        return working.result()
    finally:
        working.cancel()
        await asyncio.gather(working, return_exceptions=True)


async def _cancel(job: Import) -> None:
    job.task.cancel()
    with contextlib.suppress(asyncio.CancelledError, Exception):
        await job.task
