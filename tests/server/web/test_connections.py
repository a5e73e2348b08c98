"""Connections and bodies that say nothing, too much, or end before the answer keep nobody else out."""

import asyncio
import contextlib
import errno
import http.client
import json
import socket
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn
from fastapi import FastAPI, WebSocket
from starlette.exceptions import HTTPException
from starlette.types import Message, Send
from structlog.testing import capture_logs
from uvicorn.protocols.utils import ClientDisconnected

from pftrack_server.core.requests import BodyLimit
from pftrack_server.core.settings import Settings
from pftrack_server.sessions.duplex import converse
from pftrack_server.web import serving
from pftrack_server.web.errors import ErrorBoundary, install
from pftrack_server.web.serving import configuration
from tests.apart import run
from tests.conftest import BASE
from tests.server import hostile
from tests.server.holding import allow, held_worker
from tests.server.host import Server, error_of
from tests.waiting import wait_for

START = f"GET {BASE}/".encode()


def connected(server: Server) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=30)


class Sent(list[Message]):
    """What an app sends."""

    async def __call__(self, message: Message) -> None:
        self.append(message)


def is_closed(raw: socket.socket) -> bool:
    """Wait for the next bytes, and return whether the other side closed the connection instead."""
    try:
        return raw.recv(1000) == b""
    except ConnectionResetError:
        return True


@pytest.mark.parametrize("said", [b"", START + b" HTTP/1.1\r\nHost: local"])
def test_a_connection_without_a_request_ends(server: Server, monkeypatch: pytest.MonkeyPatch, said: bytes) -> None:
    """A client that sends nothing or half a head is cut off, also after a request that was answered."""
    for first in (b"", START + b"healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"):
        # On a busy machine a first request takes its time.
        monkeypatch.setattr(serving, "HEAD_S", 20.0 if first else 0.3)
        with connected(server) as raw, contextlib.suppress(BrokenPipeError, ConnectionResetError):
            if first:
                raw.sendall(first)
                assert b"200 OK" in raw.recv(4000)
                monkeypatch.setattr(serving, "HEAD_S", 0.3)
                # The deadline of the next head was set before; that of the one after it is the new one.
                raw.sendall(first)
            raw.sendall(said)
            # An answer may come in parts; without an end this runs into the socket's time.
            while not is_closed(raw):
                pass


def test_an_answer_that_a_client_stops_taking_ends(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The connection breaks, so that neither it nor the rest of the answer is kept for good."""
    monkeypatch.setattr(serving, "UNTAKEN_S", 0.5)
    with serving._listen(Settings(port=0, data_dir=tmp_path)) as listening, socket.socket() as idle:
        idle.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        idle.connect(listening.getsockname())
        answering, _ = listening.accept()
        answering.settimeout(30)
        with answering, pytest.raises(TimeoutError) as broken:
            answering.sendall(bytes(50_000_000))
    assert broken.value.errno == errno.ETIMEDOUT


def test_what_is_not_http_is_refused(server: Server) -> None:
    """The parser's own refusal has the one error shape and ends the connection.

    Two host headers are refused as well, since two readers could see two servers. A head without end is cut off.
    """
    for said in (b"GET /\x00 HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\nHost: a\r\nno colon\r\n\r\n"):
        with connected(server) as raw:
            raw.sendall(said)
            answer = http.client.HTTPResponse(raw)
            answer.begin()
            assert (answer.status, answer.headers["content-type"]) == (400, "application/json")
            assert json.loads(answer.read()) == {"error": {"message": "The request is not valid HTTP"}}
            assert is_closed(raw)
    with connected(server) as raw:
        raw.sendall(START + b"healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
        assert raw.recv(4000).startswith(b"HTTP/1.1 400")
    with connected(server) as raw, contextlib.suppress(BrokenPipeError, ConnectionResetError):
        raw.sendall(START + b" HTTP/1.1\r\nHost: localhost\r\n")
        for number in range(10_000):
            raw.sendall(b"x-%d: %s\r\n" % (number, b"x" * 1000))
        pytest.fail("ten million bytes of headers were taken")


@pytest.mark.parametrize(("said", "length"), [(b"half a body", 1_000_000), (b"\r\n", 0)])
def test_what_follows_an_early_answer(
    server: Server, monkeypatch: pytest.MonkeyPatch, said: bytes, length: int
) -> None:
    """Neither an unread body nor empty lines delay the end of a connection."""
    foreign = b"POST %s/ HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\nContent-Length: %d\r\n\r\n"
    monkeypatch.setattr(serving, "HEAD_S", 1.0)
    with connected(server) as raw:
        raw.sendall(foreign % (BASE.encode(), length))
        assert raw.recv(4000).startswith(b"HTTP/1.1 403")
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            for _ in range(5):
                raw.sendall(said)
                time.sleep(0.3)
        wait_for(lambda: is_closed(raw))


def test_silent_connections_make_room(server: Server, client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """When there are too many connections, the longest silent ones end, and requests are answered all the time."""
    monkeypatch.setattr(serving, "most_connections", lambda: 10)
    with contextlib.ExitStack() as held:
        silent = []
        for _ in range(30):
            silent.append(held.enter_context(connected(server)))
            assert client.get("/healthz").status_code == 200
        wait_for(lambda: len(server.uvicorn.server_state.connections) <= 10)
        assert all(is_closed(raw) for raw in silent[:20])
        with httpx.Client(base_url=server.url) as other:
            assert other.get("/healthz").status_code == 200


async def test_a_body_that_pauses_is_given_up() -> None:
    """A request whose body stops coming is refused, and its connection ends."""
    sent, messages = Sent(), [{"type": "http.request", "body": b"a", "more_body": True}]

    async def app(scope: Any, receive: Any, send: Any) -> None:
        while (await receive())["more_body"]:
            pass
        raise AssertionError("the body has not ended")

    async def receive() -> Any:
        return messages.pop() if messages else await asyncio.Event().wait()

    with pytest.raises(HTTPException, match="stalled") as refused:
        await BodyLimit(app, 100, silence_s=0.05)({"type": "http", "headers": []}, receive, sent)
    assert (refused.value.status_code, refused.value.headers) == (408, {"Connection": "close"})
    assert sent == [], "the app answers, not the limit"


def test_no_content_type_lifts_the_limit(client: httpx.Client) -> None:
    """Only a route that takes files takes large bodies, whatever its content type. A boundary has a longest length."""
    headers = {"content-type": "multipart/form-data; boundary=x"}
    for body in (b"{" + b" " * (2 << 20) + b"}", (b" " * 65536 for _ in range(40))):
        error_of(client.post("/api/v1/sessions", content=body, headers=headers), 413)
    headers["content-type"] += "x" * 60_000
    assert "70" in error_of(client.post("/api/v1/uploads", content=b"", headers=headers), 400)["message"]


def test_no_session_is_left(start_server: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A session ends if its client leaves before it gets the session's name, since nobody else could end it."""
    monkeypatch.setattr("pftrack_server.sessions.worker_handle.main", held_worker)
    monkeypatch.setattr("pftrack_server.sessions.manager.OPENING_S", 100.0)
    body = json.dumps({"recipe": {"experiment": "ball"}, "position": 20}).encode()
    head = f"POST {BASE}/api/v1/sessions HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with start_server() as (server, client):
        allow(tmp_path / "data", 5)
        with connected(server) as raw:
            raw.sendall(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
            wait_for(lambda: client.get("/api/v1/sessions").json(), what="the session has begun")
        wait_for(lambda: not server.manager.all, what="it has ended")


def test_no_saved_run_is_left(
    server: Server, client: httpx.Client, session: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The session of a saved run ends if its client leaves while the run is compared with the saved one."""
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()["id"]
    record = server.app.state.services.store.files.record(run)
    monkeypatch.setattr("pftrack_server.work.run_functions.compare_record", hostile.wait_for_ever)
    with connected(server) as raw:
        head = f"POST {BASE}/api/v1/runs/{run}/open HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"
        raw.sendall(head.encode())
        wait_for(lambda: record.read_bytes().isdigit(), what="a child is asked to compare, and writes its number there")
        assert len(server.manager.all) == 2
    wait_for(lambda: [each.spec.id for each in server.manager.all] == [session["id"]], what="it has ended")


def test_a_page_that_is_left_is_not_a_fault_of_the_system() -> None:
    """The disconnect reaches uvicorn, which ends the connection quietly, and nothing is logged."""
    app = FastAPI()
    install(app)

    @app.websocket("/stream")
    async def accept(socket: WebSocket) -> None:
        await socket.accept()

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(_: Message) -> None:
        raise ClientDisconnected

    scope: dict[str, Any] = {"type": "websocket", "path": "/stream", "headers": [], "query_string": b""}
    with capture_logs() as logged, pytest.raises(ClientDisconnected):
        run(app(scope, receive, send))
    assert logged == []


async def test_a_request_that_the_end_of_the_server_cuts_off_is_answered() -> None:
    """When uvicorn stops it cancels slow requests, which are answered without a traceback."""
    sent = Sent()

    async def wait_for_ever(*_: object) -> None:
        await asyncio.Event().wait()

    async def begin(_scope: object, _receive: object, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await wait_for_ever()

    for app in (wait_for_ever, begin):
        request = asyncio.ensure_future(ErrorBoundary(app)({"type": "http"}, wait_for_ever, sent))
        await asyncio.sleep(0)
        request.cancel()
        await asyncio.wait({request})
    assert [each.get("status") for each in sent] == [503, None, 200], "an answer that has begun is only cut off"
    assert b"shutting down" in sent[1]["body"]


OPENING = (
    b"GET /stream HTTP/1.1\r\nHost: here\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


def test_a_page_that_takes_nothing_leaves_no_traceback() -> None:
    """A page that answers no ping loses its connection, and the stream ends without an error."""
    app, ended = FastAPI(), threading.Event()

    @app.websocket("/stream")
    async def stream(websocket: WebSocket) -> None:
        await websocket.accept()
        await converse(websocket, messages(), "")
        ended.set()

    async def messages() -> AsyncIterator[bytes]:
        # More than the system takes, and less than makes uvicorn wait.
        yield bytes(55_000)
        while True:
            yield b"more"
            await asyncio.sleep(0.01)

    with socket.socket() as listening, socket.socket() as page, capture_logs() as logged:
        for each, size in ((listening, socket.SO_SNDBUF), (page, socket.SO_RCVBUF)):
            each.setsockopt(socket.SOL_SOCKET, size, 4096)
        listening.bind(("127.0.0.1", 0))
        server = uvicorn.Server(configuration(app, ws_ping_interval=0.1, ws_ping_timeout=0.1))
        serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        serving.start()
        try:
            wait_for(lambda: server.started)
            page.connect(listening.getsockname())
            page.sendall(OPENING)
            assert ended.wait(20)
            wait_for(lambda: not server.server_state.connections)
        finally:
            server.should_exit = True
            page.close()
            serving.join()
    assert logged == []
