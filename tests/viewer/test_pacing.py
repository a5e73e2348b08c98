"""Each browser is sent frames as fast as it takes them up, and none waits for another."""

import asyncio
import itertools
import math
import time
from typing import Any

import pytest

from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.viewer import pacing
from pftrack_server.viewer.pacing import ECHO_EVERY_S, LATE_S, Pace
from pftrack_server.viewer.scene import Scene
from pftrack_server.viewer.viser_adapter.endpoint import Connection
from tests.apart import run
from tests.viewer.host import Peer, Session, Site, drawing
from tests.waiting import wait_for


class Line:
    """A connection that remembers how long it waits for an answer."""

    held = False
    patience_s = math.inf

    def __init__(self, *lags_s: float) -> None:
        self._lags_s = list(lags_s)

    def expect(self, patience_s: float) -> None:
        self.patience_s = patience_s

    def release(self) -> float:
        return self._lags_s.pop(0)


def test_a_line_is_held_once_the_answer_is_overdue() -> None:
    """The best answer is the distance, which leaving out frames would not shorten."""
    line = Line(0.4, 0.9, 0.02)
    pace = Pace(line)
    expected = []
    for _ in range(3):
        pace.note_question()
        pace.note_answer()
        pace.note_question()
        expected.append(line.patience_s)
    assert expected == pytest.approx([0.4 + LATE_S, 0.4 + LATE_S, 0.02 + LATE_S])


def test_a_browser_that_is_loading_is_not_held() -> None:
    """Its first answer may take seconds."""
    line = Line(4.0)
    pace = Pace(line)
    pace.note_question()
    pace.silent()
    pace.note_question()
    assert line.patience_s == math.inf


def test_a_question_that_was_given_up_says_nothing_of_the_distance() -> None:
    """A frozen tab gets a few frames, so that it finds the newest when it thaws, and is held again."""
    line = Line(0.5, 0.02)
    pace = Pace(line)
    pace.note_question()
    pace.note_answer()
    pace.note_question()
    pace.silent()
    pace.note_question()
    assert line.patience_s == pytest.approx(0.5 + LATE_S)


def test_the_time_to_answer_begins_when_the_question_has_left() -> None:
    """A server that is late itself takes no browser for slow: messages before the question never hold a line."""

    async def scene() -> None:
        taken: list[bytes] = []

        async def take(message: bytes) -> None:
            taken.append(message)

        loop = asyncio.get_running_loop()
        connection = Connection(loop, None, take)
        connection.expect(-1.0)
        await asyncio.sleep(0.0)
        assert not connection.held
        for message in (b"the frame that is asked about", b"with the question"):
            await connection.send(message)
            assert not connection.held
        await connection.send(b"the next frame")
        assert connection.held
        waiting = asyncio.ensure_future(connection.send(b"the newest"))
        await asyncio.sleep(0.0)
        assert len(taken) == 3
        assert connection.release() >= 0.0
        await waiting
        assert taken[-1] == b"the newest"
        assert not connection.held

    run(scene())


def frame_of(peer: Peer) -> int:
    """Return the frame that a browser shows, by the number of its particles."""
    return len(peer.nodes["/particles"]["points"]) // 12 - 50


def test_a_still_scene_is_not_asked(session: Session, peer: Peer) -> None:
    """Each question would make the browser draw for a while; what has been asked is asked once for each frame."""
    for frame in range(3):
        session.show(drawing(frame, 50 + frame), frame)
        wait_for(lambda frame=frame: "/particles" in peer.nodes and frame_of(peer) == frame)
    wait_for(lambda: peer.asked > 0)
    for value in range(10, 40):
        peer.move("Occluder width (px)", value)
        wait_for(lambda value=value: session.values["occlusion_width_px"] == value)
    assert peer.asked <= 3


def test_a_browser_is_asked_ten_times_a_second_at_most(session: Session, peer: Peer) -> None:
    """While frames go out three times as fast."""
    begun = time.monotonic()
    for frame in itertools.count():
        session.show(drawing(frame, 50), frame)
        time.sleep(0.02)
        if time.monotonic() > begun + 0.8:
            break
    wait_for(lambda: peer.asked > 1)
    assert peer.asked <= 1 + (time.monotonic() - begun) / ECHO_EVERY_S


def test_one_that_does_not_answer_holds_nobody_else(
    session: Session, site: Site, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is sent a few frames more, then none until it answers, and then the newest; the others see every frame."""
    monkeypatch.setattr(pacing, "ANSWER_S", 120.0)
    with Peer(site.scene) as silent:
        wait_for(lambda: session.viewer.clients == 2)
        frames = itertools.count()

        def show() -> int:
            frame = next(frames)
            session.show(drawing(frame, 50 + frame), frame)
            wait_for(lambda: "/particles" in peer.nodes and frame_of(peer) == frame)
            return frame

        show()
        # One that has never answered is taken to be loading still, and is not held.
        wait_for(lambda: silent.asked > 0)
        for _ in range(4):
            show()
        silent.echo = False
        asked = silent.asked
        wait_for(lambda: show() and silent.asked > asked)
        wait_for(lambda: show() and any(pace.held for pace in session.viewer._pacer._paces.values()))
        held = show()
        newest = max(show() for _ in range(20))
        assert frame_of(silent) <= held  # it takes up what was on its way when it was held
        silent.echo = True
        silent.answer()
        wait_for(lambda: frame_of(silent) == newest)


def test_who_is_held_no_longer_is_noticed_in_any_order(
    session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line may be free a moment after its answer was told: no scene stands still for having looked in between."""
    held, ready = [False], []
    viewer = session.viewer
    monkeypatch.setattr(viewer, "_on_ready", lambda: ready.append(1))
    monkeypatch.setattr(Connection, "held", property(lambda _: held[0]))
    session.show(drawing(0, 50), 0)
    wait_for(lambda: "/particles" in peer.nodes and ready)
    wait_for(lambda: peer.asked > 0)
    held[0], viewer._asked = True, False
    viewer._wake()
    wait_for(lambda: not viewer._news.is_set())
    before = len(ready)
    held[0] = False
    wait_for(lambda: len(ready) > before)


def test_nothing_is_drawn_while_all_are_held(session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures that nobody is sent would take the processor from other sessions; who answers gets the newest."""
    monkeypatch.setattr(pacing, "ANSWER_S", 120.0)
    drawn: list[str | None] = []
    apply = Scene.apply

    def counted(scene: Scene, shown: SceneDrawing, *more: Any) -> None:
        drawn.append(shown.drawing.caption)
        apply(scene, shown, *more)

    monkeypatch.setattr(Scene, "apply", counted)
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
    wait_for(lambda: show() and session.viewer._pacer.all_held)
    before, newest = len(drawn), max(show() for _ in range(50))
    assert session.viewer._pacer.all_held
    assert len(drawn) <= before + 1  # what was begun when it was held
    peer.echo = True
    peer.answer()
    wait_for(lambda: seen(newest))
    assert len(drawn) < newest
