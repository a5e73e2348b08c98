"""The stream: what happens in a session, told as it happens."""

import asyncio
import contextlib

from fastapi import APIRouter, WebSocket

from server.api.dependencies import TheServices
from server.errors import ApiError
from server.schemas.messages import Pong, encode
from server.sessions.session import Session
from server.stream.duplex import GONE, converse

__all__ = ["router"]

router = APIRouter()


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
        try:
            await converse(
                websocket, listener, lambda sent: listener.put(encode(Pong(sent=sent))), "The session was ended."
            )
        finally:
            waking.cancel()
            await asyncio.gather(waking, return_exceptions=True)


async def _wake(services: TheServices, session: Session) -> None:
    """Let a suspended session go on, since somebody is here again."""
    if session.phase == "suspended":
        with contextlib.suppress(ApiError):
            await asyncio.shield(services.manager.resume(session))
