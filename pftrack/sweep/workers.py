"""Workers: whoever computes for the driver, here or elsewhere.

The driver hands out tasks by number, as many as there are free workers, and takes back what is done. A worker that is
lost gives its task back; the driver decides whether it is tried again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from pftrack.sweep.recording import Recording

__all__ = ["Done", "Workers"]


@dataclass(frozen=True, slots=True)
class Done:
    """What became of a task.

    Attributes:
        number: Of the task.
        value: What it returned.
        lost: How its worker was lost, in words, or empty.
    """

    number: int
    value: Any = None
    lost: str = ""


class Workers(Protocol):
    """A pool of processes or a cluster."""

    def free(self) -> int:
        """Return how many more tasks can be given out without keeping them waiting for long."""

    def share(self, recording: Recording | None) -> object:
        """Return what tasks are given in the place of a recording of this machine, so that all workers have it."""

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give out a task: a function of a module and plain values.

        Raises:
            SweepError: There is nobody to take it any more.
        """

    def collect(self, timeout_s: float) -> list[Done]:
        """Return what was done since the last call, after waiting for something at most so long.

        Raises:
            SweepError: A task failed, or all workers are gone.
        """

    def close(self) -> None:
        """Let all workers go, whatever they are doing."""
