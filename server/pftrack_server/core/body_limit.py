"""Bodies: a request that takes no files is small, and every body comes without long pauses; otherwise it is cut off."""

import asyncio
from collections.abc import MutableMapping
from http import HTTPStatus
from typing import Any

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LIMIT = "pftrack.body_limit"
CLOSING = {"Connection": "close"}
SILENCE_S = 30.0
"""Time without a byte of an unfinished body after which its connection is given up."""


class BodyLimit:
    """ASGI middleware that limits bodies; routes that take files lift the limit and have one of their own.

    Args:
        app: What comes behind it; it answers an `HTTPException`, which FastAPI lets through while it reads a body.
        most_bytes: Of a body.
        silence_s: Time without a byte after which an unfinished one is given up.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, silence_s: float = SILENCE_S) -> None:
        self._app = app
        self._most_bytes = most_bytes
        self._silence_s = silence_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count a request's bytes while they come."""
        if scope["type"] == "http":
            scope[LIMIT] = self._most_bytes
            receive = self._counting(scope, receive)
        await self._app(scope, receive, send)

    def _counting(self, scope: Scope, receive: Receive) -> Receive:
        announced = Headers(scope=scope).get("content-length", "")
        come, ended = 0, False

        def check(total: int) -> None:
            if scope[LIMIT] is not None and total > scope[LIMIT]:
                message = f"The body of a request may have at most {scope[LIMIT]} bytes"
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message, CLOSING)

        async def receive_counted() -> Message:
            nonlocal come, ended
            check(int(announced) if announced.isdecimal() else 0)
            try:
                message = await (receive() if ended else asyncio.wait_for(receive(), self._silence_s))
            except TimeoutError:
                told = f"The body of a request may not pause for {self._silence_s:g} s"
                raise HTTPException(HTTPStatus.REQUEST_TIMEOUT, told, CLOSING) from None
            come += len(message.get("body", b""))
            ended = not message.get("more_body", False)
            check(come)
            return message

        return receive_counted


def lift_limit(scope: MutableMapping[str, Any]) -> None:
    """Let a request have a body of any size, before anything of it is read; its handler counts for itself."""
    scope[LIMIT] = None
