"""Frames wait for the slowest browser that is awake, and for no other."""

import time

import pytest

from server.viewer import pacing
from server.viewer.pacing import ASLEEP_S, LATE_S, Pacer
from tests.viewer.host import Peer, Session, drawing, wait_for


class Clock:
    """A clock that is set by hand."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(pacing, "time", made)
    return made


def met(*lags: float) -> Pacer:
    """Return a pacer that knows a browser for each lag, the first of which has number 0."""
    pacer = Pacer()
    for client, lag in enumerate(lags):
        pacer.meet(client)
        pacer.answered(client, lag)
    return pacer


def test_an_answer_in_time_holds_nothing(clock: Clock) -> None:
    """The next frame goes out while the question is on its way."""
    pacer = met(0.02)
    pacer.asks(0)
    clock.now += 0.02 + LATE_S - 0.01
    assert not pacer.held


def test_an_overdue_answer_holds_the_next_frame(clock: Clock) -> None:
    """Nothing more is sent until it comes."""
    pacer = met(0.02)
    pacer.asks(0)
    clock.now += 0.02 + LATE_S + 0.01
    assert pacer.held
    assert pacer.lag_s == pytest.approx(0.02 + LATE_S + 0.01)
    pacer.answered(0, 0.3)
    assert not pacer.held


def test_a_far_browser_is_not_a_late_one(clock: Clock) -> None:
    """A lag that was there from the beginning is distance; leaving out frames would not shorten it."""
    pacer = met(0.4)
    pacer.asks(0)
    clock.now += 0.5
    assert not pacer.held


def test_a_browser_that_is_loading_holds_nothing(clock: Clock) -> None:
    """Its first answer may take seconds, and others are looking on."""
    pacer = met(0.02)
    pacer.meet(1)
    pacer.asks(1)
    clock.now += 2.0
    assert not pacer.held


def test_a_frozen_tab_holds_nobody_for_long(clock: Clock) -> None:
    """Beyond some lag nobody can be looking; once it answers again it counts again."""
    pacer = met(0.02, 0.02)
    pacer.asks(1)
    clock.now += ASLEEP_S + 0.1
    assert not pacer.held
    pacer.answered(1, ASLEEP_S)
    pacer.asks(1)
    clock.now += 1.0
    assert not pacer.held
    assert pacer.lag_s == 0.02
    pacer.answered(1, 1.0)
    pacer.asks(1)
    clock.now += 1.0
    assert pacer.held


def test_one_that_has_gone_is_forgotten(clock: Clock) -> None:
    """The last one to leave takes the slowness along, and a late answer of it is nobody's."""
    pacer = met(0.02)
    pacer.asks(0)
    clock.now += 1.0
    pacer.forget(0)
    pacer.answered(0, 1.0)
    assert (pacer.held, pacer.lag_s) == (False, 0.0)


def test_the_lag_is_measured_by_an_echo_from_the_browser(session: Session, peer: Peer) -> None:
    """Once a frame has been sent the viewer knows how old the picture is."""
    session.viewer.show(drawing(), {"frame": 0})
    wait_for(lambda: 0.0 < session.viewer._pacer.lag_s < 1.0)


def test_a_still_scene_is_not_asked(session: Session, peer: Peer) -> None:
    """Each question would make the browser draw for a while."""
    session.viewer.show(drawing(), {"frame": 0})
    wait_for(lambda: peer.asked > 0)
    time.sleep(0.5)
    before = peer.asked
    time.sleep(1.5)
    assert peer.asked == before


def test_frames_wait_for_a_browser_that_does_not_answer(session: Session, peer: Peer) -> None:
    """A silent one gets a few frames more, then none until it answers, and then the newest."""
    session.viewer.show(drawing(), {"frame": 0})
    # One that has never answered is taken to be loading still, and is not waited for.
    wait_for(lambda: [True for browser in session.viewer._pacer._browsers.values() if browser.best_s])
    peer.echo = False
    last = 0

    def is_held() -> bool:
        nonlocal last
        last += 1
        session.viewer.show(drawing(last, 50 + last), {"frame": last})
        return session.viewer._pacer.held

    wait_for(is_held)
    time.sleep(0.2)  # what was on its way arrives
    before = peer.nodes["/particles"]["points"]
    for _ in range(20):
        is_held()
        time.sleep(0.02)
    assert peer.nodes["/particles"]["points"] is before
    peer.echo = True
    peer.answer()
    wait_for(lambda: len(peer.nodes["/particles"]["points"]) == 12 * (50 + last), seconds=10.0)
