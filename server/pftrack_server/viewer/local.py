"""A run's live scene on this machine, for a script, a notebook or a prompt: the session's viewer without a session.

The viewer is the server's own (`pftrack_server.viewer.viewer`), with its panel of parameters, views and layers; a small
web application in a thread serves viser's client and joins browsers to it. A player in another thread (`player`) has a
branch of the run: it goes to the frames that are asked for, plays, and branches again where a parameter is turned.

Only this machine is listened to, at an address that nobody can guess, and only pages from that address get a scene.
"""

import secrets
import socket
import sys
import threading
import webbrowser
from html import escape
from types import TracebackType
from typing import Self

import uvicorn
from fastapi import WebSocket
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute

from pftrack.runs.run import Run
from pftrack_server.viewer.bridge import bridge
from pftrack_server.viewer.player import Player
from pftrack_server.viewer.viser_adapter import CONTENT_SECURITY_POLICY, client_asset, client_page

HOST = "127.0.0.1"
FORBIDDEN = 1008
HEIGHT_PX = 640
"""Of the scene in a notebook."""


def show(run: Run, *, port: int = 0, browser: bool | None = None) -> "LocalScene":
    """Open the scene of a run on this machine; see `pftrack.output.exports.formats.show`."""
    scene = LocalScene(run, port)
    if browser if browser is not None else not _in_notebook():
        webbrowser.open(scene.address)
    return scene


class LocalScene:
    """A run's scene, open on this machine until it is closed.

    Args:
        run: What is shown first; it is not changed.
        port: Where to listen; any that is free if 0.

    Raises:
        OSError: The port is taken.
    """

    def __init__(self, run: Run, port: int = 0) -> None:
        self._listening = socket.create_server((HOST, port))
        self._origin = f"http://{HOST}:{self._listening.getsockname()[1]}"
        self._key = secrets.token_urlsafe(12)
        self._player = Player(run)
        config = uvicorn.Config(self._application(), log_level="warning", timeout_graceful_shutdown=1)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._listening]}, name="pftrack-show", daemon=True
        )
        self._thread.start()

    @property
    def address(self) -> str:
        """Where a browser of this machine finds the scene."""
        return f"{self._origin}/{self._key}/"

    @property
    def run(self) -> Run:
        """What is shown: a branch of the run that was given; its own player moves it."""
        return self._player.run

    def go(self, frame: int) -> None:
        """Show a frame; one that has not been computed yet is computed, with all before it."""
        self._player.go(frame)

    def follow(self, run: Run) -> None:
        """Show a longer run in the place of this one, at its newest frame unless an earlier one is being looked at."""
        self._player.follow(run)

    def wait(self) -> None:
        """Wait until it is closed, or somebody interrupts: a script that ends closes what it shows."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.2)  # a wait without an end cannot be interrupted everywhere
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Stop showing it; a second call does nothing."""
        self._player.close()
        self._server.should_exit = True
        self._thread.join()
        self._listening.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<scene of {self._player.run.experiment.id} at {self.address}>"

    def _repr_html_(self) -> str:
        """Return the scene itself, for a notebook."""
        style = f"width:100%;height:{HEIGHT_PX}px;border:0"
        return f'<iframe src="{escape(self.address)}" title="Scene" style="{style}"></iframe>'

    def _application(self) -> Starlette:
        at = f"/{self._key}"
        sockets = [WebSocketRoute(path, self._join) for path in (at, f"{at}/")]  # viser's client leaves the slash out
        routes = [Route(f"{at}/", self._page), Route("/client/{name}", self._file), *sockets]
        return Starlette(routes=routes, middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=[HOST])])

    async def _page(self, _request: Request) -> Response:
        # A notebook's page is another site.
        policy = CONTENT_SECURITY_POLICY.replace("frame-ancestors 'self'", "frame-ancestors *")
        headers = {"Content-Security-Policy": policy, "Cache-Control": "no-store", "Referrer-Policy": "no-referrer"}
        return Response(client_page(), media_type="text/html; charset=utf-8", headers=headers)

    async def _file(self, request: Request) -> Response:
        file = client_asset(request.path_params["name"])
        if file is None:
            return Response("There is no such file.", 404)
        return Response(file.content, media_type=file.media_type)

    async def _join(self, websocket: WebSocket) -> None:
        if websocket.headers.get("origin") != self._origin:
            await websocket.close(FORBIDDEN, "Only the page of the scene may connect")
            return
        await bridge(websocket, self._player.viewer.endpoint)


def _in_notebook() -> bool:
    """Whether this runs in a kernel, which shows what a cell ends with."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    return running is not None and "IPKernelApp" in running.config
