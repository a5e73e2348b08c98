"""The process that computes a sweep, measures one, or reports on it, as the server sees it.

A sweep gives way to sessions, which people watch; for an estimate or a report somebody waits.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pftrack.process import UNLIMITED, Ending, Refusal, Reply, Worker, run_task
from pftrack.sweep import work
from pftrack.sweep.axis import SweepError
from pftrack_server.core.errors import UnavailableError
from pftrack_server.core.processes import FORK_SERVER

NICENESS = 10
REFUSALS = SweepError, OSError


async def start(file_bytes: int, memory_bytes: int | None = None) -> Worker:
    """Fork a process that can compute a sweep with a pool of its own.

    Args:
        file_bytes: Length of any file that it writes.
        memory_bytes: What it, and each process of its pool, may take; None for any.
    """
    budget = replace(UNLIMITED, file_bytes=file_bytes, memory_bytes=memory_bytes, niceness=NICENESS)
    # The pool's fork server is forked before the process has a thread.
    return await Worker.start(FORK_SERVER, budget, refusals=REFUSALS, as_json=True, prepare=work.prepare)


async def ask(function: Callable[..., Any], *arguments: object, patience_s: float, file_bytes: int = 0) -> Any:  # noqa: ANN401 - whatever it returns
    """Return the answer of a short task.

    Args:
        function: One of `functions`.
        arguments: For it.
        patience_s: How long it may take.
        file_bytes: Length of any file that it writes.

    Raises:
        UnavailableError: It took too long or failed.
    """
    budget = replace(UNLIMITED, silence_s=patience_s, file_bytes=file_bytes)
    match await run_task(FORK_SERVER, function, *arguments, budget=budget, refusals=REFUSALS):
        case Reply(value=value):
            return value
        case Refusal(message=message):
            raise UnavailableError(message)
        case Ending.OUT_OF_TIME:
            raise UnavailableError(f"This took longer than {patience_s:g} s and was stopped.")
        case _:
            raise UnavailableError("This could not be computed.")
