"""The stream of a sweep: its map as it fills, and how far it is."""

from http import HTTPStatus

from fastapi import APIRouter, WebSocket

from pftrack.sweep.axis import SweepError
from pftrack_server.api.dependencies import TheServices
from pftrack_server.errors import ApiError
from pftrack_server.schemas.stream import ping
from pftrack_server.stream.duplex import GONE, converse

router = APIRouter()

REFUSED = 4422


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
        await websocket.close(GONE, "The files of this sweep are damaged or were removed.")
        return
    with found.join(x, y) as listener:
        await converse(
            websocket,
            listener,
            lambda text: listener.answer(ping(text).sent),
            "The sweep was deleted, or the server was stopped.",
        )
