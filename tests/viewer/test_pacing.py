"""The interval between frames follows the slowest browser that is awake."""

from server.viewer.pacing import ASLEEP_S, FASTEST_S, SLOWEST_S, Pacer
from tests.viewer.host import Peer, Session, wait_for


def test_a_quick_browser_gets_every_frame() -> None:
    """Small lags change nothing."""
    pacer = Pacer()
    for _ in range(20):
        pacer.report(1, 0.02)
    assert pacer.interval_s == FASTEST_S


def test_a_late_browser_slows_the_scene_down_and_is_forgiven() -> None:
    """The interval grows while the lag does, within bounds, and recovers after it."""
    pacer = Pacer()
    pacer.report(1, 0.02)
    for _ in range(20):
        pacer.report(1, 1.0)
    assert pacer.interval_s == SLOWEST_S
    for _ in range(40):
        pacer.report(1, 0.03)
    assert pacer.interval_s == FASTEST_S


def test_a_far_browser_is_not_a_late_one() -> None:
    """A lag that was there from the beginning is distance; leaving out frames would not shorten it."""
    pacer = Pacer()
    for _ in range(20):
        pacer.report(1, 0.4)
    assert pacer.interval_s == FASTEST_S


def test_a_frozen_tab_slows_nobody_down() -> None:
    """Beyond some lag nobody can be looking."""
    pacer = Pacer()
    pacer.report(1, 0.02)
    pacer.report(2, 0.02)
    for _ in range(20):
        pacer.report(2, ASLEEP_S + 1.0)
    assert pacer.interval_s == FASTEST_S
    assert pacer.lag_s == 0.02


def test_one_that_has_gone_is_forgotten() -> None:
    """The last one to leave takes the slowness along."""
    pacer = Pacer()
    pacer.report(1, 0.02)
    pacer.report(1, 1.0)
    pacer.forget(1)
    assert (pacer.interval_s, pacer.lag_s) == (FASTEST_S, 0.0)


def test_the_lag_is_measured_by_an_echo_from_the_browser(session: Session, peer: Peer) -> None:
    """Within a few seconds the viewer knows how old the picture is."""
    wait_for(lambda: 0.0 < session.viewer.lag_s < 1.0)
