"""Presets that fit the window, and cameras that are left alone once somebody has moved them."""

import itertools
import time
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Drawing, Frustum
from pftrack_server.viewer.camera import FIRST, PRESETS, Box, View, fit
from tests.viewer.host import Peer, Session, drawing
from tests.waiting import wait_for

SHOWN = Box(320.0, 240.0, 30.0)
"""Of what `drawing` draws."""


def seen(view: View, box: Box, aspect: float, depths: tuple[float, float], *more: tuple[float, float, float]) -> float:
    """Return how far out the outermost corner of a box, or point beside it, lies; 1 is the window's edge."""
    towards = (view.position - view.target) / view.distance
    right = np.cross((0.0, 1.0, 0.0), towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    rows, end = (0.5, 0.5 - box.height), box.width - 0.5
    beside = [(end + box.beside, row, 0.0) for row in rows]
    corners = [*itertools.product((-0.5, end), rows, depths), *beside, *more]
    slope = np.tan(view.fov_rad / 2.0)
    outermost = 0.0
    for corner in corners:
        ray = np.array(corner) - view.position
        along = -ray @ towards
        outermost = max(outermost, abs(ray @ up) / along / slope, abs(ray @ right) / along / slope / aspect)
    return outermost


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("aspect", [0.6, 1.0, 1.33, 2.4])
def test_a_preset_holds_the_whole_box_and_little_more(name: str, aspect: float) -> None:
    """Every corner lies within the window, and one of them near its edge."""
    box = Box(320.0, 240.0, 50.0, behind=400.0, beside=156.0)
    view = fit(PRESETS[name], box, aspect)
    assert 0.9 < seen(view, box, aspect, (-400.0, 50.0) if PRESETS[name].deep else (0.0, 0.0)) <= 1.0


@pytest.mark.parametrize("name", ["side", "oblique"])
@pytest.mark.parametrize("focal", [120.0, 900.0])
@pytest.mark.parametrize("aspect", [0.3, 0.6, 1.3, 2.4, 4.0])
def test_from_aside_the_camera_that_took_the_picture_is_seen_whole(name: str, focal: float, aspect: float) -> None:
    """However long its lens and whatever the window's shape, camera and picture are seen; the front comes nearer."""
    apex = (159.5, -119.5, focal)
    box = Box(320.0, 240.0, 80.0, apex)
    assert 0.9 < seen(fit(PRESETS[name], box, aspect), box, aspect, (0.0, 80.0), apex) <= 1.0
    without = Box(320.0, 240.0, 80.0)
    assert fit(PRESETS["front"], box, aspect).distance == fit(PRESETS["front"], without, aspect).distance


def test_a_longer_lens_is_fitted_again(session: Session, peer: Peer) -> None:
    """Who looks at the camera from aside sees all of it after the focal length has changed."""
    session.show(with_camera(300.0), 0)
    wait_for(lambda: "Position" in peer.camera)
    peer.move_view("Side")
    wait_for(lambda: peer.camera["Fov"]["fov"] == pytest.approx(PRESETS["side"].fov_rad))
    near = peer.camera["Position"]["position"]
    peer.look(wide=800, high=600, position=tuple(near))
    session.show(with_camera(900.0), 1)
    wait_for(lambda: peer.camera["Position"]["position"][0] < 1.3 * near[0])


def with_camera(focal: float) -> Drawing:
    shown = drawing()
    corners = np.zeros((4, 3), dtype=np.float32)
    camera = Frustum(np.array((160, 120, focal), dtype=np.float32), corners, COLOURS["camera"], 1.0, "camera")
    return replace(shown, primitives={**shown.primitives, "camera": camera})


def test_the_front_looks_at_the_middle_of_the_picture_from_far_away() -> None:
    """A small field of view shows the picture as if there were no perspective."""
    view = fit(PRESETS["front"], Box(320.0, 240.0), 1.3)
    np.testing.assert_allclose(view.target, (159.5, -119.5, 0.0))
    assert view.distance > 5 * 320


def test_a_browser_that_comes_sees_the_whole_picture(session: Session, peer: Peer) -> None:
    """The camera is put obliquely before the picture without being asked."""
    session.show(drawing(), 0)
    wait_for(lambda: {"Position", "LookAt", "Fov"} <= peer.camera.keys())
    there, at = (np.array(peer.camera[kind][name]) for kind, name in (("Position", "position"), ("LookAt", "look_at")))
    assert 0.9 < seen(View(there, at, peer.camera["Fov"]["fov"]), SHOWN, 800 / 600, (0.0, 30.0)) <= 1.0
    assert there[0] < 0 < there[1], "from the left and from above"


def test_a_window_of_another_shape_is_fitted_again(session: Session, peer: Peer) -> None:
    """Nobody has moved the camera, so it backs away when the window becomes narrow."""
    session.show(drawing(), 0)
    wait_for(lambda: "Position" in peer.camera)
    place = peer.camera["Position"]["position"]
    peer.look(wide=300, high=600, position=tuple(place))
    wait_for(lambda: peer.camera["Position"]["position"][2] > 1.5 * place[2])


def test_the_start_pose_that_comes_late_is_put_right(session: Session, peer: Peer) -> None:
    """What viser replays to a new browser may overtake the fitted camera; where a person turned it, it stays."""
    session.show(drawing(), 0)
    wait_for(lambda: "Position" in peer.camera)
    start = fit(PRESETS[FIRST], SHOWN, aspect=1.2)
    peer.look(wide=400, high=560, position=tuple(peer.camera["Position"]["position"]))
    wait_for(lambda: "Position" in peer.camera)
    time.sleep(0.3)
    fitted = peer.camera.pop("Position")["position"]
    peer.look(wide=400, high=560, position=tuple(fitted))
    peer.look(wide=400, high=560, position=tuple(start.position.tolist()))
    wait_for(lambda: "Position" in peer.camera)
    np.testing.assert_allclose(peer.camera.pop("Position")["position"], fitted)
    peer.look(wide=400, high=560, position=tuple(fitted))
    peer.look(wide=400, high=560, position=(fitted[0] + 200.0, fitted[1], fitted[2]))
    time.sleep(0.3)
    assert "Position" not in peer.camera


def test_heights_appear_when_the_camera_is_tilted(session: Session, peer: Peer) -> None:
    """From the front the scene is flat, so that the estimate lies on the particles; from aside they rise."""
    session.show(drawing(), 0)
    wait_for(lambda: "/particles" in peer.nodes and "Position" in peer.camera)
    assert heights(peer).max() > 29.0
    peer.move_view("Front")
    wait_for(lambda: heights(peer).max() < 5.0)
    peer.move_view("Oblique")
    wait_for(lambda: heights(peer).max() > 29.0)


def test_what_a_browser_says_before_it_has_heard_of_the_preset_raises_nothing(session: Session, peer: Peer) -> None:
    """Its camera still stands aside; heights would flash up until the preset has reached it."""
    before = look_from_the_front(session, peer)
    peer.look(wide=800, high=600, position=before)
    peer.move("Particles", 42)  # taken up after the camera
    wait_for(lambda: session.values["sample_count"] == 42)
    assert session.viewer._cameras.relief == 0.0
    peer.look(wide=800, high=600, position=(900.0, 300.0, 500.0))
    wait_for(lambda: session.viewer._cameras.relief == 1.0)


def test_a_camera_that_is_nowhere_raises_nothing(session: Session, peer: Peer) -> None:
    """One browser that sends NaN would give all others heights of NaN."""
    look_from_the_front(session, peer)
    peer.look(wide=800, high=600, position=(float("nan"), 0.0, 500.0))
    peer.move("Particles", 42)  # taken up after the camera
    wait_for(lambda: session.values["sample_count"] == 42)
    assert session.viewer._cameras.relief == 0.0


def test_where_a_browser_came_from_raises_nothing_after_the_preset_was_reached(session: Session, peer: Peer) -> None:
    """While viser sets it up, its camera can jump back to its very first place; it is sent to the preset again."""
    look_from_the_front(session, peer)
    fitted = tuple(peer.camera.pop("Position")["position"])
    peer.look(wide=800, high=600, position=fitted)
    peer.look(wide=800, high=600)
    wait_for(lambda: "Position" in peer.camera)
    np.testing.assert_allclose(peer.camera["Position"]["position"], fitted)
    assert session.viewer._cameras.relief == 0.0


def look_from_the_front(session: Session, peer: Peer) -> tuple[float, float, float]:
    """Return where the camera was before."""
    session.show(drawing(), 0)
    wait_for(lambda: "/particles" in peer.nodes and "Position" in peer.camera)
    before = tuple(peer.camera.pop("Position")["position"])
    peer.move_view("Front")
    wait_for(lambda: "Position" in peer.camera and session.viewer._cameras.relief == 0.0)
    return before


def heights(peer: Peer) -> np.ndarray:
    return np.frombuffer(peer.nodes["/particles"]["points"], dtype=np.float32).reshape(-1, 3)[:, 2]
