"""The streams of a session: its events as they happen, and its drawings for flat views."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, WebSocket

from pftrack_server.api.dependencies import TheServices
from pftrack_server.errors import ApiError
from pftrack_server.schemas.messages import parse_painted
from pftrack_server.schemas.snapshot import Phase
from pftrack_server.schemas.stream import ping
from pftrack_server.services import Services
from pftrack_server.sessions.session import Session
from pftrack_server.stream.duplex import GONE, converse

router = APIRouter()


FAREWELL = "The session was ended."


@router.websocket("/sessions/{session}/stream")
async def stream(websocket: WebSocket, session: str, services: TheServices) -> None:
    """Greet a page, then tell it everything that happens until one of the two leaves."""
    found = await _accept(websocket, session, services)
    if found is not None:
        async with _keep_awake(found, services):
            with found.listeners.join() as listener:
                await converse(websocket, listener, lambda text: listener.answer(ping(text).sent), FAREWELL)


@router.websocket("/sessions/{session}/drawings")
async def drawings(websocket: WebSocket, session: str, services: TheServices) -> None:
    """Send a page the newest drawing again and again, as fast as it says that it has painted them."""
    found = await _accept(websocket, session, services)
    if found is not None:
        async with _keep_awake(found, services):
            with found.drawing_feed.join() as watcher:
                await converse(
                    websocket, watcher, lambda text: watcher.acknowledge(parse_painted(text).count), FAREWELL
                )


async def _accept(websocket: WebSocket, name: str, services: Services) -> Session | None:
    """Accept a page and return its session; send it away if there is none."""
    found = services.manager.find(name)
    await websocket.accept()
    if found is None:
        await websocket.close(GONE, "There is no such session; it may have been ended.")
    return found


@asynccontextmanager
async def _keep_awake(session: Session, services: Services) -> AsyncIterator[None]:
    """Have a suspended session go on, since somebody is here again."""
    waking = asyncio.ensure_future(_wake(session, services))
    try:
        yield
    finally:
        waking.cancel()
        await asyncio.gather(waking, return_exceptions=True)


async def _wake(session: Session, services: Services) -> None:
    if session.phase is Phase.SUSPENDED:
        with contextlib.suppress(ApiError):
            await asyncio.shield(services.manager.resume(session))
