"""The bridge between a browser's websocket and the session's viser server on the loopback interface.

The web application has checked Origin, session and right before it calls `bridge`. From there on every message is
forwarded as it is: from viser to the browser whole, from the browser to viser only if it is small and of a kind that
the scene and the panel need. Whichever side ends first, the other is closed and nothing is left behind.

Neither leg compresses: positions of particles hardly shrink, and deflating 50,000 of them takes ten times as long as
sending them. Neither leg queues: a slow browser blocks viser's sender for it, and viser then replaces what it has not
sent yet by what is newer.
"""

import asyncio
import logging
from collections.abc import Coroutine
from typing import Any

import msgspec
from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

__all__ = ["MAXIMUM_BYTES", "bridge"]

MAXIMUM_BYTES = 16 * 1024
"""Largest message that a browser may send; a camera takes 300 bytes."""
OPEN_S = 5.0
WELCOME = frozenset({"ViewerCameraMessage", "GuiUpdateMessage", "LocalStorageGetItemResponseMessage"})
"""What a browser may say. All else that viser understands (uploads, a public tunnel, renders, dragging of nodes) is
dropped."""

CLOSE_GOING_AWAY = 1001
CLOSE_UNSUPPORTED = 1003
CLOSE_TOO_BIG = 1009
CLOSE_TRY_LATER = 1013

logger = logging.getLogger(__name__)


class _Message(msgspec.Struct):
    """What has to be known of a message to let it through."""

    type: str
    updates: dict[str, msgspec.Raw] = {}


_DECODER = msgspec.msgpack.Decoder(_Message)


async def bridge(websocket: WebSocket, port: int) -> None:
    """Join a browser to the viser server of its session until one of them leaves.

    Args:
        websocket: Not yet accepted.
        port: The viewer's port on 127.0.0.1.
    """
    offered = [Subprotocol(name) for name in websocket.scope.get("subprotocols", []) if name.startswith("viser-v")]
    try:
        viser = await connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=offered or None,
            compression=None,
            max_size=None,  # what comes from viser is ours
            max_queue=1,
            open_timeout=OPEN_S,
            close_timeout=1.0,
            ping_interval=None,  # a process that lives closes its sockets; the browser is pinged by the web server
            proxy=None,
        )
    except (OSError, TimeoutError, WebSocketException):
        await websocket.close(CLOSE_TRY_LATER, "The scene is not ready")
        return
    try:
        await websocket.accept(subprotocol=viser.subprotocol)
        code = await _first(_from_browser(websocket, viser), _to_browser(websocket, viser))
    except WebSocketDisconnect:
        return
    finally:
        await viser.close()
    await _close(websocket, code)


async def _first(*directions: Coroutine[Any, Any, int]) -> int:
    """Run both directions until one ends, end the other, and return the first one's closing code."""
    tasks = [asyncio.create_task(direction) for direction in directions]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return done.pop().result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _from_browser(websocket: WebSocket, viser: ClientConnection) -> int:
    while True:
        message = await websocket.receive()
        if message["type"] == "websocket.disconnect":
            return CLOSE_GOING_AWAY
        data = message.get("bytes")
        if data is None:
            return CLOSE_UNSUPPORTED
        if len(data) > MAXIMUM_BYTES:
            return CLOSE_TOO_BIG
        if not _is_welcome(data):
            continue
        try:
            await viser.send(data)
        except ConnectionClosed:
            return CLOSE_GOING_AWAY


async def _to_browser(websocket: WebSocket, viser: ClientConnection) -> int:
    try:
        async for message in viser:
            await websocket.send_bytes(message if isinstance(message, bytes) else message.encode())
    except (ConnectionClosed, WebSocketDisconnect, RuntimeError):
        # Starlette raises RuntimeError for a message after its own close; the browser is gone in either case.
        return CLOSE_GOING_AWAY
    return CLOSE_GOING_AWAY


async def _close(websocket: WebSocket, code: int) -> None:
    reasons = {
        CLOSE_TOO_BIG: f"A message must not exceed {MAXIMUM_BYTES} bytes",
        CLOSE_UNSUPPORTED: "Binary messages only",
    }
    try:
        await websocket.close(code, reasons.get(code, "The scene has ended"))
    except (RuntimeError, WebSocketDisconnect):
        logger.debug("the browser had gone before the bridge closed")


def _is_welcome(data: bytes) -> bool:
    """Whether a message from a browser is one that the scene or the panel needs.

    A `GuiUpdateMessage` may set nothing but a value: viser would assign any attribute of the control that it names.
    """
    try:
        message = _DECODER.decode(data)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    if message.type == "GuiUpdateMessage":
        return message.updates.keys() == {"value"}
    return message.type in WELCOME
