"""Which process runs which case next, so that all of them have something to do until everything is done.

The first case of an experiment is how it is by default, which is all that its session needs to begin. So the first
cases of all come before the others, and before them what somebody waits for.

Two processes that need the same function at the same time both compile it. Cases that follow one another call much the
same functions, so then a process stays with the experiment that it has begun; when that has no more, it helps another
from its end, where other things are chosen than in the beginning.
"""

from collections import deque
from collections.abc import Iterable

Case = tuple[str, int]
"""An experiment's name, and the number of one of its `coverage.cases`."""


class Schedule:
    """The cases of all experiments: waiting, running, or done. How many an experiment has is told when it is begun."""

    def __init__(self, names: Iterable[str]) -> None:
        self._new = deque(names)
        self._waiting: dict[str, deque[int]] = {}
        self._running: dict[str, int] = {}
        self._preferred = ""
        self._cleared = False

    def __bool__(self) -> bool:
        """Whether anything is waiting."""
        return bool(self._new) or any(self._waiting.values())

    def on_begin(self, name: str, count: int) -> None:
        """Take up how many cases there are of an experiment whose first is running; after `clear` none are taken up."""
        if not self._cleared:
            self._waiting[name] = deque(range(1, count))

    def prefer(self, name: str) -> None:
        """Have the cases of an experiment run before all others that wait."""
        self._preferred = name
        if name in self._new:
            self._new.remove(name)
            self._new.appendleft(name)

    def take(self, before: str | None) -> Case | None:
        """Return what a process is to run next, if anything waits.

        Args:
            before: The experiment of what it ran last.
        """
        fullest = max(self._waiting, key=lambda name: len(self._waiting[name]), default=None)
        if self._waiting.get(self._preferred):
            case = (self._preferred, self._waiting[self._preferred].popleft())
        elif self._new:  # what is preferred is the first of them
            case = (self._new.popleft(), 0)
        elif before is not None and self._waiting.get(before):
            case = (before, self._waiting[before].popleft())
        elif fullest is not None and self._waiting[fullest]:
            case = (fullest, self._waiting[fullest].pop())
        else:
            return None
        self._running[case[0]] = self._running.get(case[0], 0) + 1
        return case

    def done(self, name: str) -> bool:
        """Take up that a case of an experiment has run; return whether that was the last of them."""
        self._running[name] -= 1
        return not self._running[name] and not self._waiting.get(name)

    def give_up(self, name: str) -> None:
        """Forget the cases of an experiment that wait."""
        self._waiting.pop(name, None)

    def clear(self) -> None:
        """Forget all that waits, for good: what a process said before it was ended may still be read."""
        self._cleared = True
        self._new.clear()
        self._waiting.clear()
