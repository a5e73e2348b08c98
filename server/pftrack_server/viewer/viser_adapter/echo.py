"""An echo from a browser, awaited in viser's loop.

viser's own way to ask for an item of a browser's storage, whose answer serves as the echo, blocks a thread: it would
need one for each browser, and looks ten times a second whether the browser has left.
"""

import asyncio
import uuid
from contextlib import suppress

import viser
from viser import _messages

from pftrack_server.viewer.viser_adapter.server import connection_of

KEY = "pftrack-echo"
"""Nothing is ever stored under it."""

_Answer = _messages.LocalStorageGetItemResponseMessage


async def echo(client: viser.ClientHandle, patience_s: float) -> bool:
    """Ask a browser for an echo; return whether it came in time.

    It runs in viser's loop. A browser that blocks its storage answers with an error, which is as good an echo as any.

    Args:
        client: The browser.
        patience_s: After which an answer is given up.
    """
    if connection_of(client) is None:
        return False
    connection = client._websock_connection  # noqa: SLF001 - there is no public way that does not block
    question = uuid.uuid4().hex
    answered = asyncio.Event()

    def hear(_: int, answer: _Answer) -> None:
        if answer.request_uuid == question:
            answered.set()

    connection.register_handler(_Answer, hear)
    try:
        connection.queue_message(_messages.LocalStorageGetItemRequestMessage(key=KEY, request_uuid=question))
        client.flush()
        with suppress(TimeoutError):
            async with asyncio.timeout(patience_s):
                await answered.wait()
    finally:
        connection.unregister_handler(_Answer, hear)
    return answered.is_set()
