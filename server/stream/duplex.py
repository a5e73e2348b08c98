"""Duplex: the two halves of a stream to a page, what is told and what is answered, the same for sessions and sweeps."""

import asyncio
import contextlib
from collections.abc import AsyncIterable, Callable

from fastapi import WebSocket, WebSocketDisconnect

from server.schemas.messages import ping

__all__ = ["GONE", "converse"]

GONE = 4404
UNKNOWN_WORD = 1003
SLOWEST_LISTENER_S = 30.0


async def converse(
    websocket: WebSocket, texts: AsyncIterable[str], answer: Callable[[float], None], farewell: str
) -> None:
    """Tell a page everything that comes, and answer its pings, until one of the two leaves.

    Args:
        websocket: To the page, accepted.
        texts: What to tell; it ends when there is nothing more to come.
        answer: Called with the time of each ping.
        farewell: Why it ended.
    """
    telling = asyncio.ensure_future(_tell(websocket, texts, farewell))
    try:
        await _listen(websocket, answer)
    finally:
        telling.cancel()
        await asyncio.gather(telling, return_exceptions=True)


async def _tell(websocket: WebSocket, texts: AsyncIterable[str], farewell: str) -> None:
    async for text in texts:
        # A peer that takes nothing for so long is gone, whatever its TCP connection pretends.
        async with asyncio.timeout(SLOWEST_LISTENER_S):
            await websocket.send_text(text)
    await websocket.close(GONE, farewell)


async def _listen(websocket: WebSocket, answer: Callable[[float], None]) -> None:
    """Answer pings until the page leaves or says something else."""
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            try:
                answer(ping(message.get("text") or "").sent)
            except ValueError:
                await websocket.close(UNKNOWN_WORD, "The stream takes nothing but pings; use the REST interface.")
                return
