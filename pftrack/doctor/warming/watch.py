"""Watching this process compile."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event

from pftrack.core.numerics.compiled import FUNCTIONS

__all__ = ["name_of", "watch"]


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
