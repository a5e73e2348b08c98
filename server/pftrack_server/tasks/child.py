"""The child of a task: a fork of the forkserver that gives up what it does not need, computes, and answers once.

It has no network, holds nothing open but the pipe of its answer, and says nothing elsewhere, since a file may decide
what a decoder prints. What is wrong with the program itself travels in the answer, to the server's log.
"""

import math
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

from pftrack.comparison import ComparisonError
from pftrack.model.export import ExportError
from pftrack.model.parameters import ParameterError
from pftrack.process import confine, leave_interrupts_to_parent, stand_alone
from pftrack.runs.record import RecordError
from pftrack.sources.sequence import SourceError
from pftrack.sources.truth import TruthError
from pftrack_server.tasks.answers import pack
from pftrack_server.worker.pipe import WorkerEnd
from pftrack_server.worker.protocol import Failed, Reply, Step, UnexpectedError

__all__ = ["MEBIBYTE", "Budget", "main"]

MEBIBYTE = 1024**2
OPEN_FILES = 64
TELL_S = 0.2
GRACE_S = 5.0
"""So long after the web process should have ended a silent child that child ends itself."""
LONGEST_TRACEBACK = 4000


@dataclass(frozen=True, slots=True)
class Budget:
    """What a task may take.

    Attributes:
        memory_bytes: Address space on top of what is forked with it.
        cpu_seconds: Processor time.
        silence_s: How long it may give no sign of life.
        file_bytes: Length of any file that it writes; None for any.
        answer_bytes: Length of its answer.
    """

    memory_bytes: int = 1024 * MEBIBYTE
    cpu_seconds: float = 30.0
    silence_s: float = 30.0
    file_bytes: int | None = None
    answer_bytes: int = 64 * MEBIBYTE


def main(end: socket.socket, function: Callable[..., Any], arguments: tuple[object, ...], budget: Budget) -> None:
    """Carry out one task in a confined process and send its result."""
    from pftrack_server.worker.preload import assert_preloaded  # noqa: PLC0415 - the preload imports this module

    assert_preloaded()
    leave_interrupts_to_parent()
    confine(
        memory_bytes=budget.memory_bytes,
        cpu_seconds=budget.cpu_seconds,
        wall_seconds=budget.silence_s + GRACE_S,
        file_bytes=budget.file_bytes,
        open_files=OPEN_FILES,
    )
    stand_alone(end.fileno())
    pipe = WorkerEnd(end, pack)
    try:
        result = function(*arguments)
        pipe.send(Reply(0, _followed(pipe, result, budget) if isinstance(result, Generator) else result))
    except (ComparisonError, ExportError, SourceError, ParameterError, TruthError, RecordError) as error:
        pipe.send(Failed(str(error)))
    except BrokenPipeError:
        return
    except Exception:  # noqa: BLE001 - reported as a process that died
        pipe.send(UnexpectedError(traceback.format_exc()[-LONGEST_TRACEBACK:]))
        sys.exit(1)


def _followed(pipe: WorkerEnd, steps: Generator[tuple[int, int], None, dict[str, Any]], budget: Budget) -> object:
    """Go through the steps of a task, tell of them now and then, and return its result."""
    told = time.monotonic()
    while True:
        try:
            done, total = next(steps)
        except StopIteration as end:
            return end.value
        if time.monotonic() - told > TELL_S:
            pipe.send(Step(done, total))
            told = time.monotonic()
            signal.alarm(math.ceil(budget.silence_s + GRACE_S))
