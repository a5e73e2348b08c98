"""The worker of lessons: a fork of the forkserver that computes a figure, answers, and waits for the next.

It lives on, since a fork for each move of a slider would take longer than most figures do. It has no network and limits
of memory, and the web process ends it when it takes too long.
"""

import os
import socket
import traceback

from pftrack.lessons.lecturers.expression import ExpressionError
from pftrack.model.parameters import ParameterError
from pftrack.process import confine, leave_interrupts_to_parent, stand_alone
from pftrack_server.worker.pipe import WorkerEnd
from pftrack_server.worker.protocol import Call, Event, Failed, Reply, UnexpectedError

__all__ = ["main"]

MEMORY_BYTES = 1 << 30
OPEN_FILES = 64
NICENESS = 3
"""As a session's: whoever serves everybody goes first."""
WAIT_S = 3600.0
LONGEST_TRACEBACK = 4000


def main(end: socket.socket) -> None:
    """Call what the web process asks for until it hangs up."""
    from pftrack_server.worker.preload import assert_preloaded  # noqa: PLC0415 - the preload imports this module

    assert_preloaded()
    leave_interrupts_to_parent()
    os.nice(NICENESS)
    confine(memory_bytes=MEMORY_BYTES, open_files=OPEN_FILES)
    stand_alone(end.fileno())
    pipe = WorkerEnd(end)
    try:
        while True:
            message = pipe.receive(WAIT_S)
            if isinstance(message, Call):
                pipe.send(_answer(message))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _answer(call: Call) -> Event:
    try:
        return Reply(0, call.function(*call.arguments))
    except ParameterError as error:
        return Reply(0, error=error)
    except ExpressionError as error:
        return Failed(f"The answer of this lesson cannot be computed: {error}.")
    except MemoryError:
        return Failed(f"This needs more than the {MEMORY_BYTES >> 20} MiB of memory that a lesson may use.")
    except Exception:  # noqa: BLE001 - reported to the log, and the next call may be a better one
        return UnexpectedError(traceback.format_exc()[-LONGEST_TRACEBACK:])
