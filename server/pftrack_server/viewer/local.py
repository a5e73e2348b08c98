"""A run's live scene on this machine, for a script, a notebook or a prompt: the session's viewer without a session.

The viewer is the server's own (`pftrack_server.viewer.viewer`), with its panel of parameters, views and layers. It
works in the loop of a small web application, which serves viser's client and connects browsers to it. A `Player` in the
same loop replaces a session's worker: it has a branch of the run, goes to requested frames, plays, and branches again
when a parameter changes. It computes in a thread outside the loop.

The application listens only on this machine, at an unguessable address, and only pages from that address get a scene.
"""

import asyncio
import concurrent.futures
import secrets
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from html import escape
from typing import Any, Self

import uvicorn
from fastapi import WebSocket
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute

from pftrack.core.model.drawing import drawn_keys
from pftrack.core.model.faults import without_faults
from pftrack.core.model.parameters import Value, declarations, flat
from pftrack.core.model.recipe import Change
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.runs.manifest import title_of
from pftrack.runs.run import Run
from pftrack_server.core.panel import PanelDescription, PanelValues, TrackerPublic
from pftrack_server.core.pictures import PictureEncoder, SceneDrawing
from pftrack_server.viewer.client_page import CONTENT_SECURITY_POLICY, client_asset, client_page
from pftrack_server.viewer.viewer import Viewer
from pftrack_server.viewer.viser_server import bridge

HOST = "127.0.0.1"
FORBIDDEN = 1008
HEIGHT_PX = 640
"""Height of the scene in a notebook."""


def show(run: Run, *, port: int = 0, browser: bool | None = None) -> "LocalScene":
    """Open the scene of a run on this machine; see `pftrack.output.exports.formats.show`."""
    scene = LocalScene(run, port)
    if browser if browser is not None else not _in_notebook():
        webbrowser.open(scene.address)
    return scene


class LocalScene:
    """A run's scene, open on this machine until it is closed.

    Args:
        run: The run to show; it is not changed.
        port: Port to listen on; 0 takes a free one.

    Raises:
        OSError: The port is taken.
    """

    def __init__(self, run: Run, port: int = 0) -> None:
        self._listening = socket.create_server((HOST, port))
        self._origin = f"http://{HOST}:{self._listening.getsockname()[1]}"
        self._key = secrets.token_urlsafe(12)
        self._player = Player(run)
        self._begun: concurrent.futures.Future[None] = concurrent.futures.Future()
        config = uvicorn.Config(self._application(), log_level="warning", lifespan="on", timeout_graceful_shutdown=1)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(
            target=self._server.run, kwargs={"sockets": [self._listening]}, name="pftrack-show", daemon=True
        )
        self._thread.start()
        self._begun.result()

    @property
    def address(self) -> str:
        """Address of the scene for a browser on this machine."""
        return f"{self._origin}/{self._key}/"

    @property
    def run(self) -> Run:
        """The shown run, a branch of the given one; the player moves it."""
        return self._player.run

    def go(self, frame: int) -> None:
        """Show a frame; it and all frames before it are computed if necessary."""
        self._player.request({"kind": "seek", "frame": frame})

    def follow(self, run: Run) -> None:
        """Show a longer run in place of this one, at its newest frame unless a person is looking at an earlier one."""
        self._player.request({"kind": "follow", "run": run})

    def wait(self) -> None:
        """Wait until the scene is closed or interrupted: the end of a script closes its scenes."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.2)  # an endless wait cannot be interrupted on every system
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Close the scene; a second call does nothing."""
        self._server.should_exit = True
        self._thread.join()
        self._listening.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<scene of {self._player.run.experiment.id} at {self.address}>"

    def _repr_html_(self) -> str:
        """Return the scene as HTML for a notebook."""
        style = f"width:100%;height:{HEIGHT_PX}px;border:0"
        return f'<iframe src="{escape(self.address)}" title="Scene" style="{style}"></iframe>'

    def _application(self) -> Starlette:
        at = f"/{self._key}"
        sockets = [WebSocketRoute(path, self._join) for path in (at, f"{at}/")]  # viser's client omits the slash
        routes = [Route(f"{at}/", self._page), Route("/client/{name}", self._file), *sockets]
        hosts = Middleware(TrustedHostMiddleware, allowed_hosts=[HOST])
        return Starlette(routes=routes, middleware=[hosts], lifespan=self._play)

    @asynccontextmanager
    async def _play(self, _application: Starlette) -> AsyncIterator[None]:
        try:
            await self._player.begin()
        except BaseException as error:
            self._begun.set_exception(error)
            raise
        self._begun.set_result(None)
        try:
            yield
        finally:
            await self._player.close()

    async def _page(self, _request: Request) -> Response:
        # A notebook's page has another origin.
        policy = CONTENT_SECURITY_POLICY.replace("frame-ancestors 'self'", "frame-ancestors *")
        headers = {"Content-Security-Policy": policy, "Cache-Control": "no-store", "Referrer-Policy": "no-referrer"}
        return Response(client_page(), media_type="text/html; charset=utf-8", headers=headers)

    async def _file(self, request: Request) -> Response:
        file = client_asset(request.path_params["name"])
        if file is None:
            return Response("This file does not exist.", 404)
        return Response(file.content, media_type=file.media_type)

    async def _join(self, websocket: WebSocket) -> None:
        if websocket.headers.get("origin") != self._origin:
            await websocket.close(FORBIDDEN, "Only the page of the scene may connect")
            return
        await bridge(websocket, self._player.viewer.endpoint)


class Player:
    """Shows a run in a viewer, and carries out requests in a thread outside the loop.

    The newest request of each kind waits until the player takes it. During a long seek the player checks after each
    step for a newer request.

    Args:
        run: The run; it is not moved. The player begins at its frame.

    Attributes:
        run: The shown run: a branch of the given run, or of another branch.
        viewer: The viewer, once the player has begun.
    """

    viewer: Viewer

    def __init__(self, run: Run) -> None:
        self.run = run.branch(run.computed)
        self.run.seek(run.position)
        self._speed, self._is_playing, self._due = 1.0, False, 0.0
        self._wishes: dict[str, Any] = {}
        self._news, self._is_closed = asyncio.Event(), False
        self._encoder = PictureEncoder()

    async def begin(self) -> None:
        """Make the viewer in the running loop, and start the player there."""
        self._loop = asyncio.get_running_loop()
        self.viewer = Viewer(_describe(self.run), self._in_force, on_command=self._wish, frames=self.run.frames)
        self._working = asyncio.create_task(self._work())

    async def close(self) -> None:
        """End player and viewer."""
        self._is_closed = True
        self._news.set()
        await self._working
        await self.viewer.close()

    def request(self, command: dict[str, Any]) -> None:
        """Submit a command from any thread, as the panel does.

        Args:
            command: A body of `POST /sessions/{id}/commands`, or `follow` with a longer run to show in place of the
                present one, unless a person is looking at an earlier frame.
        """
        with suppress(RuntimeError):  # the scene has been closed
            self._loop.call_soon_threadsafe(self._wish, command)

    @property
    def _in_force(self) -> PanelValues:
        run = self.run
        following = min(run.position + 1, run.frames - 1)
        return PanelValues(flat(run.parameters_at(following)), run.tracker_at(following), run.seed, self._speed)

    def _wish(self, command: dict[str, Any]) -> None:
        """Store a command; new values are merged with waiting ones."""
        kind = command["kind"]
        fields = {"change": "values", "restart": "seed", "seek": "frame", "follow": "run"}
        value = command if kind == "move" else command.get(fields.get(kind, kind))
        self._wishes[kind] = {**self._wishes.get(kind, {}), **(value or {})} if kind == "change" else value
        self._news.set()

    async def _work(self) -> None:
        self.viewer.show(*await asyncio.to_thread(self._draw))
        while not self._is_closed:
            wishes = await self._wait_for()
            try:
                await asyncio.to_thread(self._do_all, wishes)
            except (ParameterError, ConflictError) as error:
                self.viewer.refuse(str(error))
            except Exception as error:  # noqa: BLE001 - an experiment's own, which must not end the picture
                self._is_playing = False
                self.viewer.refuse(f"{type(error).__name__}: {error}")
            if wishes:
                self.viewer.tell(self._in_force)
            self.viewer.show(*await asyncio.to_thread(self._draw))

    async def _wait_for(self) -> dict[str, Any]:
        """Wait for requests and return them."""
        rest = max(self._due - time.monotonic(), 0.0) if self._is_playing else None
        if not self._wishes:
            self._news.clear()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), rest)
        wishes, self._wishes = self._wishes, {}
        return wishes

    def _do_all(self, wishes: Mapping[str, Any]) -> None:
        for what, value in wishes.items():
            match what:
                case "seek":
                    self._is_playing = False
                    self._seek(min(max(0, int(value)), self.run.frames - 1))
                case "toggle":
                    self._is_playing = not self._is_playing
                    if self._is_playing and self.run.position == self.run.frames - 1:
                        self.run.seek(0)
                case "speed":
                    self._speed = value
                case _:
                    self._revise(what, value)
        if not wishes and self._is_playing:
            self._play()

    def _revise(self, what: str, value: Any) -> None:  # noqa: ANN401 - of any wish
        """Continue with another run, or with a branch of this one."""
        match what:
            case "follow" if self.run.position == self.run.frames - 1:
                self.run = value
            case "change":
                self._change(value)
            case "move":
                self._change(self.run.landing(value["frame"], value["particle"], value["place"]))
            case "restart":
                self._restart({}, int(value))

    def _seek(self, frame: int) -> None:
        for _ in self.run.seeking(frame):
            if self._wishes or self._is_closed:
                return

    def _play(self) -> None:
        rate_hz = self.run.source.frame_rate_hz * self._speed
        now = time.monotonic()
        self._due = max(self._due, now - 1.0) + 1.0 / rate_hz if rate_hz else now
        if self.run.position == self.run.frames - 1:
            self._is_playing = False
        else:
            self.run.seek(self.run.position + 1)

    def _change(self, values: Mapping[str, Any]) -> None:
        run = self.run
        fixed = {item.name for item in declarations(type(run.setup.parameters)) if not item.live}
        if fixed & values.keys():
            self._restart(values, run.seed)
        elif run.position == run.computed or run.is_only_drawn(values):
            run.change(values)
        else:
            self.run = run.branch(run.position, values)

    def _restart(self, values: Mapping[str, Value], seed: int) -> None:
        run, in_force = self.run, self._in_force
        known = {"tracker": in_force.tracker, **in_force.values, **values}
        tracker = str(known.pop("tracker"))
        changes = (Change(0, known),)
        self.run = Run(run.experiment, run.setup, tracker=tracker, seed=seed, frames=run.frames, timeline=changes)

    def _draw(self) -> tuple[SceneDrawing, int]:
        run = self.run
        drawing = without_faults(run.experiment.draw(replace(run.current, state=run.moved), run.diagnostics))
        keyed = replace(drawing, legend=drawn_keys(drawing, run.experiment.display.layers))
        return self._encoder.for_scene(keyed), run.position


def _describe(run: Run) -> PanelDescription:
    experiment = run.experiment
    return PanelDescription(
        title=title_of(run),
        declarations=list(experiment.declarations(type(run.setup.parameters))),
        trackers=[TrackerPublic(id=name, title=tracker.title) for name, tracker in experiment.trackers.items()],
        layers=list(experiment.display.layers),
        worlds=list(experiment.display.worlds),
        about=list(experiment.subjects(None)),
    )


def _in_notebook() -> bool:
    """Return whether this runs in a notebook's kernel, which shows the last value of a cell."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    return running is not None and "IPKernelApp" in running.config
