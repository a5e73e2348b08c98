"""The stream: hello first, then everything that happens, to everybody who listens."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from pftrack_server.schemas.messages import Frame
from pftrack_server.stream import duplex, listeners
from tests.apart import run
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


def is_type(name: str) -> Callable[[dict[str, Any]], bool]:
    return lambda message: message["type"] == name


def changes(message: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of the session that a message says have changed."""
    changed: dict[str, Any] = message["session"] if message["type"] == "changes" else {}
    return changed


def has_changed(**fields: Any) -> Callable[[dict[str, Any]], bool]:
    """Return whether a message says that these fields have these values from now on."""
    return lambda message: fields.items() <= {name: changes(message).get(name) for name in fields}.items()


def computed(frame: int) -> Callable[[dict[str, Any]], bool]:
    return lambda message: message["type"] == "frame" and message["diagnostics"]["frame"] >= frame


def at(frame: int) -> Callable[[dict[str, Any]], bool]:
    return has_changed(position=frame)


@pytest.fixture
def address(server: Server, session: dict[str, Any]) -> str:
    return f"{server.ws}/api/v1/sessions/{session['id']}/stream"


def test_hello_comes_first(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """The first message tells the whole session and all diagnostics of the active branch."""
    steer(client, session["id"], "seek", frame=5)
    with connect(address) as socket:
        hello = hear(socket)
    assert hello["type"] == "hello"
    assert hello["session"] == client.get(f"/api/v1/sessions/{session['id']}").json()
    assert hello["diagnostics"]["frame"] == [0, 1, 2, 3, 4, 5]


def test_every_computed_frame(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """Every computed frame is told once, in order, whatever the speed."""
    with connect(address) as socket:
        hear(socket)
        steer(client, session["id"], "speed", speed=0)
        steer(client, session["id"], "play")
        heard = until(socket, has_changed(state="ended"))
        heard += until(socket, at(239)) if not any(at(239)(message) for message in heard) else []
        rows: list[int] = []
        for message in heard:
            if message["type"] == "frame":
                rows.append(message["diagnostics"]["frame"])
            elif message["type"] == "frames":
                rows += [row["frame"] for row in message["rows"]]
        wait_for(lambda: rows)
    whole = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    assert whole["frame"] == list(range(240))
    assert rows == list(range(1, rows[-1] + 1))


def test_changes_are_echoed(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """A change is echoed to all listeners with what is in force, and what changed in which frame."""
    with connect(address) as first, connect(address) as second:
        for socket in (first, second):
            hear(socket)
        change_values(client, session["id"], {"sample_count": 200, "tracker": "apf"})
        for socket in (first, second):
            echo = changes(until(socket, has_changed(tracker="apf"))[-1])
            (change,) = echo["timeline"]
            assert (change["frame"], change["values"]) == (1, {"sample_count": 200, "tracker": "apf"})
            assert echo["parameters"]["sample_count"] == 200


def test_branches_and_bookmarks_are_told(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """New branches and bookmarks are told to all listeners."""
    with connect(address) as socket:
        hear(socket)
        command(client, session["id"], "branch", frame=0, title="Other")
        told = until(socket, lambda message: "Other" in json.dumps(changes(message)))
        branches = [changes(message)["branch"] for message in told if "branch" in changes(message)]
        assert branches[-1] == changes(told[-1])["branches"][-1]["id"]
        client.post(f"/api/v1/sessions/{session['id']}/bookmarks", json={"note": "look"})
        assert (
            changes(until(socket, lambda message: "bookmarks" in changes(message))[-1])["bookmarks"][0]["note"]
            == "look"
        )


def test_a_restart_is_a_new_hello(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """When the past is forgotten, everybody is told everything anew."""
    steer(client, session["id"], "seek", frame=5)
    with connect(address) as socket:
        assert len(hear(socket)["diagnostics"]["frame"]) == 6
        steer(client, session["id"], "restart")
        hello = until(socket, is_type("hello"))[-1]
        assert hello["diagnostics"]["frame"] == [0]
        assert hello["session"]["computed"] == 0


def test_ping(address: str) -> None:
    """A ping is answered with its own time."""
    with connect(address) as socket:
        hear(socket)
        socket.send('{"version": 1, "type": "ping", "sent": 12.5}')
        assert hear(socket) == {"version": 1, "type": "pong", "sent": 12.5}


@pytest.mark.parametrize(
    "text", ["", "play", "{}", '{"version": 2, "type": "ping", "sent": 1}', '{"type": "seek"}', b"\0"]
)
def test_commands_are_not_taken(client: httpx.Client, session: dict[str, Any], address: str, text: str | bytes) -> None:
    """Whatever is no ping closes the connection with a reason, and nothing else happens."""
    with connect(address) as socket:
        hear(socket)
        socket.send(text)
        with pytest.raises(ConnectionClosed, match="takes no commands"):
            until(socket, lambda _: False)
    assert client.get(f"/api/v1/sessions/{session['id']}").json()["position"] == 0


def test_a_message_too_large(address: str) -> None:
    """A message that is too large closes the connection."""
    with connect(address) as socket:
        hear(socket)
        socket.send("x" * 100_000)
        with pytest.raises(ConnectionClosed, match="1009"):
            until(socket, lambda _: False)


def test_unknown_session(server: Server) -> None:
    """The stream of a session that is not there is closed with a reason."""
    with (
        connect(f"{server.ws}/api/v1/sessions/0123456789abcdef/stream") as socket,
        pytest.raises(ConnectionClosed, match="no such session"),
    ):
        hear(socket)


def test_an_ended_session(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """Who listens to a session that is ended is told so."""
    with connect(address) as socket:
        hear(socket)
        client.delete(f"/api/v1/sessions/{session['id']}")
        with pytest.raises(ConnectionClosed, match="ended"):
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


def test_a_stream_that_fails_is_closed() -> None:
    """A page that would hear nothing more is sent away, so that it comes back and is told what is wrong."""
    closed: list[int] = []

    async def fail() -> AsyncIterator[str]:
        yield "hello"
        raise OSError("no such file")

    class Page:
        """A page that says nothing."""

        scope = {"type": "websocket", "path": "/stream"}  # noqa: RUF012 - read alone

        async def send_text(self, text: str) -> None:
            assert text == "hello"

        async def receive(self) -> None:
            await asyncio.Event().wait()

        async def close(self, code: int, reason: str) -> None:
            assert "no such file" not in reason
            closed.append(code)

    async def act() -> None:
        page: Any = Page()
        await asyncio.wait_for(duplex.converse(page, fail(), lambda text: None, "farewell"), 10)

    run(act())
    assert closed == [1011]


def test_a_full_queue_is_a_new_hello() -> None:
    """A listener that falls behind loses its queue and is greeted again; the others lose nothing."""
    greetings: list[str] = []

    def greet() -> Any:
        greetings.append("hello")
        return Frame(branch="b0", diagnostics={})

    crowd = listeners.SessionListeners(greet)
    with crowd.join() as slow:
        stream = slow.__aiter__()
        send_once(stream)
        for _ in range(listeners.LONGEST_QUEUE):
            crowd.emit(Frame(branch="b0", diagnostics={}))
        assert len(slow._queue) == listeners.LONGEST_QUEUE
        crowd.emit(Frame(branch="b0", diagnostics={}))
        assert len(slow._queue) == 0
        send_once(stream)
        assert len(greetings) == 2


def send_once(stream: Any) -> str:
    """Take the next item of an async generator that does not have to wait."""
    step = stream.__anext__()
    try:
        step.send(None)
    except StopIteration as done:
        return str(done.value)
    raise AssertionError("the stream waits")


def test_two_people_on_one_session(client: httpx.Client, session: dict[str, Any], address: str) -> None:
    """Two people who steer one session at once see the same run."""
    with connect(address) as first, connect(address) as second:
        for socket in (first, second):
            hear(socket)
        for count in (100, 150, 200, 250):
            change_values(client, session["id"], {"sample_count": count})
            steer(client, session["id"], "step")
        seen = [until(socket, at(4)) for socket in (first, second)]
        rows = [[m["diagnostics"] for m in heard if m["type"] == "frame"] for heard in seen]
        assert rows[0] == rows[1]


def test_messages_come_at_thirty_a_second_at_most(client: httpx.Client, address: str, session: dict[str, Any]) -> None:
    """However fast a run computes, its listeners hear of it thirty times a second at most."""
    with connect(address) as socket:
        hear(socket)
        steer(client, session["id"], "speed", speed=10)
        steer(client, session["id"], "play")
        began = time.monotonic()
        heard = until(socket, has_changed(state="ended"))
        moves = [message for message in heard if message["type"] != "pong"]
        assert len(moves) <= 45 * (time.monotonic() - began) + 5
