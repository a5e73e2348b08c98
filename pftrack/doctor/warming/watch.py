"""What a process does that compiles: it runs a case of an experiment, and tells what it has compiled on the way.

Each piece of news is a dictionary: `{"begun": EXPERIMENT, "cases": 12, "total": 81}` before the first case of one, with
the number of all functions that there are, and `{"function": NAME, "seconds": S}` for what it has compiled.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.doctor.warming.coverage import cases, run_case
from pftrack.experiments import EXPERIMENTS
from pftrack.process import report


class _Watch(event.Listener):
    def __init__(self, begun: Callable[[str], None], ended: Callable[[str, float], None]) -> None:
        self._begun, self._ended = begun, ended
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:  # noqa: ANN401 - numba's
        """Begin to measure."""
        self._open.append([time.perf_counter(), 0.0])
        if (name := _ours(event)) is not None:
            self._begun(name)

    def on_end(self, event: Any) -> None:  # noqa: ANN401 - numba's
        """Tell how long it took, less what it called."""
        begun, inside = self._open.pop()
        whole = time.perf_counter() - begun
        if self._open:
            self._open[-1][1] += whole
        if (name := _ours(event)) is not None:
            self._ended(name, whole - inside)


@contextmanager
def watch(begun: Callable[[str], None], ended: Callable[[str, float], None]) -> Iterator[None]:
    """Tell of every function of ours that this process compiles.

    Args:
        begun: Is called with its name.
        ended: Is called with its name and how long it took without the functions that it calls, s.
    """
    with event.install_listener("numba:compile", _Watch(begun, ended)):
        yield


def name_of(dispatcher: Any) -> str:  # noqa: ANN401 - numba's
    """Return a function's name with its module's."""
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"


def _ours(event: Any) -> str | None:  # noqa: ANN401 - numba's
    dispatcher = event.data["dispatcher"]
    return name_of(dispatcher) if any(dispatcher is ours for ours in FUNCTIONS) else None


def compile_case(name: str, number: int) -> list[str]:
    """Run one of the `coverage.cases` of an experiment, and return the names of all that is compiled by then."""
    every = tuple(cases(EXPERIMENTS[name]))
    if number == 0:
        report({"begun": name, "cases": len(every), "total": len(FUNCTIONS)})
    with watch(lambda _: None, lambda function, seconds: report({"function": function, "seconds": round(seconds, 3)})):
        run_case(EXPERIMENTS[name], *every[number])
    return [name_of(it) for it in FUNCTIONS if it.signatures]
