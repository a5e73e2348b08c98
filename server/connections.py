"""Connections: one that says nothing does not keep others out.

Whoever connects has some seconds to send the head of a request, and when the process has nearly as many connections as
it may have files, those that have been silent for longest make room. Bodies have a limit of their own in
`server.middleware.body_limit`.
"""

import asyncio
import resource
import time
from typing import Any

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

__all__ = ["Connection", "configuration"]

HEAD_S = 20.0
"""Time for the head of a request."""
FILES_SHARE = 0.5
"""Share of the process's files that browsers may have; the others belong to workers, uploads and the database."""
LARGEST_MESSAGE = 64 * 1024


class Connection(HttpToolsProtocol):
    """A connection of uvicorn's that ends when no request comes."""

    silent_since: float | None = None
    """When it began to wait for the head of a request; None while there is one."""
    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn's own
        """Begin to wait, in the place of one that has waited longer if there are too many."""
        super().connection_made(transport)
        self._wait()
        if len(self.connections) > most_connections():
            silent = [each for each in self.connections if isinstance(each, Connection) and each.silent_since]
            if silent:
                min(silent, key=lambda each: each.silent_since or 0.0).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._heard()
        super().connection_lost(exc)

    def on_message_begin(self) -> None:
        """Give the rest of the head its time."""
        super().on_message_begin()
        if self.silent_since is None:
            self._wait()

    def on_headers_complete(self) -> None:
        """Wait no longer: there is a request."""
        self._heard()
        super().on_headers_complete()

    def _wait(self) -> None:
        self.silent_since = time.monotonic()
        self._deadline = self.loop.call_later(HEAD_S, self._give_up)

    def _heard(self) -> None:
        self.silent_since = None
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _give_up(self) -> None:
        if not self.transport.is_closing():
            self.transport.close()


def most_connections() -> int:
    """Return how many connections the process may have, by its limit of open files."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(int(FILES_SHARE * files), 16)


def configuration(app: ASGIApp, **more: Any) -> uvicorn.Config:  # noqa: ANN401 - uvicorn's own options
    """Return how uvicorn serves the app.

    Args:
        app: What is served.
        **more: Further options of `uvicorn.Config`.
    """
    return uvicorn.Config(
        app,
        http=Connection,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=LARGEST_MESSAGE,
        # Particles hardly shrink, and deflating them takes ten times as long as sending them.
        ws_per_message_deflate=False,
        **more,
    )
