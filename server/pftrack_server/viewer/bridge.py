"""The bridge between a browser's websocket and the viser server of its session.

The web application has checked Origin, session and right before it calls `bridge`. From there on every message is
forwarded as it is: from viser to the browser whole, from the browser to viser only if it is small and of a kind that
the scene and the panel need. Whichever side ends first, the other is closed and nothing is left behind.

The browser's leg does not compress: positions of particles hardly shrink, and deflating 50,000 of them takes ten times
as long as sending them. Nothing queues: a slow browser blocks viser's sender for it, and viser then replaces what it
has not sent yet by what is newer.
"""

import asyncio
import logging
from collections.abc import Coroutine
from typing import Any

from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect

from pftrack_server.viewer.viser_adapter import Connection, Endpoint, is_allowed

MAXIMUM_BYTES = 16 * 1024
"""Largest message that a browser may send; a camera takes 300 bytes."""

CLOSE_GOING_AWAY = 1001
CLOSE_UNSUPPORTED = 1003
CLOSE_TOO_BIG = 1009
CLOSE_TRY_LATER = 1013

MOST_HZ = 150.0
"""Messages a second that a browser may go on sending; one that drags a slider and turns the camera sends 120."""
BURST = 300
"""Messages that it may send at once."""

logger = logging.getLogger(__name__)

Ending = tuple[int, str]


async def bridge(websocket: WebSocket, endpoint: Endpoint, *, looks_only: bool = False) -> None:
    """Join a browser to the viser server of its session until one of them leaves.

    Args:
        websocket: Not yet accepted.
        endpoint: The viewer's.
        looks_only: Whether the browser may move its camera and nothing else.
    """
    if not endpoint.is_open:
        await websocket.close(CLOSE_TRY_LATER, "The scene is not ready")
        return
    offered = (name for name in websocket.scope.get("subprotocols", []) if name.startswith("viser-v"))
    subprotocol = next(offered, None)
    ending = CLOSE_TRY_LATER, "The scene has just ended"
    try:
        await websocket.accept(subprotocol=subprotocol)
    except OSError:
        # It has left while the scene was made; until it is let in, Starlette does not say so in its own words.
        return
    try:
        async with endpoint.connect(subprotocol, websocket.send_bytes, looks_only=looks_only) as connection:
            ending = await _first(_from_browser(websocket, connection), connection.wait_closed())
    except WebSocketDisconnect:
        return
    except ConnectionRefusedError:
        logger.debug("the scene ended while a browser was being let in")
    await _close(websocket, *ending)


async def _first(*directions: Coroutine[Any, Any, Ending]) -> Ending:
    """Run both directions until one ends, end the other, and return the first one's closing code and reason."""
    tasks = [asyncio.create_task(direction) for direction in directions]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return done.pop().result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _from_browser(websocket: WebSocket, connection: Connection) -> Ending:
    loop = asyncio.get_running_loop()
    # When what has come so far would be taken up at the rate that is allowed.
    taken_up = loop.time()
    while True:
        message = await websocket.receive()
        taken_up = max(taken_up, loop.time()) + 1.0 / MOST_HZ
        await asyncio.sleep(taken_up - BURST / MOST_HZ - loop.time())
        if message["type"] == "websocket.disconnect":
            return CLOSE_GOING_AWAY, "The browser has left"
        data = message.get("bytes")
        if data is None:
            return CLOSE_UNSUPPORTED, "Binary messages only"
        if len(data) > MAXIMUM_BYTES:
            return CLOSE_TOO_BIG, f"A message must not exceed {MAXIMUM_BYTES} bytes"
        if is_allowed(data, looks_only=connection.looks_only):
            connection.deliver(data)


async def _close(websocket: WebSocket, code: int, reason: str) -> None:
    try:
        await websocket.close(code, reason)
    except (RuntimeError, WebSocketDisconnect):
        logger.debug("the browser had gone before the bridge closed")
