"""Compiling while the server already runs: what is ready, the progress of the rest, and who has to wait.

On the first start after an installation or an update nothing is compiled yet. Processes of low priority compile while
pages are served: first the whole experiment of the tour, then the others in the order of the start page. An experiment
that somebody opens moves to the front. A session needs the default settings of its experiment compiled; until then it
is refused with a sentence that gives the remaining time. A session compiles anything else when it needs it.
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
"""How long the start of a session waits, s; an experiment whose compiled code only has to be checked is ready by
then."""

LOOK_EVERY_S = 0.1


class Compilation:
    """State and progress of compiling the experiments."""

    def __init__(self, names: tuple[str, ...], known: frozenset[str], stopping: threading.Event) -> None:
        """Begin to compile what is missing.

        Args:
            names: All experiments, in the order of compilation; the first is compiled completely before the others.
            known: The experiments that are already compiled.
            stopping: Set when the server stops and all waiting ends.
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
        """Check which experiments are compiled; they must be imported."""
        names = tuple(sorted(EXPERIMENTS, key=lambda name: not any(it.tour for it in EXPERIMENTS[name].presets)))
        # Where no cache can be written, the process that forks the workers compiles for all of them.
        return cls(names, ready(names) if cache_folder() else frozenset(names), stopping)

    def close(self) -> None:
        """End the compiling processes; their results stay."""
        if self._warming is not None:
            self._warming.stop()

    @property
    def progress(self) -> Progress:
        """Progress so far; an experiment that cannot run counts as ready, since it reports its own fault."""
        found = self._warming.progress if self._warming is not None else self._progress
        ready = self._known | found.ready | found.failed.keys()
        return replace(found, ready=ready, usable=ready | found.usable)

    async def open_experiment(self, name: str) -> None:
        """Compile an opened experiment next, and wait a moment until it is usable.

        Raises:
            ApiError: Compiling takes longer (503).
        """
        if self._warming is not None and name not in self.progress.ready:
            self._warming.prefer(name)
        await self._wait_until(lambda: name in self.progress.usable)

    async def wait_for(self, name: str) -> None:
        """Wait a moment for an experiment to be ready.

        Raises:
            ApiError: Compiling takes longer (503).
        """
        await self._wait_until(lambda: name in self.progress.ready)

    async def _wait_until(self, condition: Callable[[], bool]) -> None:
        """Wait without a thread: a waiting class would occupy all of them."""
        until = time.monotonic() + PATIENCE_S
        while not condition():
            if self._stopping.is_set():
                raise unavailable("The server is shutting down. Try again after its restart.")
            if time.monotonic() > until:
                told = self.progress.sentence
                raise unavailable(f"This experiment is not ready yet: {told}. Try again when it is.")
            await asyncio.sleep(LOOK_EVERY_S)

    def _take(self, progress: Progress) -> None:
        """Log that one or all of the experiments have become ready."""
        if progress.finished or progress.ready != self._seen:
            self._seen = progress.ready
            log.info(
                progress.sentence,
                ready=sorted(progress.ready | self._known),
                compiled=len(progress.seconds),
                seconds=round(progress.elapsed_s),
                **({"failed": dict(progress.failed)} if progress.failed else {}),
            )
