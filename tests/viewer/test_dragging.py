"""Grips: a drag in the scene becomes a command."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing
from pftrack_server.viewer.dragging import intersect
from tests.viewer.host import SAID, Peer, Session, drawing, f32
from tests.waiting import wait_for


def movable(frame: int) -> Drawing:
    made = drawing(frame)
    particles: Any = made.primitives["particles"]
    shown = {**made.primitives, "particles": replace(particles, stems=True)}
    return replace(made, primitives=shown, grip=f32(160.0, 120.0, 2.0))


def drag(peer: Peer, **more: object) -> None:
    for phase in ("start", "end"):
        peer.send("SceneNodeDragMessage", **{**SAID["SceneNodeDragMessage"], **more, "phase": phase})


def test_a_dragged_grip_asks_for_a_move_in_its_frame(session: Session, peer: Peer) -> None:
    """A particle by its number, the last grip as the estimate; nothing for other numbers or without grips."""
    session.show(movable(3), 3, lambda: "/grips" in peer.nodes)
    (client,) = session.viewer._server.get_clients().values()
    drag(peer, end_position=[100.0, -50.0])
    for particle in (-1, 10**9, 7, 800):
        drag(peer, instance_index=particle, end_position=[100.0, -50.0, 7.0])
    wait_for(lambda: len(session.transport) == 2)
    first, second = session.transport
    assert (first["kind"], first["frame"], first["particle"], second["particle"]) == ("move", 3, 7, None)
    above_px = 30.0 * 7 / 799 + 2.0  # its weight, and half of its size so that all of it is visible
    assert first["place"] == pytest.approx(intersect(client.camera.position, np.array((100.0, -50.0, 7.0)), above_px))
    session.show(drawing(4), 4, lambda: "/grips" not in peer.nodes)
    drag(peer)
    peer.move("Particles", 300, lambda: session.values["sample_count"] == 300)
    assert len(session.transport) == 2


def test_a_line_of_sight_ends_at_the_height_of_the_dragged_object() -> None:
    """It meets that height in one place; a line parallel to it, or away from it, in none."""
    eye = np.array((0.0, 0.0, 100.0))
    assert intersect(eye, np.array((10.0, -20.0, 50.0)), 0.0) == (20.0, 40.0)
    for nowhere in ((10.0, 0.0, 100.0), (10.0, 0.0, 120.0), (np.nan, 0.0, 50.0)):
        assert intersect(eye, np.array(nowhere), 0.0) is None
