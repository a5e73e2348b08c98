"""Bodies: a request that takes no files is small, and every body comes without long pauses; otherwise it is cut off."""

import asyncio
import contextlib
from collections.abc import MutableMapping
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack_server.core import errors

LIMIT = "pftrack.body_limit"
TOO_LARGE, TOO_SLOW = 413, 408
SILENCE_S = 30.0
"""Time without a byte of an unfinished body after which its connection is given up."""


class _CutOffError(errors.ApiError):
    """A body was cut off."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class BodyLimit:
    """ASGI middleware that limits bodies; routes that take files lift the limit and have one of their own.

    Args:
        app: What comes behind it.
        most_bytes: Of a body.
        silence_s: Time without a byte after which an unfinished one is given up.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, silence_s: float = SILENCE_S) -> None:
        self._app = app
        self._most_bytes = most_bytes
        self._silence_s = silence_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count a request's bytes while they come."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        announced = Headers(scope=scope).get("content-length", "")
        scope[LIMIT] = self._most_bytes
        total = int(announced) if announced.isdecimal() else 0
        come = 0
        ended = answered = False
        refusal: _CutOffError | None = None

        async def count_received() -> Message:
            nonlocal come, ended, refusal
            try:
                self._check(scope, max(total, come))
                message = await (receive() if ended else asyncio.wait_for(receive(), self._silence_s))
                come += len(message.get("body", b""))
                ended = not message.get("more_body", False)
                self._check(scope, max(total, come))
            except TimeoutError:
                refusal = _CutOffError(TOO_SLOW, f"The body of a request may not pause for {self._silence_s:g} s")
                raise refusal from None
            except _CutOffError as error:
                refusal = error
                raise
            return message

        async def note_start(message: Message) -> None:
            nonlocal answered
            # FastAPI takes any exception while it reads for a body that does not parse; ours is the better answer.
            if refusal is None:
                answered = True
                await send(message)

        with contextlib.suppress(_CutOffError):
            await self._app(scope, count_received, note_start)
        if refusal is not None and not answered:
            answer = errors.response(refusal.status, errors.detail_of(refusal), {"Connection": "close"})
            await answer(scope, receive, send)

    def _check(self, scope: Scope, total: int) -> None:
        most = scope[LIMIT]
        if most is not None and total > most:
            raise _CutOffError(TOO_LARGE, f"The body of a request may have at most {most} bytes")


def lift_limit(scope: MutableMapping[str, Any]) -> None:
    """Let a request have a body of any size, before anything of it is read; its handler counts for itself."""
    scope[LIMIT] = None
