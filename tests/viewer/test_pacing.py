"""Each browser is sent frames as fast as it takes them up, and none waits for another."""

import asyncio
import itertools
import math
import time
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from pftrack_server.viewer import viewer
from pftrack_server.viewer import viser_server as server
from pftrack_server.viewer.viser_server import ASK_EVERY_S, LATE_S, LOADING_S, Connection
from tests.viewer.host import Peer, Session, Site, drawing
from tests.waiting import wait_for

ANSWER = {"type": "LocalStorageGetItemResponseMessage", "request_uuid": "a", "value": None, "error": None}


class Websocket:
    """A browser that takes whatever it is sent, and says what it is told to say."""

    def __init__(self) -> None:
        self.taken: list[bytes] = []
        self.said: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.delay_s = 0.0
        self.connection = Connection(cast("Any", self), cast("Any", None))

    async def send_bytes(self, message: bytes) -> None:
        await asyncio.sleep(self.delay_s)
        self.taken.append(message)

    async def receive(self) -> dict[str, Any]:
        return await self.said.get()

    def answer(self) -> None:
        self.said.put_nowait({"type": "websocket.receive", "bytes": msgspec.msgpack.encode(ANSWER)})


@pytest.fixture
def websocket(monkeypatch: pytest.MonkeyPatch) -> Websocket:
    """One that is asked with each message."""
    monkeypatch.setattr(server, "ASK_EVERY_S", 0.0)
    return Websocket()


async def test_a_browser_is_held_once_its_answer_is_overdue(
    websocket: Websocket, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is sent then waits for the answer; one that is loading has longer than one that has answered."""
    monkeypatch.setattr(server, "LATE_S", 0.05)
    connection = websocket.connection
    hearing = asyncio.ensure_future(connection.recv())
    await connection.send(b"first")
    assert len(websocket.taken) == 2, "the question follows the message"
    await asyncio.sleep(0.1)
    assert not connection.is_held
    assert connection._overdue == pytest.approx(time.monotonic() - 0.1 + LOADING_S + 0.05, abs=0.09)
    websocket.answer()
    await asyncio.sleep(0.01)
    await connection.send(b"second")
    assert connection._overdue - time.monotonic() < 0.3, "the best answer is the distance"
    await asyncio.sleep(0.3)
    assert connection.is_held
    waiting = asyncio.ensure_future(connection.send(b"third"))
    await asyncio.sleep(0.01)
    assert len(websocket.taken) == 4
    websocket.answer()
    await waiting
    assert websocket.taken[4] == b"third"
    hearing.cancel()


async def test_an_answer_that_comes_while_the_question_leaves_holds_nothing(websocket: Websocket) -> None:
    """A busy server takes no browser for slow: its time begins when the question has left."""
    hearing = asyncio.ensure_future(websocket.connection.recv())
    websocket.delay_s = 0.05
    sending = asyncio.ensure_future(websocket.connection.send(b"frame"))
    await asyncio.sleep(0.06)
    websocket.answer()
    await sending
    assert websocket.connection._overdue == math.inf
    websocket.delay_s = 0.2
    await websocket.connection.send(b"frame")
    assert time.monotonic() - websocket.connection._asked < 0.1
    hearing.cancel()


def test_a_frame_of_a_run_does_not_wait_for_its_turn(
    session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time of drawing counts: drawing and rest together are shorter than a frame at 30 Hz."""
    rests: list[float] = []

    async def rest(seconds: float) -> None:
        rests.append(seconds)
        await asyncio.sleep(seconds)

    def draw_slowly() -> None:
        time.sleep(0.02)

    monkeypatch.setattr(viewer, "asyncio", SimpleNamespace(**{**vars(asyncio), "sleep": rest}))
    monkeypatch.setattr(session.viewer, "_draw", draw_slowly)
    for frame in range(3):
        rests.clear()
        session.show(drawing(frame, 50), frame, lambda: bool(rests))
        assert rests[0] + 0.02 < 1 / 30


def frame_of(peer: Peer) -> int:
    """Return the frame that a browser shows, by the number of its particles."""
    return len(peer.nodes["/particles"]["points"]) // 12 - 50


def test_a_browser_is_asked_ten_times_a_second_at_most(session: Session, peer: Peer) -> None:
    """While frames go out three times as fast; each question is behind what is sent, so that a still scene has none.

    It would make the browser draw for a while.
    """
    begun, before = time.monotonic(), peer.asked
    for frame in itertools.count():
        session.show(drawing(frame, 50), frame)
        time.sleep(0.02)
        if time.monotonic() > begun + 0.8:
            break
    wait_for(lambda: peer.asked > before + 1)
    assert peer.asked <= before + 2 + (time.monotonic() - begun) / ASK_EVERY_S
    time.sleep(2 * ASK_EVERY_S)
    before = peer.asked
    time.sleep(3 * ASK_EVERY_S)
    assert peer.asked == before


def test_one_that_does_not_answer_holds_nobody_else(session: Session, site: Site, peer: Peer) -> None:
    """It is sent a few frames more, then none until it answers, and then the newest; the others see every frame."""
    with Peer(site.scene) as silent:
        wait_for(lambda: session.viewer.clients == 2)
        frames = itertools.count()

        def show() -> int:
            frame = next(frames)
            session.show(drawing(frame, 50 + frame), frame)
            wait_for(lambda: "/particles" in peer.nodes and frame_of(peer) == frame)
            return frame

        wait_for(lambda: show() >= 0 and silent.asked > 1)
        silent.echo = False
        asked = silent.asked
        wait_for(lambda: show() and silent.asked > asked)
        held = session.viewer.endpoint._connections
        wait_for(lambda: show() and any(connection.is_held for connection in list(held.values())))
        last = show()
        newest = max(show() for _ in range(20))
        assert frame_of(silent) <= last  # it takes up what was on its way when it was held
        silent.echo = True
        silent.answer()
        wait_for(lambda: frame_of(silent) == newest)


def test_nothing_is_drawn_while_all_are_held(
    session: Session, peer: Peer, drawn: list[str | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pictures that nobody is sent would take the processor from other sessions; who answers gets the newest."""
    monkeypatch.setattr(server, "LATE_S", LATE_S / 2)
    frames = itertools.count()

    def show() -> int:
        frame = next(frames)
        session.show(drawing(frame, 50 + frame), frame)
        return frame

    def seen(frame: int) -> bool:
        return "/particles" in peer.nodes and frame_of(peer) == frame

    for _ in range(4):
        frame = show()
        wait_for(lambda frame=frame: seen(frame))
    wait_for(lambda: peer.asked > 0)
    peer.echo = False
    (connection,) = session.viewer.endpoint._connections.values()
    wait_for(lambda: show() and connection.is_held)
    before, newest = len(drawn), max(show() for _ in range(50))
    assert connection.is_held
    assert len(drawn) <= before + 1  # what was begun when it was held
    peer.echo = True
    peer.answer()
    wait_for(lambda: seen(newest))
    assert len(drawn) < newest
