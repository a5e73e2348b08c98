"""Calls: what a parent asks its children to compute, and what comes back.

A child answers one call after the other until its parent hangs up. Below the first call it gives up what it does not
need, since the arguments may name what came from elsewhere. A function that takes long is a generator that yields how
far it is, or calls `report`; what it returns is the value of the call.
"""

import math
import signal
import socket
import time
import traceback
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeAlias

from pftrack.process.child import Ending
from pftrack.process.limits import MEBIBYTE, Budget, confine, give_way, leave_interrupts_to_parent, stand_alone
from pftrack.process.pipe import BlockingEnd, Pack

TELL_S = 0.2
GRACE_S = 5.0
"""So long after the parent should have ended a silent child that child ends itself."""
LONGEST_TRACEBACK = 4000


@dataclass(frozen=True, slots=True)
class Call:
    """A function of a module to call, and what with."""

    function: Callable[..., Any]
    arguments: tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Step:
    """How far a call is: the pair of what is done and all that there is, or what has been found."""

    value: Any


@dataclass(frozen=True, slots=True)
class Reply:
    """What a call came to."""

    value: Any


@dataclass(frozen=True, slots=True)
class Refusal:
    """The function refused its arguments.

    Attributes:
        message: Why, for a person.
        error: The exception, where answers are pickled.
    """

    message: str
    error: Exception | None = None


@dataclass(frozen=True, slots=True)
class Fault:
    """The function failed in a way that nobody has foreseen.

    Attributes:
        name: Of the exception, with its message.
        traceback: For the log.
    """

    name: str
    traceback: str


Answer: TypeAlias = Step | Reply | Refusal | Fault
"""What a child sends."""

Outcome: TypeAlias = Reply | Refusal | Fault | Ending
"""What comes of a call: an answer, or how the child ended without one."""

_report: Callable[[object], None] = lambda _: None  # noqa: E731 - what `report` does outside of a child


def report(value: object) -> None:
    """Tell how far the call is that this process carries out; in a process that carries out none, do nothing."""
    _report(value)


def answer_calls(
    end: socket.socket,
    budget: Budget,
    refusals: tuple[type[Exception], ...] = (),
    pack: Pack | None = None,
    prepare: Callable[[], object] | None = None,
) -> None:
    """Answer calls until the parent hangs up, as a confined child.

    Args:
        end: The child's end of the pipe.
        budget: What it may take.
        refusals: Exceptions by which functions refuse their arguments; all others are faults.
        pack: Writes an answer, as the parent reads it; pickles if not given.
        prepare: Is called before the first call.
    """
    leave_interrupts_to_parent()
    confine(
        memory_bytes=budget.memory_bytes,
        cpu_seconds=budget.cpu_seconds,
        file_bytes=budget.file_bytes,
        open_files=budget.open_files,
    )
    stand_alone(end.fileno())
    if budget.niceness:
        give_way(budget.niceness)
    if prepare is not None:
        prepare()
    pipe = BlockingEnd(end) if pack is None else BlockingEnd(end, pack)
    try:
        while True:
            try:
                call = pipe.receive()
            except (EOFError, ConnectionResetError):
                return
            except Exception as error:  # noqa: BLE001 - a module that cannot be imported is the function's fault
                pipe.send(_fault(error))
                continue
            _answer(pipe, call, budget, refusals)
    except (BrokenPipeError, ConnectionResetError):
        return


def _answer(pipe: BlockingEnd, call: Call, budget: Budget, refusals: tuple[type[Exception], ...]) -> None:
    global _report  # noqa: PLW0603 - a process carries out one call at a time

    def tell(value: object) -> None:
        pipe.send(Step(value))
        _live(budget)

    _report = tell
    _live(budget)
    try:
        result = call.function(*call.arguments)
        answer: Reply | Refusal | Fault = Reply(_exhaust(result, tell) if isinstance(result, Generator) else result)
    except (BrokenPipeError, ConnectionResetError):
        raise
    except refusals as error:
        answer = Refusal(str(error), error)
    except MemoryError:
        most = budget.memory_bytes
        allowed = "there is" if most is None else f"the {most // MEBIBYTE} MiB that it may use"
        answer = Refusal(f"this needs more memory than {allowed}")
    except Exception as error:  # noqa: BLE001 - told, and the next call may be a better one
        answer = _fault(error)
    signal.alarm(0)
    try:
        pipe.send(answer)
    except (BrokenPipeError, ConnectionResetError):
        raise
    except Exception as error:  # noqa: BLE001 - what cannot be written is the function's fault
        pipe.send(_fault(error))


def _fault(error: Exception) -> Fault:
    return Fault(f"{type(error).__name__}: {error}", traceback.format_exc()[-LONGEST_TRACEBACK:])


def _live(budget: Budget) -> None:
    """Begin to count the time without a sign of life anew."""
    if budget.silence_s is not None:
        signal.alarm(math.ceil(budget.silence_s + GRACE_S))


def _exhaust(steps: Generator[object, None, Any], tell: Callable[[object], None]) -> object:
    """Go through the steps of a call, tell of them now and then, and return its result."""
    told = time.monotonic()
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        if time.monotonic() - told > TELL_S:
            tell(step)
            told = time.monotonic()
