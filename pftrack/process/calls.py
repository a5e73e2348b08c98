"""Calls: computations that a parent requests from its children, and the answers.

A child answers one call after the other until its parent hangs up. Below the first call it gives up what it does not
need, since the arguments may name data from elsewhere. A long function is a generator that yields its progress, or
calls `report`; its return value is the value of the call.
"""

import base64
import json
import math
import secrets
import signal
import socket
import time
import traceback
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from pftrack.core.refusal import RefusedError
from pftrack.process.child import BlockingEnd, Ending, Pack
from pftrack.process.limits import MEBIBYTE, Budget, confine, give_way, leave_interrupts_to_parent, stand_alone

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
    """The progress of a call: a pair of finished and total work, or intermediate results."""

    value: Any


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer of a call."""

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
    """The function failed unexpectedly.

    Attributes:
        name: Name of the exception, with its message.
        traceback: For the log.
    """

    name: str
    traceback: str


Answer: TypeAlias = Step | Reply | Refusal | Fault
"""Messages of a child."""

Outcome: TypeAlias = Reply | Refusal | Fault | Ending
"""The result of a call: an answer, or how the child ended without one."""

_report: Callable[[object], None] = lambda _: None  # noqa: E731 - what `report` does outside of a child


def report(value: object) -> None:
    """Report the progress of this process's call; outside of a call, do nothing."""
    _report(value)


def answer_calls(
    end: socket.socket,
    budget: Budget,
    refusals: tuple[type[Exception], ...] = (RefusedError,),
    pack: Pack | None = None,
    prepare: Callable[[], object] | None = None,
) -> None:
    """Answer calls until the parent hangs up, as a confined child.

    Args:
        end: The child's end of the pipe.
        budget: Its limits.
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
    """Run the steps of a call, report them from time to time, and return its result."""
    told = time.monotonic()
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            return end.value
        if time.monotonic() - told > TELL_S:
            tell(step)
            told = time.monotonic()


# A child that reads what came from elsewhere answers in JSON: a file may have taken that process over. A pickle from it
# would run in its parent whatever it liked; of JSON the worst that can come is a wrong value. Bytes are encoded as an
# object of one field: base64, under a random name that begins the answer, so no value of a file can be mistaken for
# them.

TAG_LENGTH = 16


def pack(answer: Answer) -> bytes:
    """Write an answer.

    Raises:
        TypeError: Its value holds what JSON and bytes cannot say, or it is a step that is neither a pair of numbers nor
            a dictionary.
    """
    match answer:
        case Reply(value=value):
            body: dict[str, object] = {"value": value}
        case Refusal(message=message):
            body = {"refusal": message}
        case Fault(name=name, traceback=traceback):
            body = {"fault": name, "traceback": traceback}
        case Step(value=(done, total)):
            body = {"done": done, "total": total}
        case Step(value=dict() as found):
            body = {"found": found}
        case _:
            raise TypeError(f"a step must be a pair of numbers or a dictionary of what has been found, not {answer}")
    tag = secrets.token_hex(TAG_LENGTH // 2)
    return f"{tag}{json.dumps(body, default=_encoder(tag))}".encode()


def unpack(data: bytes | bytearray) -> Answer:
    """Read the result of `pack`; tuples become lists.

    Raises:
        ValueError: It is something else.
    """
    text = data.decode()
    try:
        body = json.loads(text[TAG_LENGTH:], object_hook=_decoder(text[:TAG_LENGTH]))
    except RecursionError:
        raise ValueError("the answer is nested too deeply") from None
    match body:
        case {"value": value, **others} if not others:
            return Reply(value)
        case {"refusal": str(message), **others} if not others:
            return Refusal(message)
        case {"fault": str(name), "traceback": str(traceback), **others} if not others:
            return Fault(name, traceback)
        case {"done": int(done), "total": int(total), **others} if not others:
            return Step((done, total))
        case {"found": dict() as found, **others} if not others:
            return Step(found)
    raise ValueError("the answer is neither a reply nor a refusal, a fault or a step")


def _encoder(tag: str) -> Callable[[object], object]:
    def encode(value: object) -> object:
        if isinstance(value, bytes):
            return {tag: base64.b64encode(value).decode()}
        if isinstance(value, np.generic):  # a measure of an experiment of another package may be one
            return value.item()
        raise TypeError(f"an answer may hold what JSON can say, and bytes, not {type(value).__name__}")

    return encode


def _decoder(tag: str) -> Callable[[dict[str, Any]], object]:
    def decode(value: dict[str, Any]) -> object:
        return base64.b64decode(str(value[tag])) if value.keys() == {tag} else value

    return decode
