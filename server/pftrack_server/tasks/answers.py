"""Answers: what the process of a task says to the web process, as JSON.

An uploaded file may have taken that process over. A pickle from it would run in the web process whatever it liked; of
JSON the worst that can come is a wrong value. Bytes stand in it as an object of one field: base64, under a name that is
drawn for each answer and begins it, so that no value of a file can be taken for them.
"""

import base64
import json
import secrets
from collections.abc import Callable
from typing import Any

import numpy as np

from pftrack_server.worker.protocol import Event, Failed, Reply, Step, UnexpectedError

__all__ = ["pack", "unpack"]

TAG_LENGTH = 16


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
        case UnexpectedError(traceback=traceback):
            body = {"mistake": traceback}
        case Step(done=done, total=total):
            body = {"done": done, "total": total}
        case _:
            raise TypeError(f"a task answers with a reply, a refusal, a mistake or a step, not {type(event).__name__}")
    tag = secrets.token_hex(TAG_LENGTH // 2)
    return f"{tag}{json.dumps(body, default=_encoder(tag))}".encode()


def unpack(data: bytes | bytearray) -> Event:
    """Read what `pack` wrote; lists stand for tuples.

    Raises:
        ValueError: It is something else.
    """
    text = data.decode()
    try:
        body = json.loads(text[TAG_LENGTH:], object_hook=_decoder(text[:TAG_LENGTH]))
    except RecursionError:
        raise ValueError("the answer is nested too deeply") from None
    match body:
        case {"result": result, **others} if not others:
            return Reply(0, result)
        case {"failed": str(message), **others} if not others:
            return Failed(message)
        case {"mistake": str(traceback), **others} if not others:
            return UnexpectedError(traceback)
        case {"done": int(done), "total": int(total), **others} if not others:
            return Step(done, total)
    raise ValueError("the answer is neither a reply nor a refusal, a mistake or a step")


def _encoder(tag: str) -> Callable[[object], object]:
    def encoded(value: object) -> object:
        if isinstance(value, bytes):
            return {tag: base64.b64encode(value).decode()}
        if isinstance(value, np.generic):  # a measure of an experiment of another package may be one
            return value.item()
        raise TypeError(f"a task's result may hold what JSON can say, and bytes, not {type(value).__name__}")

    return encoded


def _decoder(tag: str) -> Callable[[dict[str, Any]], object]:
    def decoded(value: dict[str, Any]) -> object:
        return base64.b64decode(str(value[tag])) if value.keys() == {tag} else value

    return decoded
