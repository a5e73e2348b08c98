"""Compiling all functions, once on each machine, before a user waits for it.

Numba compiles a function when it is first called and keeps it on disk. Calling everything once takes most of a minute,
so processes of low priority do it, case by case on all processors (`compiling`), and their owner follows their
progress. Compiled code remains when they are ended, and `memory` records the experiments that are ready.

The first case of an experiment is its default, which is all that its session needs to begin. So the first cases of all
come before the others, and an awaited experiment comes before them.

Two processes that need the same function at the same time both compile it. Cases that follow one another call much the
same functions, so a process then stays with the experiment that it has begun; when that has no more, it helps another
one from its end, where other choices are used than at the beginning.
"""

import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from pftrack.doctor.compiling import compile_case
from pftrack.doctor.memory import remember
from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer

PRELOAD = "pftrack.doctor.preload"
LOW_PRIORITY = 10

LEAST = 5
"""Number of compiled functions required for an estimate of the remaining time."""


@dataclass(frozen=True)
class Progress:
    """The progress of compiling.

    Attributes:
        done: Functions that are compiled, or were.
        total: Functions that there are; 0 while that is not known yet.
        usable: Experiments that run as they are by default; what else they can is compiled where it is used first.
        ready: Experiments that are completely compiled.
        failed: Why experiments could not be run, by name.
        seconds: The functions compiled now, and the processor time of each without its callees.
        elapsed_s: Since the beginning.
        left_s: Approximate remaining time on an idle machine, s; None while unknown. It never rises.
        finished: Whether all experiments are ready or have failed.
    """

    done: int = 0
    total: int = 0
    usable: frozenset[str] = frozenset()
    ready: frozenset[str] = frozenset()
    failed: Mapping[str, str] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    elapsed_s: float = 0.0
    left_s: float | None = None
    finished: bool = False

    @property
    def sentence(self) -> str:
        """The message to users: "compiling, 14 of 41 functions, about 40 s on an idle machine, only once"."""
        if self.finished:
            return "compiled"
        parts = ["compiling"]
        if self.total:
            parts.append(f"{min(self.done, self.total)} of {self.total} functions")
        if self.left_s is not None:
            parts.append(f"about {max(5 * round(self.left_s / 5), 5)} s on an idle machine")
        return ", ".join([*parts, "only once"])


Case = tuple[str, int]
"""An experiment's name, and the number of one of its `compiling.cases`."""


class Schedule:
    """The cases of all experiments: waiting, running, or done; their number is known once an experiment has begun."""

    def __init__(self, names: Iterable[str]) -> None:
        self._waiting: list[Case] = [(name, 0) for name in names]
        self._running: Counter[str] = Counter()
        self._preferred = ""
        self._cleared = False

    def __bool__(self) -> bool:
        """Whether anything is waiting."""
        return bool(self._waiting)

    def on_begin(self, name: str, count: int) -> None:
        """Add the cases of an experiment whose first one is running; after `clear` none are added."""
        if not self._cleared:
            self._waiting += [(name, number) for number in range(1, count)]

    def prefer(self, name: str) -> None:
        """Have the cases of an experiment run before all others that wait."""
        self._preferred = name

    def take(self, before: str | None) -> Case | None:
        """Return what a process is to run next, if anything waits.

        The preferred experiment comes first, then the first cases of the others, then the experiment that the process
        has begun; then it helps the one with the most waiting cases, from its end.

        Args:
            before: The experiment of what it ran last.
        """
        left = Counter(name for name, _ in self._waiting)

        def place(case: Case) -> tuple[bool, bool, bool, int, int]:
            name, number = case
            in_order = name in (self._preferred, before)
            return name != self._preferred, number != 0, name != before, -left[name], number if in_order else -number

        case = min(self._waiting, key=place, default=None)
        if case is not None:
            self._waiting.remove(case)
            self._running[case[0]] += 1
        return case

    def done(self, name: str) -> bool:
        """Take up that a case of an experiment has run; return whether that was the last of them."""
        self._running[name] -= 1
        return not self._running[name] and all(name != other for other, _ in self._waiting)

    def give_up(self, name: str) -> None:
        """Forget the cases of an experiment that wait."""
        self._waiting = [case for case in self._waiting if case[0] != name]

    def clear(self) -> None:
        """Forget all waiting cases permanently, because reports of an ended process may still be read."""
        self._cleared = True
        self._waiting.clear()


class Warming:
    """Compiles what experiments need, in processes of low priority.

    It may be read and ended from any thread.
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
            names: Names of the experiments, in the order in which they are needed.
            processes: Number of processes at once; by default one per processor.
            told: Called with the progress after every report, by one thread at a time.
            compile_case: Does it, in those processes.
            low_priority: Whether other processes come first, as they should if no user waits.
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
        self._left_s: float | None = None
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
        """The present progress."""
        with self._lock:
            return Progress(
                len(self._done),
                self._total,
                frozenset(self._usable),
                frozenset(self._ready),
                dict(self._failed),
                dict(self._seconds),
                (self._ended or time.monotonic()) - self._begun,
                self._left_s,
                self._ready | self._failed.keys() >= self._all,
            )

    def prefer(self, name: str) -> None:
        """Compile an experiment before the others, since a user waits for it."""
        with self._lock:
            self._schedule.prefer(name)

    def wait(self) -> Progress:
        """Wait until all is done, and return what came of it."""
        self._over.wait()
        return self.progress

    def stop(self) -> None:
        """End the processes; compiled code remains."""
        with self._lock:
            self._schedule.clear()
        self._pool.close()
        self._over.set()

    def _hand_out(self, before: str | None) -> None:
        """Give cases to idle processes; when there are no more, let all of them end.

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
                self._estimate()
            self._tell()

    def _estimate(self) -> None:
        """Return the remaining time, by processor time, which other work does not stretch; the estimate never rises."""
        if len(self._seconds) >= LEAST and self._total:
            each_s = sum(self._seconds.values()) / len(self._seconds)
            left_s = each_s * max(self._total - len(self._done), 1) / self._pool.processes
            self._left_s = left_s if self._left_s is None else min(left_s, self._left_s)

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
