"""The stream of a session: what happens to it, and what is seen of it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import APIRouter, WebSocket

from pftrack_server.api.dependencies import TheServices
from pftrack_server.errors import ApiError
from pftrack_server.schemas.snapshot import Phase
from pftrack_server.services import Services
from pftrack_server.sessions.session import Session
from pftrack_server.stream.duplex import GONE, converse

router = APIRouter()


FAREWELL = "The session was ended."


@router.websocket("/sessions/{session}/stream")
async def stream(
    websocket: WebSocket, session: str, services: TheServices, *, paints: bool = False, has_picture: bool = False
) -> None:
    """Greet a page, then tell it everything that happens until one of the two leaves.

    Args:
        websocket: To the page.
        session: Its name.
        services: Where the session is found.
        paints: Whether the page is sent drawings, each with what was told up to it, as fast as it paints them.
        has_picture: Whether it shows a drawing of an earlier connection, so that the greeting comes with the next one.
    """
    found = services.manager.find(session)
    await websocket.accept()
    if found is None:
        await websocket.close(GONE, "There is no such session; it may have been ended.")
        return
    async with _keep_awake(found, services):
        with found.stream.join(paints=paints, has_picture=has_picture) as page:
            await converse(websocket, page, FAREWELL, page.note_painted)


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
