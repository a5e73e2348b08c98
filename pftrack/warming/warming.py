"""The processes that compile, seen from outside: they are given cases, and their news make the progress."""

import json
import os
import subprocess
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from pftrack.process import command, describe, environment
from pftrack.warming.memory import remember
from pftrack.warming.progress import Progress
from pftrack.warming.schedule import Case, Schedule

__all__ = ["Warming"]

CHILD = "pftrack.warming.child"
ENDING_S = 5.0


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
        child: str = CHILD,
        low_priority: bool = True,
    ) -> None:
        """Begin.

        Args:
            names: Of the experiments.
            processes: How many at once; one a processor if not given.
            told: Is called with the progress after every piece of news, by one thread at a time.
            child: The module that does it.
            low_priority: Whether others come first, as they should where nobody waits for it.
        """
        names = tuple(names)
        self._schedule = Schedule(names)
        self._all = frozenset(names)
        self._told = told
        self._module = child
        self._arguments = () if low_priority else ("--at-once",)
        self._lock = threading.RLock()
        self._done: set[str] = set()
        self._ready: set[str] = set()
        self._failed: dict[str, str] = {}
        self._seconds: dict[str, float] = {}
        self._total = 0
        self._begun = time.monotonic()
        self._ended: float | None = None
        count = min(len(names), processes or os.cpu_count() or 1)
        self._children = [self._started() for _ in range(count)]
        self._threads = [threading.Thread(target=self._work, args=(it,), daemon=True) for it in self._children]
        for thread in self._threads:
            thread.start()

    @property
    def progress(self) -> Progress:
        """How far it is now."""
        with self._lock:
            return Progress(
                len(self._done),
                self._total,
                frozenset(self._ready),
                dict(self._failed),
                dict(self._seconds),
                (self._ended or time.monotonic()) - self._begun,
                self._ready | self._failed.keys() >= self._all,
            )

    def wait(self) -> Progress:
        """Wait until all is done, and return what came of it."""
        for thread in self._threads:
            thread.join()
        return self.progress

    def stop(self) -> None:
        """End the processes; what they have compiled stays."""
        with self._lock:
            self._schedule.clear()
            for child in self._children:
                child.kill()
        for thread in self._threads:
            thread.join(ENDING_S)

    def _started(self) -> "subprocess.Popen[str]":
        return subprocess.Popen(  # noqa: S603 - this very Python, and a module of ours
            command(self._module, *self._arguments),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment(),
            text=True,
        )

    def _work(self, child: "subprocess.Popen[str]") -> None:
        """Follow a process, and another one after each that ends before its time, until nothing waits."""
        self._follow(child)
        while (following := self._successor(child)) is not None:
            child = following
            self._follow(child)

    def _successor(self, child: "subprocess.Popen[str]") -> "subprocess.Popen[str] | None":
        """Start a process in the place of one that has ended, if there is something left for it to do."""
        with self._lock:  # so that `stop` meets either the new process or an empty queue
            if not self._schedule:
                return None
            self._children.remove(child)
            self._children.append(self._started())
            return self._children[-1]

    def _follow(self, child: "subprocess.Popen[str]") -> None:
        """Hand out cases to a process and take its news, until there are no more or it ends."""
        current = self._hand_out(child, None)
        assert child.stdout is not None  # noqa: S101 - as it was started
        for line in child.stdout:
            news = json.loads(line)
            with self._lock:
                self._take(news)
                if current is not None and ("done" in news or "failed" in news):
                    self._close(current[0])
                    current = self._hand_out(child, current[0])
                self._tell()
        child.wait()
        child.stdout.close()
        with suppress(OSError):  # what was not taken any more
            if child.stdin is not None:
                child.stdin.close()
        if current is not None:
            with self._lock:
                self._fail(current[0], f"its compiler process {describe(child.returncode)}")
                self._close(current[0])
                self._tell()

    def _take(self, news: dict[str, Any]) -> None:
        if "total" in news:
            self._total = news["total"]
        if "begun" in news:
            self._schedule.begun(news["begun"], news["cases"])
        if "function" in news:
            self._seconds[news["function"]] = self._seconds.get(news["function"], 0.0) + news["seconds"]
            self._done.add(news["function"])
        self._done.update(news.get("found", ()))
        if "failed" in news:
            self._fail(news["failed"], news["reason"])

    def _fail(self, name: str, reason: str) -> None:
        self._failed.setdefault(name, reason)
        self._schedule.give_up(name)

    def _close(self, name: str) -> None:
        """Take up that a case has run; an experiment is ready when that was the last of them."""
        if self._schedule.done(name) and name not in self._failed:
            remember(name)
            self._ready.add(name)

    def _hand_out(self, child: "subprocess.Popen[str]", before: str | None) -> Case | None:
        """Give a process the next case, or let it end."""
        assert child.stdin is not None  # noqa: S101 - as it was started
        with self._lock:
            case = self._schedule.take(before)
        with suppress(OSError):  # where it has ended; whoever reads its output sees that
            if case is None:
                child.stdin.close()
            else:
                child.stdin.write(json.dumps(case) + "\n")
                child.stdin.flush()
        return case

    def _tell(self) -> None:
        progress = self.progress
        if progress.finished and self._ended is None:
            self._ended = time.monotonic()
        if self._told is not None:
            self._told(progress)
