"""Answers as JSON, for a child that reads what came from elsewhere.

A file may have taken that process over. A pickle from it would run in its parent whatever it liked; of JSON the worst
that can come is a wrong value. Bytes stand in it as an object of one field: base64, under a name that is drawn for each
answer and begins it, so that no value of a file can be taken for them.
"""

import base64
import json
import secrets
from collections.abc import Callable
from typing import Any

import numpy as np

from pftrack.process.calls import Answer, Fault, Refusal, Reply, Step

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
