"""A viser server, reached by its endpoint alone, that has no smoothing, no public tunnel, no uploads and no banner."""

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from typing import cast

import rich
import viser

from pftrack_server.viewer.viser_adapter import clock, endpoint, loops, messages
from pftrack_server.viewer.viser_adapter.endpoint import Connection, Endpoint

_console = threading.Lock()


def start(title: str, loop: asyncio.AbstractEventLoop | None = None) -> tuple[viser.ViserServer, Endpoint]:
    """Start a server, and return it with the only place where it is reached.

    Args:
        title: Heading of its panel.
        loop: Where it works, which must not be that of the calling thread; None for a thread of its own.

    Raises:
        RuntimeError: The installed viser cannot be kept from opening a port.
    """
    endpoint.install()
    clock.install()
    loops.install()
    reached = Endpoint()
    with _quiet(), loops.working_in(loop):
        server = viser.ViserServer(cast("str", reached), 0, label=title, verbose=False)
    messages.remove_handlers(server)
    messages.drop_bad_values(server)
    return server, reached


def connection_of(client: viser.ClientHandle) -> Connection | None:
    """Return a browser's connection, or None if it has gone."""
    live = client._viser_server._websock_server._live_connections  # noqa: SLF001 - there is no public way
    return cast("Connection | None", live.get(client.client_id))


def stop(server: viser.ViserServer) -> None:
    """Disconnect all browsers and end the server."""
    with _quiet():
        server.stop()


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's banner off standard output, which belongs to the command."""
    console = rich.get_console()
    with _console:
        before, console.quiet = console.quiet, True
        try:
            yield
        finally:
            console.quiet = before
