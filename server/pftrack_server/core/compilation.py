"""Compiling while the server runs already: what is ready, how far the rest is, and who has to wait.

On the first start after an installation or an update nothing is compiled yet. Processes of low priority see to that
while pages are served: first all that the tour's experiment has, then the others in the order of the start page, but
for what somebody opens, which comes next. A session needs what its experiment is by default, and until that is compiled
it is refused with a sentence that says how long it will take; the rest it compiles itself when it needs it, if that has
not been done by then.
"""

import asyncio
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Self

import structlog

from pftrack.doctor.memory import cache_folder, ready
from pftrack.doctor.warming import Progress, Warming
from pftrack.experiments import EXPERIMENTS
from pftrack_server.core.errors import unavailable

log = structlog.get_logger(__name__)

PATIENCE_S = 10.0
"""How long the start of a session waits: an experiment that only has to be looked at is ready by then."""

LOOK_EVERY_S = 0.1


class Compilation:
    """What of the experiments is compiled."""

    def __init__(self, names: tuple[str, ...], known: frozenset[str], stopping: threading.Event) -> None:
        """Begin to compile what is missing.

        Args:
            names: All experiments, in the order in which they are compiled; all of the first comes before the others.
            known: Those that are compiled.
            stopping: Is set when nobody is to wait any more.
        """
        self._known = known
        self._stopping = stopping
        self._seen: frozenset[str] = frozenset()
        missing = [name for name in names if name not in known]
        self._progress = Progress(finished=not missing)
        self._warming = Warming(missing, told=self._take) if missing else None
        if self._warming is not None and names[0] in missing:
            self._warming.prefer(names[0])

    @classmethod
    def open(cls, stopping: threading.Event) -> Self:
        """Look at what is compiled; the experiments must be imported."""
        names = tuple(sorted(EXPERIMENTS, key=lambda name: not any(it.tour for it in EXPERIMENTS[name].presets)))
        # Where nothing can be kept, the process that makes the workers compiles for all of them.
        return cls(names, ready(names) if cache_folder() else frozenset(names), stopping)

    def close(self) -> None:
        """End the processes that compile; what they have compiled stays."""
        if self._warming is not None:
            self._warming.stop()

    @property
    def progress(self) -> Progress:
        """How far it is; an experiment that does not run counts as ready, since it says itself what is wrong."""
        found = self._warming.progress if self._warming is not None else self._progress
        ready = self._known | found.ready | found.failed.keys()
        return replace(found, ready=ready, usable=ready | found.usable)

    async def open_experiment(self, name: str) -> None:
        """Wait a moment for an experiment that somebody opens to be usable; it is compiled next.

        Raises:
            ApiError: It takes longer (503).
        """
        if self._warming is not None and name not in self.progress.ready:
            self._warming.prefer(name)
        await self._wait_until(lambda: name in self.progress.usable)

    async def wait_for(self, name: str) -> None:
        """Wait a moment for an experiment to be ready.

        Raises:
            ApiError: It takes longer (503).
        """
        await self._wait_until(lambda: name in self.progress.ready)

    async def _wait_until(self, condition: Callable[[], bool]) -> None:
        """Wait in no thread: a class that waits would hold all of them."""
        until = time.monotonic() + PATIENCE_S
        while not condition():
            if self._stopping.is_set():
                raise unavailable("The server is being stopped. Try again when it is back.")
            if time.monotonic() > until:
                told = self.progress.sentence
                raise unavailable(f"This experiment is not ready yet: {told}. Try again when it is.")
            await asyncio.sleep(LOOK_EVERY_S)

    def _take(self, progress: Progress) -> None:
        """Log that an experiment has become ready, or all have."""
        if progress.finished or progress.ready != self._seen:
            self._seen = progress.ready
            log.info(
                progress.sentence,
                ready=sorted(progress.ready | self._known),
                compiled=len(progress.seconds),
                seconds=round(progress.elapsed_s),
                **({"failed": dict(progress.failed)} if progress.failed else {}),
            )
