"""The stream: hello first, then every event and drawing, to every page."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from typing import Any, Self
from unittest.mock import AsyncMock

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from pftrack.core.model.drawing import Drawing, Picture, Points
from pftrack_server.sessions import duplex
from tests.server.asking import columns, get
from tests.server.drawings import Reader
from tests.server.host import Server, change_values, command, steer
from tests.waiting import wait_for


def hear(socket: ClientConnection, seconds: float = 60) -> dict[str, Any]:
    """Return the next message."""
    message: dict[str, Any] = json.loads(socket.recv(timeout=seconds))
    assert message["version"] == 1
    return message


def until(socket: ClientConnection, condition: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    """Return all messages up to the first for which something holds."""
    heard = [hear(socket)]
    while not condition(heard[-1]):
        heard.append(hear(socket))
    return heard


def changes(message: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of the session that a message says have changed."""
    return message["session"] if message["type"] == "changes" else {}


def has_changed(**fields: Any) -> Callable[[dict[str, Any]], bool]:
    """Return whether a message says that these fields have these values from now on."""
    return lambda message: fields.items() <= {name: changes(message).get(name) for name in fields}.items()


def computed(frame: int) -> Callable[[dict[str, Any]], bool]:
    return lambda message: bool(message.get("rows")) and message["rows"][-1]["frame"] >= frame


def at(frame: int) -> Callable[[dict[str, Any]], bool]:
    return has_changed(position=frame)


class Page(Reader):
    """A page that reads drawings, and paints them at once."""

    def __init__(self, server: Server, session: str, *, has_picture: bool = False) -> None:
        super().__init__()
        address = f"{server.ws}/api/v1/sessions/{session}/stream?paints=true&has_picture={has_picture}"
        self.socket: ClientConnection = connect(address, max_size=None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def read(self) -> Drawing:
        """Return the next drawing."""
        while (drawing := self.take(self.socket.recv(timeout=60))) is None:
            pass
        self.socket.send(json.dumps({"type": "painted", "count": len(self.frames)}))
        return drawing

    def until(self, frame: int) -> Drawing:
        """Read up to a frame, and return its drawing."""
        drawing = self.read()
        while self.frames[-1] != frame:
            drawing = self.read()
        return drawing


@pytest.fixture
def address(server: Server, session: dict[str, Any]) -> str:
    return f"{server.ws}/api/v1/sessions/{session['id']}/stream"


def test_every_computed_frame(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """After the whole session comes each computed frame once, in order, in at most thirty messages a second."""
    steer(client, session["id"], "seek", frame=5)
    with connect(address) as socket:
        hello = hear(socket)
        assert (hello["type"], hello["session"]) == ("hello", get(client, session["id"]))
        assert hello["diagnostics"]["frame"] == [0, 1, 2, 3, 4, 5]
        steer(client, session["id"], "speed", speed=0)
        began = time.monotonic()
        steer(client, session["id"], "play")
        heard = until(socket, has_changed(state="ended"))
        assert sum(message["type"] != "pong" for message in heard) <= 45 * (time.monotonic() - began) + 5
        heard += until(socket, at(239)) if not any(at(239)(message) for message in heard) else []
    rows = [row["frame"] for message in heard for row in message.get("rows", ())]
    assert columns(client, session["id"])["frame"] == list(range(240))
    assert rows == list(range(6, rows[-1] + 1))


def test_changes_reach_every_page(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """Every page hears of a change, a bookmark and a branch; a restart is a new hello with an empty past."""
    with connect(address) as first, connect(address) as second:
        for socket in (first, second):
            hear(socket)
        change_values(client, session["id"], {"sample_count": 200, "tracker": "apf"})
        bookmarks = f"/api/v1/sessions/{session['id']}/bookmarks"
        made = client.post(bookmarks, json={"note": "look"}).json()
        steer(client, session["id"], "seek", frame=5)
        command(client, session["id"], "branch", frame=0, title="Other")
        for socket in (first, second):
            echo = changes(until(socket, has_changed(tracker="apf"))[-1])
            (change,) = echo["timeline"]
            assert (change["frame"], change["values"]) == (1, {"sample_count": 200, "tracker": "apf"})
            assert echo["parameters"]["sample_count"] == 200
            until(socket, has_changed(bookmarks=[made]))
            told = until(socket, lambda message: "Other" in json.dumps(changes(message)))
            assert "b1" in [changes(message).get("branch") for message in told]
        statuses = [client.delete(f"{bookmarks}/{made['id']}").status_code for _ in range(2)]
        assert (made["note"], statuses) == ("look", [204, 404])
        steer(client, session["id"], "restart")
        for socket in (first, second):
            hello = until(socket, lambda message: message["type"] == "hello")[-1]
            assert (hello["diagnostics"]["frame"], hello["session"]["computed"]) == ([0], 0)


def test_a_page_may_ask_for_the_time_and_give_no_commands(
    server: Server, client: httpx.Client, session: dict[str, Any], address: str
) -> None:
    """A ping is answered with its own time; any other message closes the connection with a reason.

    So do a painted drawing that was not sent, an unknown session, and one that ends.
    """
    with connect(address) as socket:
        hear(socket)
        socket.send('{"version": 1, "type": "ping", "sent": 12.5}')
        assert hear(socket) == {"version": 1, "type": "pong", "sent": 12.5}
    painted = '{"type": "painted", "count": 1}'
    for text in ("", '{"version": 2, "type": "ping", "sent": 1}', '{"type": "seek"}', painted, b"\0", "x" * 100_000):
        with connect(address) as socket:
            hear(socket)
            socket.send(text)
            is_closed(socket, "takes no commands" if len(text) < 100_000 else "1009")
    assert get(client, session["id"])["position"] == 0
    with connect(f"{server.ws}/api/v1/sessions/0123456789abcdef/stream") as socket:
        is_closed(socket, "session does not exist")
    with connect(address) as socket:
        hear(socket)
        client.delete(f"/api/v1/sessions/{session['id']}")
        is_closed(socket, "ended")


def is_closed(socket: ClientConnection, reason: str) -> None:
    with pytest.raises(ConnectionClosed, match=reason):
        until(socket, lambda _: False)


def test_a_browser_that_vanishes(server: Server, client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """A browser that disconnects without a closing message leaves nothing behind; other pages are not disturbed."""
    steer(client, session["id"], "play")
    with connect(address) as stays:
        vanishes = connect(address)
        hear(vanishes)
        assert wait_for(lambda: server.manager.get(session["id"]).visitors == 2)
        vanishes.socket.close()
        wait_for(lambda: server.manager.get(session["id"]).visitors == 1)
        until(stays, computed(20))
    wait_for(lambda: server.manager.get(session["id"]).visitors == 0)


async def test_a_stream_that_fails_is_closed() -> None:
    """A page that would hear nothing more is disconnected, so that it reconnects and learns what is wrong."""

    async def fail() -> AsyncIterator[str]:
        yield "hello"
        raise OSError("no such file")

    page = AsyncMock(scope={"type": "websocket", "path": "/stream"})
    page.receive = asyncio.Event().wait  # it says nothing
    await asyncio.wait_for(duplex.converse(page, fail(), "farewell"), 60)
    page.send_text.assert_awaited_once_with("hello")
    (told,) = page.close.await_args_list
    assert told.args[0] == 1011
    assert "no such file" not in str(told)


# ------------------------------------------------------------ drawings


def test_a_new_page_sees_the_shown_frame(client: httpx.Client, session: dict[str, Any], server: Server) -> None:
    """The first drawing is the whole current frame: picture, particles, caption.

    A page that still shows an old picture hears nothing of a newer frame before it has that frame's picture.
    """
    steer(client, session["id"], "seek", frame=9)
    with Page(server, session["id"]) as page:
        drawing = page.read()
        assert page.frames == page.positions == [9]
        assert (drawing.width, drawing.height) == (session["width"], session["height"])
        assert isinstance(drawing.primitives["picture"], Picture)
        particles = drawing.primitives["particles"]
        assert isinstance(particles, Points)
        assert len(particles.positions) == session["parameters"]["sample_count"]
        assert drawing.caption.startswith("frame 9 ")
    steer(client, session["id"], "seek", frame=5)
    with Page(server, session["id"], has_picture=True) as again:
        again.read()
        assert [(told["type"], told["session"]["position"]) for told in again.heard] == [("hello", 5)]
        assert again.frames == [5]
