"""The panel proposes values and shows what the session says."""

import asyncio
import threading
import time
from typing import Any

import pytest

from pftrack.core.model.parameters import Declaration, Value
from pftrack_server.core.panel import PanelValues
from pftrack_server.viewer.panel import REST_S, slider_range
from tests.viewer.host import DECLARATIONS, Peer, Session, Site, drawing
from tests.waiting import wait_for


def test_every_parameter_has_a_control_of_its_kind(session: Session, peer: Peer) -> None:
    """Title with unit, bounds, value and help come from the declaration; without a useful range there is only a box."""
    slider = peer.control("Occluder width (px)")
    assert (slider["kind"], slider["min"], slider["max"], slider["value"]) == ("GuiSliderMessage", 0, 200, 40)
    assert slider["hint"] == "Occluder width. From 0 to 200 px."
    part = peer.control("Particles")
    assert (part["kind"], part["min"], part["max"], part["value"]) == ("GuiSliderMessage", 1, 5000, 800)
    whole = peer.control("")  # the box beside the slider of the particles
    assert (whole["kind"], whole["min"], whole["max"], whole["value"]) == ("GuiNumberMessage", 1, 100_000, 800)
    assert peer.control("Budget")["kind"] == "GuiNumberMessage"
    assert sum(item["label"] == "" for item in peer.controls.values()) == 1
    assert peer.control("Layout")["options"] == ["pillar", "wall"]
    assert peer.control("Ball colour")["value"] == [208, 32, 32]
    assert peer.control("Learn")["hint"].endswith("A change restarts the run.")
    assert len(DECLARATIONS) == 7


def test_a_moved_control_proposes_its_value(session: Session, peer: Peer) -> None:
    """Numbers, choices, colours and booleans arrive as what they are."""
    moves: dict[str, tuple[str, object, Value]] = {
        "occlusion_width_px": ("Occluder width (px)", 70, 70.0),
        "sample_count": ("Particles", 200.0, 200),
        "layout": ("Layout", "wall", "wall"),
        "colour": ("Ball colour", [0, 255, 16], "#00ff10"),
        "learn": ("Learn", True, True),
    }
    for name, (label, sent, expected) in moves.items():
        peer.move(label, sent)
        wait_for(lambda name=name: any(name in change for change in session.changes))
        got = next(change[name] for change in session.changes if name in change)
        assert (got, type(got)) == (expected, type(expected))


def test_a_wide_range_has_a_box_and_a_slider_that_show_the_same(session: Session, peer: Peer) -> None:
    """The slider covers what one works with; the box reaches further, and the slider then rests at its end."""
    peer.move("Particles", 1200)
    wait_for(lambda: session.values["sample_count"] == 1200)
    wait_for(lambda: peer.control("")["value"] == 1200)
    peer.move("", 90_000)
    wait_for(lambda: session.values["sample_count"] == 90_000)
    wait_for(lambda: peer.control("Particles")["value"] == 5000)
    assert session.changes == [{"sample_count": 1200}, {"sample_count": 90_000}]


def test_the_authoritative_value_is_shown_and_proposes_nothing(session: Session, peer: Peer) -> None:
    """What REST or another branch has changed appears in the panel without coming back."""
    peer.uuid("Particles")
    session.tell(PanelValues({"sample_count": 50, "occlusion_width_px": 12.0}, "h-spf", 7))
    wait_for(lambda: peer.control("Particles")["value"] == 50 and peer.control("Occluder width (px)")["value"] == 12.0)
    time.sleep(0.2)
    assert session.changes == []


def test_a_refused_value_springs_back_with_a_reason(session: Session, peer: Peer) -> None:
    """The control shows what is in force, and a note says why."""
    session.accept = lambda _: "gamma_min_px must be at most gamma_max_px, got 70"
    peer.move("Occluder width (px)", 70)
    wait_for(lambda: session.changes)
    wait_for(lambda: peer.notes == ["gamma_min_px must be at most gamma_max_px, got 70"])
    assert not session.viewer._panel._touched, "it springs back at once"
    wait_for(lambda: peer.control("Occluder width (px)")["value"] == 40.0)


def test_a_value_that_was_changed_by_the_session_wins_once_the_hand_rests(session: Session, peer: Peer) -> None:
    """During a drag the slider stays in the hand; afterwards it shows the truth."""

    def halve(values: dict[str, Value]) -> None:
        values["occlusion_width_px"] = float(values["occlusion_width_px"]) / 2

    session.accept = halve
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
    """A browser whose change never arrived is told the truth with the next answer."""
    peer.control("Learn")["value"] = True  # the browser shows it, but its throttle has swallowed the message
    peer.move("Occluder width (px)", 41)
    wait_for(lambda: peer.control("Learn")["value"] is False)


def test_a_value_is_proposed_although_the_panel_is_restored_at_that_moment(session: Session, peer: Peer) -> None:
    """What a browser sends is taken up at once, and not when a thread of viser's gets round to it."""
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
    session.transport.clear()


def test_only_what_the_tracker_reads_is_shown(session: Session, peer: Peer) -> None:
    """Choosing another tracker hides what it has no use for, with the folder that is empty then."""
    assert peer.control("Threshold")["visible"]
    peer.move("Tracker", "Condensation")
    wait_for(lambda: session.trackers == ["condensation"])
    wait_for(lambda: not peer.control("Threshold")["visible"] and not peer.control("Switching")["visible"])
    assert peer.control("Particles")["visible"]


def test_the_speed_is_a_transport_command(session: Session, peer: Peer) -> None:
    """The panel has no transport of its own; it hands the wish over."""
    peer.move("Speed", "2x")
    wait_for(lambda: session.transport == [{"kind": "speed", "speed": 2.0}])


def test_the_seed_is_shown_and_another_one_begins_the_run_anew(session: Session, peer: Peer) -> None:
    """A typed seed is a restart, sent as a whole number; what the session says is shown without a command."""
    session.transport.clear()
    assert (peer.control("Seed")["kind"], peer.control("Seed")["max"]) == ("GuiNumberMessage", 2**53 - 1)
    peer.move("Seed", 12.0)
    wait_for(lambda: session.transport == [{"kind": "restart", "seed": 12}])
    assert type(session.transport[0]["seed"]) is int
    session.tell(PanelValues({}, "h-spf", 9_007_199_254_740_991))
    wait_for(lambda: peer.control("Seed")["value"] == 9_007_199_254_740_991)
    assert len(session.transport) == 1
    session.transport.clear()


def test_where_a_change_leaves_the_branch_is_shown_at_once(session: Session, peer: Peer) -> None:
    """Also before another frame is; a speed that is not offered leaves the choice as it was."""
    assert peer.control("Speed")["value"] == "1x"
    session.tell(PanelValues({}, "h-spf", 7, speed=3.0, branch_point=12))
    wait_for(lambda: any("branch from frame 12." in str(item.get("content")) for item in list(peer.controls.values())))
    assert peer.control("Speed")["value"] == "1x"


def test_the_caption_of_the_frame_is_shown(session: Session, peer: Peer) -> None:
    """What the frame is about stands above the controls, without being markup."""
    shown = drawing(7)
    object.__setattr__(shown, "caption", "ESS < 3 & lost")
    session.show(shown, 7)
    wait_for(lambda: any("ESS &lt; 3 &amp; lost" in str(item.get("content")) for item in list(peer.controls.values())))


def test_a_second_browser_sees_what_the_first_one_does(session: Session, site: Site, peer: Peer) -> None:
    """All browsers on a session show one panel."""
    with Peer(site.scene) as other:
        other.uuid("Particles")
        peer.move("Particles", 123)
        wait_for(lambda: other.control("Particles")["value"] == 123)


def test_what_is_moved_while_the_viewer_closes_leaves_no_timer(session: Session, peer: Peer) -> None:
    """It would set the controls of a scene that has ended, seconds later."""
    panel = session.viewer._panel
    peer.move("Occluder width (px)", 70)
    wait_for(lambda: session.changes)

    async def close() -> None:
        closing = asyncio.ensure_future(session.viewer.close())
        await asyncio.sleep(0)
        panel._propose("occlusion_width_px", 80.0)
        await closing

    session.loop.call(close)
    assert panel._timer.cancelled()


def declare(kind: str, **more: Any) -> Declaration:
    known = {"name": "a", "title": "Width", "description": "How wide.", "unit": "", "kind": kind, "default": 0}
    return Declaration.model_validate(known | more)


@pytest.mark.parametrize(
    ("declaration", "slider"),
    [
        (declare("number", minimum=0, maximum=640, useful=(0, 200), step=1), (0, 200)),
        (declare("integer", minimum=0, maximum=640, useful=(0, 60), step=1), (0, 100)),
        (declare("number", minimum=-640, maximum=640, useful=(120, 200), step=1), (100, 200)),
        (declare("number", minimum=5, maximum=5, useful=(100, 100)), None),
        (declare("number", minimum=0), None),
    ],
)
def test_a_slider_covers_the_useful_range_and_the_value(
    declaration: Declaration, slider: tuple[float, float] | None
) -> None:
    """A value beyond the useful range widens it; what has no range has no slider."""
    assert slider_range(declaration, 100) == slider


def test_the_words_name_unit_bounds_and_restart() -> None:
    """A label carries the unit; the hint says what it does, how far it goes, and what a change costs."""
    declaration = declare("number", minimum=0, maximum=200, unit="px", live=False)
    assert declaration.label == "Width (px)"
    assert declaration.hint == "How wide. From 0 to 200 px. A change restarts the run."
    assert declare("boolean").hint == "How wide."
