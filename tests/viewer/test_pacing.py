"""Each browser gets frames as fast as it can process them, and none waits for another."""

import asyncio
import itertools
import math
import time
from types import SimpleNamespace
from typing import Any

import pytest

from pftrack_server.viewer import viewer
from pftrack_server.viewer import viser_server as server
from pftrack_server.viewer.viser_server import ASK_EVERY_S, LATE_S, LOADING_S, Connection
from tests.viewer.host import Peer, Session, Site, Websocket, drawing
from tests.waiting import wait_for


def connected() -> tuple[Any, Connection]:
    websocket: Any = Websocket()
    return websocket, Connection(websocket, None)


def answer(websocket: Websocket) -> None:
    websocket.say("LocalStorageGetItemResponseMessage", request_uuid="a", value=None, error=None)


async def test_a_browser_is_held_once_its_answer_is_overdue(monkeypatch: pytest.MonkeyPatch) -> None:
    """Later messages wait for the answer; a browser that is loading has more time than one that has answered."""
    monkeypatch.setattr(server, "ASK_EVERY_S", 0.0)
    monkeypatch.setattr(server, "LATE_S", 0.05)
    websocket, connection = connected()
    hearing = asyncio.ensure_future(connection.recv())
    await connection.send(b"first")
    assert len(websocket.taken) == 2, "the question follows the message"
    await asyncio.sleep(0.1)
    assert not connection.is_held
    assert connection._overdue - connection._asked == pytest.approx(LOADING_S + 0.05)
    answer(websocket)
    await asyncio.sleep(0.1)
    await connection.send(b"second")
    assert connection._overdue - connection._asked == pytest.approx(connection._best_s + 0.05)
    assert connection._best_s < LOADING_S
    await asyncio.sleep(connection._overdue - time.monotonic() + 0.01)
    assert connection.is_held
    assert len(websocket.taken) == 4, "without another frame there is no question, which would make the browser draw"
    waiting = asyncio.ensure_future(connection.send(b"third"))
    await asyncio.sleep(0.01)
    assert len(websocket.taken) == 4
    answer(websocket)
    await waiting
    assert websocket.taken[4] == b"third"
    hearing.cancel()


async def test_the_time_of_a_browser_begins_when_the_question_has_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """So a busy server does not hold a browser that answers early."""
    monkeypatch.setattr(server, "ASK_EVERY_S", 0.0)
    websocket, connection = connected()
    hearing = asyncio.ensure_future(connection.recv())
    websocket.delay_s = 0.05
    sending = asyncio.ensure_future(connection.send(b"frame"))
    await websocket.begun.wait()
    answer(websocket)
    await sending
    assert connection._overdue == math.inf
    begun = time.monotonic()
    await connection.send(b"frame")
    assert connection._asked >= begun + 2 * 0.045, "both the frame and the question have left"
    hearing.cancel()


def test_the_rest_is_shortened_by_drawing(session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing and rest together take less than a frame at 30 Hz."""
    rests: list[float] = []

    async def rest(seconds: float) -> None:
        rests.append(seconds)
        await asyncio.sleep(seconds)

    monkeypatch.setattr(viewer, "asyncio", SimpleNamespace(**{**vars(asyncio), "sleep": rest}))
    monkeypatch.setattr(session.viewer, "_draw", lambda: time.sleep(0.02))
    for frame in range(3):
        rests.clear()
        session.show(drawing(frame, 50), frame, lambda: bool(rests))
        assert rests[0] + 0.02 < 1 / 30


def frame_of(peer: Peer) -> int:
    """Return a browser's frame, by the number of its particles."""
    return len(peer.nodes["/particles"]["points"]) // 12 - 50


def test_a_browser_is_asked_at_most_ten_times_a_second(session: Session, peer: Peer) -> None:
    """Frames may come faster than questions."""
    begun, before = time.monotonic(), peer.asked
    for frame in itertools.count():
        session.show(drawing(frame, 50), frame)
        time.sleep(0.02)
        if time.monotonic() > begun + 0.8:
            break
    wait_for(lambda: peer.asked > before + 1)
    assert peer.asked <= before + 2 + (time.monotonic() - begun) / ASK_EVERY_S


def test_a_browser_that_does_not_answer_holds_no_other(session: Session, site: Site, peer: Peer) -> None:
    """It gets a few more frames, then none until it answers, and then the newest; others get every frame."""
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
        _, held = session.viewer.endpoint._connections.values()  # in the order in which they came
        wait_for(lambda: show() and held.is_held)
        last = show()
        newest = max(show() for _ in range(20))
        assert frame_of(silent) <= last  # a frame that was on its way still arrives
        silent.echo = True
        silent.answer()
        wait_for(lambda: frame_of(silent) == newest)


def test_nothing_is_drawn_while_all_browsers_are_held(
    session: Session, peer: Peer, drawn: list[str | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drawing would take the processor from other sessions; a browser that answers gets the newest frame."""
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
    assert len(drawn) <= before + 1  # a drawing that had begun
    peer.echo = True
    peer.answer()
    wait_for(lambda: seen(newest))
    assert len(drawn) < newest
