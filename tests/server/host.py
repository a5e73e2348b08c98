"""A real server on a free port, with real worker processes, and what tests say to it through real sockets."""

import asyncio
import socket
import tempfile
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from pftrack_server.app import create_app
from pftrack_server.core.base_path import encode_path
from pftrack_server.core.settings import Settings
from pftrack_server.web.serving import configuration
from tests.session_requests import session_request
from tests.waiting import wait_for


class _Uvicorn(uvicorn.Server):
    """Remembers its loop, so that tests can run something there."""

    loop: asyncio.AbstractEventLoop

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        self.loop = asyncio.get_running_loop()
        await super().startup(sockets)


class Server:
    """A server that runs in a thread of this process."""

    def __init__(self, settings: Settings) -> None:
        self.app = create_app(settings)
        self.base = encode_path(settings.base_path)
        self.listening = socket.socket()
        self.listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listening.bind(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        self.uvicorn = _Uvicorn(configuration(self.app, timeout_graceful_shutdown=3))
        self.thread = threading.Thread(target=self.uvicorn.run, kwargs={"sockets": [self.listening]})

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def url(self) -> str:
        return self.origin + self.base

    @property
    def ws(self) -> str:
        return self.url.replace("http", "ws", 1)

    @property
    def manager(self) -> Any:
        return self.app.state.services.manager

    def run(self, work: Coroutine[Any, Any, Any]) -> Any:
        """Run something in the server's loop, and return its result."""
        return asyncio.run_coroutine_threadsafe(work, self.uvicorn.loop).result(30)

    def pid_of(self, session: str) -> int:
        """The worker's process number."""
        return self.manager.get(session).worker.pid

    def start(self) -> None:
        self.thread.start()
        wait_for(lambda: self.uvicorn.started or not self.thread.is_alive(), what="the server has started")
        assert self.thread.is_alive(), "the server did not start"

    def stop(self) -> None:
        self.uvicorn.should_exit = True
        self.thread.join(30)
        self.listening.close()
        assert not self.thread.is_alive()


@contextmanager
def running(settings: Settings) -> Iterator[Server]:
    """Run a server for as long as the context lasts."""
    server = Server(settings)
    server.start()
    try:
        yield server
    finally:
        server.stop()


def own_server(**settings: Any) -> Any:
    """Return a fixture that is a server of a module's own with these settings."""

    @pytest.fixture(scope="module")
    def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
        with running(Settings(data_dir=tmp_path_factory.mktemp("data"), **settings)) as server:
            yield server

    return own


def refused_socket(address: str, **options: Any) -> int:
    """Return the status with which a server refuses a websocket before it is accepted."""
    with pytest.raises(InvalidStatus) as refusal, connect(address, **options):
        pass
    return refusal.value.response.status_code


def granted(answer: httpx.Response) -> Any:
    """Check that a request was granted, and return what is told."""
    assert answer.is_success, answer.text
    return answer.json()


def post(client: httpx.Client, path: str, **body: Any) -> Any:
    """Post a body to a path of the interface, and return the answer."""
    return granted(client.post(f"/api/v1/{path}", json=body))


def begin(client: httpx.Client, **body: Any) -> dict[str, Any]:
    """Start a session."""
    return post(client, "sessions", **session_request({"experiment": "ball", "seed": 7, **body}))


def steer(client: httpx.Client, session: str, action: str, **more: Any) -> dict[str, Any]:
    """Steer a session."""
    return granted(command(client, session, action, **more))


def command(client: httpx.Client, session: str, kind: str, **more: Any) -> httpx.Response:
    """Give a session a command."""
    return client.post(f"/api/v1/sessions/{session}/commands", json={"kind": kind, **more})


def change_values(client: httpx.Client, session: str, values: object) -> httpx.Response:
    """Change parameters of a session."""
    return command(client, session, "change", values=values)


def error_of(answer: httpx.Response, status: int) -> dict[str, Any]:
    """Check that an answer has the one error shape, and return its inside."""
    assert answer.status_code == status, answer.text
    body = answer.json()
    assert set(body) == {"error"}
    error = body["error"]
    assert set(error) <= {"message", "field", "bound", "value"}
    assert error["message"]
    assert error["message"][0].isupper() or error["message"].startswith(error.get("field", "\0"))
    assert "Traceback" not in answer.text
    assert str(Path(tempfile.gettempdir())) not in answer.text
    return error


def box(x: float, y: float, width: float = 19, height: float = 19) -> dict[str, object]:
    """Return a mark."""
    return {"kind": "box", "x": x, "y": y, "width": width, "height": height}
