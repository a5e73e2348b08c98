"""The processes that compile, seen from outside: they are given cases, and their news make the progress."""

import os
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from typing import Any

from pftrack.doctor.warming.memory import remember
from pftrack.doctor.warming.progress import Progress
from pftrack.doctor.warming.schedule import Case, Schedule
from pftrack.doctor.warming.watch import compile_case
from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer

PRELOAD = "pftrack.doctor.warming.preload"
LOW_PRIORITY = 10


class Warming:
    """Compiles what experiments need, in processes of low priority.

    It may be looked at and ended from any thread.
    """

    def __init__(
        self,
        names: Iterable[str],
        *,
        processes: int | None = None,
        told: Callable[[Progress], None] | None = None,
        compile_case: Callable[[str, int], list[str]] = compile_case,
        low_priority: bool = True,
    ) -> None:
        """Begin.

        Args:
            names: Of the experiments, in the order in which they are needed.
            processes: How many at once; one a processor if not given.
            told: Is called with the progress after every piece of news, by one thread at a time.
            compile_case: Does it, in those processes.
            low_priority: Whether others come first, as they should where nobody waits for it.
        """
        names = tuple(names)
        self._schedule = Schedule(names)
        self._all = frozenset(names)
        self._told = told
        self._compile = compile_case
        self._lock = threading.RLock()
        self._done: set[str] = set()
        self._usable: set[str] = set()
        self._ready: set[str] = set()
        self._failed: dict[str, str] = {}
        self._seconds: dict[str, float] = {}
        self._total = 0
        self._begun = time.monotonic()
        self._ended: float | None = None
        self._running = 0
        self._over = threading.Event()
        budget = replace(UNLIMITED, niceness=LOW_PRIORITY if low_priority else 0)
        self._pool = BlockingPool(
            ForkServer(PRELOAD), processes=max(1, min(len(names), processes or os.cpu_count() or 1)), budget=budget
        )
        with self._lock:
            self._hand_out(None)

    @property
    def progress(self) -> Progress:
        """How far it is now."""
        with self._lock:
            return Progress(
                len(self._done),
                self._total,
                frozenset(self._usable),
                frozenset(self._ready),
                dict(self._failed),
                dict(self._seconds),
                (self._ended or time.monotonic()) - self._begun,
                self._ready | self._failed.keys() >= self._all,
            )

    def prefer(self, name: str) -> None:
        """Compile an experiment before the others, since somebody waits for it."""
        with self._lock:
            self._schedule.prefer(name)

    def wait(self) -> Progress:
        """Wait until all is done, and return what came of it."""
        self._over.wait()
        return self.progress

    def stop(self) -> None:
        """End the processes; what they have compiled stays."""
        with self._lock:
            self._schedule.clear()
        self._pool.close()
        self._over.set()

    def _hand_out(self, before: str | None) -> None:
        """Give cases to processes that have nothing to do; when there are no more, let all of them end.

        Args:
            before: The experiment of what was run last.
        """
        while self._running < self._pool.processes and (case := self._schedule.take(before)) is not None:
            self._running += 1
            future = self._pool.submit(self._compile, *case, on_step=self._take)
            future.add_done_callback(partial(self._settle, case))
        if not self._running and not self._over.is_set():
            self._over.set()
            # Not here: this may be the pool's own thread.
            threading.Thread(target=self._pool.close, name="end-compiling").start()

    def _settle(self, case: Case, future: "Future[list[str]]") -> None:
        """Take up what came of a case, and go on with the next."""
        if future.cancelled():
            return
        name, number = case
        with self._lock:
            self._running -= 1
            error = future.exception()
            if error is None:
                self._done.update(future.result())
                if number == 0:
                    self._usable.add(name)
            elif isinstance(error, CallError):  # experiments of other packages may raise anything
                self._fail(name, str(error).splitlines()[0])
            else:
                self._fail(name, f"its compiler process {error}")
            self._close(name)
            self._hand_out(name)
            self._tell()

    def _take(self, news: dict[str, Any]) -> None:
        with self._lock:
            if "begun" in news:
                self._total = news["total"]
                self._schedule.on_begin(news["begun"], news["cases"])
                self._hand_out(news["begun"])
            else:
                self._seconds[news["function"]] = self._seconds.get(news["function"], 0.0) + news["seconds"]
                self._done.add(news["function"])
            self._tell()

    def _fail(self, name: str, reason: str) -> None:
        self._failed.setdefault(name, reason)
        self._schedule.give_up(name)

    def _close(self, name: str) -> None:
        """Take up that a case has run; an experiment is ready when that was the last of them."""
        if self._schedule.done(name) and name not in self._failed:
            remember(name)
            self._ready.add(name)

    def _tell(self) -> None:
        progress = self.progress
        if progress.finished and self._ended is None:
            self._ended = time.monotonic()
        if self._told is not None:
            self._told(progress)
