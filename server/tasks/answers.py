"""Answers: what the process of a task says to the web process, as JSON.

An uploaded file may have taken that process over. A pickle from it would run in the web process whatever it liked; of
JSON the worst that can come is a wrong value. Pictures are in it as base64.
"""

import base64
import json
from typing import Any

import numpy as np

from server.worker.protocol import Event, Failed, Mistake, Reply, Step

__all__ = ["pack", "unpack"]

BYTES = "base64"


def pack(event: Event) -> bytes:
    """Write an event of a task.

    Raises:
        TypeError: It is none, or its result holds what JSON and bytes cannot say.
    """
    match event:
        case Reply(result=result):
            body: dict[str, object] = {"result": result}
        case Failed(message=message):
            body = {"failed": message}
        case Mistake(traceback=traceback):
            body = {"mistake": traceback}
        case Step(done=done, total=total):
            body = {"done": done, "total": total}
        case _:
            raise TypeError(f"a task answers with a reply, a refusal, a mistake or a step, not {type(event).__name__}")
    return json.dumps(body, default=_encoded).encode()


def unpack(data: bytes | bytearray) -> Event:
    """Read what `pack` wrote; lists stand for tuples.

    Raises:
        ValueError: It is something else.
    """
    try:
        body = json.loads(data, object_hook=_decoded)
    except RecursionError:
        raise ValueError("the answer is nested too deeply") from None
    match body:
        case {"result": result, **others} if not others:
            return Reply(0, result)
        case {"failed": str(message), **others} if not others:
            return Failed(message)
        case {"mistake": str(traceback), **others} if not others:
            return Mistake(traceback)
        case {"done": int(done), "total": int(total), **others} if not others:
            return Step(done, total)
    raise ValueError("the answer is neither a reply nor a refusal, a mistake or a step")


def _encoded(value: object) -> object:
    if isinstance(value, bytes):
        return {BYTES: base64.b64encode(value).decode()}
    if isinstance(value, np.generic):  # a measure of an experiment of another package may be one
        return value.item()
    raise TypeError(f"a task's result may hold what JSON can say, and bytes, not {type(value).__name__}")


def _decoded(value: dict[str, Any]) -> object:
    if value.keys() == {BYTES} and isinstance(value[BYTES], str):
        return base64.b64decode(value[BYTES])
    return value
