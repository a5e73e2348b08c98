"""The stream: what happens in a session, told as it happens."""

import asyncio
import contextlib

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from server.api.dependencies import TheServices
from server.errors import ApiError
from server.sessions.listeners import Listener
from server.sessions.messages import Pong, encode, ping
from server.sessions.session import Session

__all__ = ["router"]

router = APIRouter()

GONE = 4404
UNKNOWN_WORD = 1003
SLOWEST_LISTENER_S = 30.0


@router.websocket("/sessions/{session}/stream")
async def stream(websocket: WebSocket, session: str, services: TheServices) -> None:
    """Greet a page, then tell it everything that happens until one of the two leaves."""
    found = services.manager.find(session)
    await websocket.accept()
    if found is None:
        await websocket.close(GONE, "There is no such session; it may have been ended.")
        return
    with found.listeners.join() as listener:
        waking = asyncio.ensure_future(_wake(services, found))
        telling = asyncio.ensure_future(_tell(websocket, listener))
        try:
            await _listen(websocket, listener)
        finally:
            for task in (waking, telling):
                task.cancel()
            await asyncio.gather(waking, telling, return_exceptions=True)


async def _wake(services: TheServices, session: Session) -> None:
    """Let a suspended session go on, since somebody is here again."""
    if session.state == "suspended":
        with contextlib.suppress(ApiError):
            await asyncio.shield(services.manager.resume(session))


async def _tell(websocket: WebSocket, listener: Listener) -> None:
    async for text in listener:
        # A peer that takes nothing for so long is gone, whatever its TCP connection pretends.
        async with asyncio.timeout(SLOWEST_LISTENER_S):
            await websocket.send_text(text)
    await websocket.close(GONE, "The session was ended.")


async def _listen(websocket: WebSocket, listener: Listener) -> None:
    """Answer pings until the page leaves or says something else."""
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            try:
                said = ping(message.get("text") or "")
            except ValueError:
                await websocket.close(UNKNOWN_WORD, "The stream takes nothing but pings; use the REST interface.")
                return
            listener.put(encode(Pong(sent=said.sent)))
