"""The panel proposes values and shows those of the session."""

import asyncio
import threading
import time
from dataclasses import replace
from typing import Any

import pytest

from pftrack.core.model.parameters import Value
from pftrack_server.core.panel import PanelValues
from pftrack_server.viewer.panel import REST_S, slider_range
from tests.viewer.host import Peer, Session, Site, drawing, number
from tests.waiting import wait_for


def says(peer: Peer, text: str) -> bool:
    """Return whether a text is in the panel."""
    return any(text in str(item.get("content")) for item in list(peer.controls.values()))


def test_every_parameter_has_a_control_of_its_kind(session: Session, peer: Peer) -> None:
    """Title with unit, bounds, value and hint are those of the declaration; no useful range means no slider."""
    ranges = {
        "Occluder width (px)": ("GuiSliderMessage", 0, 200, 40),
        "Particles": ("GuiSliderMessage", 1, 5000, 800),
        "": ("GuiNumberMessage", 1, 100_000, 800),  # the box beside the slider of the particles
        "Budget": ("GuiNumberMessage", 0, 10**9, 10),
    }
    for label, expected in ranges.items():
        assert tuple(peer.control(label)[name] for name in ("kind", "min", "max", "value")) == expected
    assert peer.control("Occluder width (px)")["hint"] == "Occluder width. From 0 to 200 px."
    assert sum(item["label"] == "" for item in peer.controls.values()) == 1
    assert peer.control("Layout")["options"] == ["pillar", "wall"]
    assert peer.control("Ball colour")["value"] == [208, 32, 32]
    assert peer.control("Learn")["hint"].endswith("A change restarts the run.")


def test_a_moved_control_proposes_its_value(session: Session, site: Site, peer: Peer) -> None:
    """Numbers, choices, colours and booleans keep their types; all browsers of a session show the same values."""
    moves: dict[str, tuple[str, object, Value]] = {
        "occlusion_width_px": ("Occluder width (px)", 70, 70.0),
        "sample_count": ("Particles", 200.0, 200),
        "layout": ("Layout", "wall", "wall"),
        "colour": ("Ball colour", [0, 255, 16], "#00ff10"),
        "learn": ("Learn", True, True),
    }
    for name, (label, sent, expected) in moves.items():
        peer.move(label, sent, lambda name=name: any(name in change for change in session.changes))
        got = next(change[name] for change in session.changes if name in change)
        assert (got, type(got)) == (expected, type(expected))
    with Peer(site.scene) as other:
        other.uuid("Particles")
        peer.move("Particles", 123, lambda: other.control("Particles")["value"] == 123)


def test_a_wide_range_has_a_box_and_a_slider_with_the_same_value(session: Session, peer: Peer) -> None:
    """The slider covers the useful range; the box reaches further, and the slider then rests at its end."""
    peer.move("Particles", 1200, lambda: session.values["sample_count"] == peer.control("")["value"] == 1200)
    peer.move("", 90_000, lambda: session.values["sample_count"] == 90_000)
    wait_for(lambda: peer.control("Particles")["value"] == 5000)
    assert session.changes == [{"sample_count": 1200}, {"sample_count": 90_000}]


def test_the_session_s_values_are_shown_and_not_proposed(session: Session, peer: Peer) -> None:
    """A change by REST or another branch appears in the panel and triggers no command.

    The branch point appears before another frame does; a speed that the panel does not offer leaves its choice alone.
    """
    assert peer.control("Speed")["value"] == "1x"
    values = {"sample_count": 50, "occlusion_width_px": 12.0}
    session.tell(PanelValues(values, "h-spf", 2**53 - 1, speed=3.0, branch_point=12))
    shown = {"Particles": 50, "Occluder width (px)": 12.0, "Seed": 2**53 - 1, "Speed": "1x"}
    wait_for(lambda: shown == {label: peer.control(label)["value"] for label in shown})
    wait_for(lambda: says(peer, "branch from frame 12."))
    peer.move("Learn", True, lambda: session.changes)  # an earlier proposal would have come first
    assert (session.changes, session.transport) == ([{"learn": True}], [])


def test_a_refused_value_springs_back_with_a_reason(session: Session, peer: Peer) -> None:
    """The control shows the current value, and a note the reason."""
    session.accept = lambda _: "gamma_min_px must be at most gamma_max_px, got 70"
    peer.move("Occluder width (px)", 70, lambda: session.changes)
    wait_for(lambda: peer.notes == ["gamma_min_px must be at most gamma_max_px, got 70"])
    assert not session.viewer._panel._touched, "it springs back at once"
    wait_for(lambda: peer.control("Occluder width (px)")["value"] == 40.0)


def test_a_value_that_was_changed_by_the_session_wins_once_the_hand_rests(session: Session, peer: Peer) -> None:
    """During a drag the slider follows the hand; afterwards it shows the session's value."""
    session.accept = lambda values: values.update(occlusion_width_px=float(values["occlusion_width_px"]) / 2)
    peer.uuid("Particles")
    for value in (20, 60, 100):
        peer.move("Occluder width (px)", value)
        time.sleep(0.06)
    wait_for(lambda: session.values["occlusion_width_px"] == 50.0)
    timer: Any = session.viewer._panel._timer
    assert timer.when() <= session.loop.loop.time() + REST_S, "the session has answered, so only rest is waited for"
    wait_for(lambda: peer.control("Occluder width (px)")["value"] == 50.0)
    assert session.values["occlusion_width_px"] == 50.0


def test_a_lost_proposal_springs_back(session: Session, peer: Peer) -> None:
    """A browser whose change never arrived gets the session's value with the next answer."""
    peer.control("Learn")["value"] = True  # the browser shows it, but its throttle has swallowed the message
    peer.move("Occluder width (px)", 41, lambda: peer.control("Learn")["value"] is False)


def test_a_value_is_proposed_although_the_panel_is_restored_at_that_moment(session: Session, peer: Peer) -> None:
    """A browser's message is processed at once, not when a thread of viser's is free."""
    peer.uuid("Particles")
    free = threading.Event()
    pool = session.viewer._server.gui._thread_executor
    for _ in range(pool._max_workers):
        pool.submit(free.wait, 10.0)
    try:
        peer.move("Occluder width (px)", 70)
        peer.move("Speed", "2x")
        wait_for(lambda: session.viewer._panel._controls["occlusion_width_px"]._handles[0].value == 70.0)
        session.loop.call(session.viewer.refuse, "something else")
    finally:
        free.set()
    wait_for(lambda: session.changes == [{"occlusion_width_px": 70.0}])
    wait_for(lambda: session.transport == [{"kind": "speed", "speed": 2.0}])


def test_only_what_the_tracker_reads_is_shown(session: Session, peer: Peer) -> None:
    """Another tracker hides the parameters that it does not read, and a folder without any."""
    assert peer.control("Threshold")["visible"]
    peer.move("Tracker", "Condensation", lambda: session.tracker == "condensation")
    wait_for(lambda: not peer.control("Threshold")["visible"] and not peer.control("Switching")["visible"])
    assert peer.control("Particles")["visible"]


def test_a_typed_seed_restarts_the_run(session: Session, peer: Peer) -> None:
    """The seed is sent as an integer."""
    assert (peer.control("Seed")["kind"], peer.control("Seed")["max"]) == ("GuiNumberMessage", 2**53 - 1)
    peer.move("Seed", 12.0, lambda: session.transport == [{"kind": "restart", "seed": 12}])
    assert type(session.transport[0]["seed"]) is int


def test_the_caption_of_the_frame_is_shown(session: Session, peer: Peer) -> None:
    """The caption stands above the controls, with markup escaped."""
    session.show(replace(drawing(7), caption="ESS < 3 & lost"), 7, lambda: says(peer, "ESS &lt; 3 &amp; lost"))


def test_a_control_moved_while_the_viewer_closes_leaves_no_timer(session: Session, peer: Peer) -> None:
    """The timer would set the controls of a scene that has ended."""
    panel = session.viewer._panel
    peer.move("Occluder width (px)", 70, lambda: session.changes)

    async def close() -> None:
        closing = asyncio.ensure_future(session.viewer.close())
        await asyncio.sleep(0)
        panel._propose("occlusion_width_px", 80.0)
        await closing

    session.loop.call(close)
    assert panel._timer.cancelled()


@pytest.mark.parametrize(
    ("bounds", "useful", "slider"),
    [
        ((0, 640), (0, 200), (0, 200)),
        ((0, 640), (0, 60), (0, 100)),
        ((-640, 640), (120, 200), (100, 200)),
        ((5, 5), (100, 100), None),
        ((0, None), None, None),
    ],
)
def test_a_slider_covers_the_useful_range_and_the_value(bounds: Any, useful: Any, slider: Any) -> None:
    """A value beyond the useful range widens it; without a range there is no slider."""
    assert slider_range(number("a", "Width", 0, (*bounds, useful)), 100) == slider
