"""The stream: hello first, then everything that happens, and what is seen of it, to everybody who listens."""

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
from tests.server.asking import columns, get, kill, resume
from tests.server.drawings import Reader
from tests.server.host import Server, begin, change_values, command, steer
from tests.waiting import wait_for

PAINTED = '{"type": "painted", "count": 1}'


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


def is_type(name: str) -> Callable[[dict[str, Any]], bool]:
    return lambda message: message["type"] == name


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


def test_hello_comes_first(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """The first message tells the whole session and all diagnostics of the active branch."""
    steer(client, session["id"], "seek", frame=5)
    with connect(address) as socket:
        hello = hear(socket)
    assert hello["type"] == "hello"
    assert hello["session"] == get(client, session["id"])
    assert hello["diagnostics"]["frame"] == [0, 1, 2, 3, 4, 5]


def test_every_computed_frame(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """Every computed frame is told once, in order, whatever the speed, in thirty messages a second at most."""
    with connect(address) as socket:
        hear(socket)
        steer(client, session["id"], "speed", speed=0)
        began = time.monotonic()
        steer(client, session["id"], "play")
        heard = until(socket, has_changed(state="ended"))
        assert sum(message["type"] != "pong" for message in heard) <= 45 * (time.monotonic() - began) + 5
        heard += until(socket, at(239)) if not any(at(239)(message) for message in heard) else []
    rows = [row["frame"] for message in heard for row in message.get("rows", ())]
    assert columns(client, session["id"])["frame"] == list(range(240))
    assert rows == list(range(1, rows[-1] + 1))


def test_what_is_changed_is_told_to_everybody(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """A change with what is in force, a bookmark, a branch, and a restart as a new hello: the past is forgotten."""
    with connect(address) as first, connect(address) as second:
        for socket in (first, second):
            hear(socket)
        change_values(client, session["id"], {"sample_count": 200, "tracker": "apf"})
        client.post(f"/api/v1/sessions/{session['id']}/bookmarks", json={"note": "look"})
        steer(client, session["id"], "seek", frame=5)
        command(client, session["id"], "branch", frame=0, title="Other")
        for socket in (first, second):
            echo = changes(until(socket, has_changed(tracker="apf"))[-1])
            (change,) = echo["timeline"]
            assert (change["frame"], change["values"]) == (1, {"sample_count": 200, "tracker": "apf"})
            assert echo["parameters"]["sample_count"] == 200
            marks = changes(until(socket, lambda message: "bookmarks" in changes(message))[-1])["bookmarks"]
            assert marks[0]["note"] == "look"
            told = until(socket, lambda message: "Other" in json.dumps(changes(message)))
            assert "b1" in [changes(message).get("branch") for message in told]
        steer(client, session["id"], "restart")
        for socket in (first, second):
            hello = until(socket, is_type("hello"))[-1]
            assert (hello["diagnostics"]["frame"], hello["session"]["computed"]) == ([0], 0)


def test_a_page_may_ask_for_the_time_and_give_no_commands(
    server: Server, client: httpx.Client, session: dict[str, Any], address: str
) -> None:
    """A ping is answered with its own time; all else closes the connection with a reason.

    So do a drawing painted that was not sent, a session that is not there, and one that is ended.
    """
    with connect(address) as socket:
        hear(socket)
        socket.send('{"version": 1, "type": "ping", "sent": 12.5}')
        assert hear(socket) == {"version": 1, "type": "pong", "sent": 12.5}
    wrong = ["", '{"version": 2, "type": "ping", "sent": 1}', '{"type": "seek"}', PAINTED, b"\0", "x" * 100_000]
    for text in wrong:
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
    """A browser that vanishes without a word leaves nothing behind, and the others hear on."""
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
    """A page that would hear nothing more is sent away, so that it comes back and is told what is wrong."""

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


def test_who_comes_sees_the_frame_that_is_shown(client: httpx.Client, session: dict[str, Any], server: Server) -> None:
    """The first drawing is the current frame, whole: picture, particles, caption."""
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


def test_who_comes_back_is_greeted_by_a_picture(client: httpx.Client, session: dict[str, Any], server: Server) -> None:
    """A page that shows an old picture hears nothing that does not belong to it before it has a new one."""
    steer(client, session["id"], "seek", frame=3)
    with Page(server, session["id"]) as before:
        before.until(3)
    steer(client, session["id"], "seek", frame=5)
    with Page(server, session["id"], has_picture=True) as again:
        again.read()
        assert [(told["type"], told["session"]["position"]) for told in again.heard] == [("hello", 5)]
        assert again.frames == [5]


def test_a_scene_beside_it_changes_nothing(client: httpx.Client, session: dict[str, Any], server: Server) -> None:
    """Both forms of a drawing are sent where both are wanted."""
    feed = server.manager.get(session["id"]).scene_feed
    offered: list[int] = []
    feed.offer = lambda _, frame: (offered.append(frame), feed._credit())
    with Page(server, session["id"]) as page:
        page.until(0)
        server.uvicorn.loop.call_soon_threadsafe(feed._credit)
        wait_for(lambda: offered == [0])
        for frame in range(1, 4):
            steer(client, session["id"], "step")
            page.until(frame)
        wait_for(lambda: offered[-1:] == [3])
        assert offered == [0, 1, 2, 3]


def test_drawings_go_on_after_a_crash(client: httpx.Client, server: Server) -> None:
    """A page that looked on while the worker died sees the resumed run without coming anew."""
    session = begin(client)["id"]
    with Page(server, session) as page:
        page.until(0)
        steer(client, session, "seek", frame=6)
        page.until(6)
        kill(server, client, session)
        resume(client, session)
        assert isinstance(page.until(6).primitives["picture"], Picture)
        steer(client, session, "step")
        page.until(7)
