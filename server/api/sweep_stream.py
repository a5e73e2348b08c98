"""The stream of a sweep: its map as it fills, and how far it is."""

import asyncio
import contextlib
from http import HTTPStatus

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from pftrack.sweep import SweepError
from server.api.dependencies import TheServices
from server.errors import ApiError
from server.sessions.messages import ping
from server.sweeps.listeners import Listener

__all__ = ["router"]

router = APIRouter()

GONE = 4404
REFUSED = 4422
UNKNOWN_WORD = 1003
SLOWEST_LISTENER_S = 30.0


@router.websocket("/sweeps/{sweep}/stream")
async def stream(
    websocket: WebSocket, sweep: str, services: TheServices, x: str | None = None, y: str | None = None
) -> None:
    """Greet a page, then tell it of every change until one of the two leaves."""
    await websocket.accept()
    try:
        found = services.sweeps.get(sweep)
        await found.look()
        await found.cells(x, y)
    except ApiError as error:
        await websocket.close(GONE if error.status == HTTPStatus.NOT_FOUND else REFUSED, str(error)[:100])
        return
    except SweepError:
        await websocket.close(GONE, "The files of this sweep are damaged or were taken away.")
        return
    with found.join(x, y) as listener:
        telling = asyncio.ensure_future(_tell(websocket, listener))
        try:
            await _listen(websocket, listener)
        finally:
            telling.cancel()
            await asyncio.gather(telling, return_exceptions=True)


async def _tell(websocket: WebSocket, listener: Listener) -> None:
    async for text in listener:
        # A peer that takes nothing for so long is gone, whatever its TCP connection pretends.
        async with asyncio.timeout(SLOWEST_LISTENER_S):
            await websocket.send_text(text)
    await websocket.close(GONE, "The sweep was deleted, or the server was stopped.")


async def _listen(websocket: WebSocket, listener: Listener) -> None:
    """Answer pings until the page leaves or says something else."""
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            try:
                listener.answer(ping(message.get("text") or "").sent)
            except ValueError:
                await websocket.close(UNKNOWN_WORD, "The stream takes nothing but pings; use the REST interface.")
                return
