"""Bodies: a request that is no upload is small, and is cut off when it is not."""

import contextlib

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server import errors

__all__ = ["BodyLimit"]

MULTIPART = "multipart/form-data"
TOO_LARGE = 413


class _TooLargeError(Exception):
    """More came than was announced or is allowed."""


class BodyLimit:
    """ASGI middleware that limits the body of everything but uploads, which have limits of their own."""

    def __init__(self, app: ASGIApp, most_bytes: int) -> None:
        self._app = app
        self._most_bytes = most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count a request's bytes while they come."""
        headers = Headers(scope=scope) if scope["type"] == "http" else None
        if headers is None or headers.get("content-type", "").lower().startswith(MULTIPART):
            await self._app(scope, receive, send)
            return
        announced = headers.get("content-length", "")
        if announced.isdigit() and int(announced) > self._most_bytes:
            await self._refuse(scope, receive, send)
            return
        total = 0
        too_large = answered = False

        async def counted() -> Message:
            nonlocal total, too_large
            message = await receive()
            total += len(message.get("body", b""))
            if total > self._most_bytes:
                too_large = True
                raise _TooLargeError
            return message

        async def noted(message: Message) -> None:
            nonlocal answered
            # FastAPI takes any exception while it reads for a body that does not parse; ours is the better answer.
            if not too_large:
                answered = True
                await send(message)

        with contextlib.suppress(_TooLargeError):
            await self._app(scope, counted, noted)
        if too_large and not answered:
            await self._refuse(scope, receive, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send) -> None:
        message = f"The body of a request may have at most {self._most_bytes} bytes"
        answer = errors.response(TOO_LARGE, errors.shape(message), {"Connection": "close"})
        await answer(scope, receive, send)
