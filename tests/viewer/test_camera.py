"""Presets fit the window, and cameras stay where a person has moved them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Drawing, Frustum
from pftrack_server.viewer.camera import FIRST, PRESETS, Box, View, fit
from tests.viewer.host import Peer, Session, drawing, f32
from tests.waiting import wait_for

SHOWN = Box(320.0, 240.0, 30.0)
"""Extent of `drawing`."""


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
def test_a_preset_contains_the_whole_box_and_little_more(name: str, aspect: float) -> None:
    """Every corner lies within the window, and one of them near its edge."""
    box = Box(320.0, 240.0, 50.0, behind=400.0, beside=156.0)
    view = fit(PRESETS[name], box, aspect)
    assert 0.9 < seen(view, box, aspect, (-400.0, 50.0) if PRESETS[name].deep else (0.0, 0.0)) <= 1.0


@pytest.mark.parametrize("name", ["side", "oblique"])
@pytest.mark.parametrize("focal", [120.0, 900.0])
@pytest.mark.parametrize("aspect", [0.3, 0.6, 1.3, 2.4, 4.0])
def test_from_aside_the_camera_that_took_the_picture_is_visible(name: str, focal: float, aspect: float) -> None:
    """For any focal length and shape of window, camera and picture are visible; the front preset ignores the camera."""
    apex = (159.5, -119.5, focal)
    box = Box(320.0, 240.0, 80.0, apex)
    assert 0.9 < seen(fit(PRESETS[name], box, aspect), box, aspect, (0.0, 80.0), apex) <= 1.0
    without = Box(320.0, 240.0, 80.0)
    assert fit(PRESETS["front"], box, aspect).distance == fit(PRESETS["front"], without, aspect).distance > 5 * 320


def with_camera(focal: float) -> Drawing:
    shown = drawing()
    camera = Frustum(f32(160, 120, focal), np.zeros((4, 3), dtype=np.float32), COLOURS["camera"], 1.0, "camera")
    return replace(shown, primitives={**shown.primitives, "camera": camera})


def place(peer: Peer) -> tuple[float, ...]:
    """Return the latest position to which a browser's camera was sent."""
    return tuple(peer.camera["Position"]["position"])


def test_a_longer_lens_is_fitted_again(session: Session, peer: Peer) -> None:
    """A person who looks from aside still sees the whole camera after the focal length has changed."""
    session.show(with_camera(300.0), 0, lambda: "Position" in peer.camera)
    peer.move_view("Side", until=lambda: peer.camera["Fov"]["fov"] == pytest.approx(PRESETS["side"].fov_rad))
    near = place(peer)
    peer.look(wide=800, high=600, position=near)
    session.show(with_camera(900.0), 1, lambda: place(peer)[0] < 1.3 * near[0])


def test_a_browser_sees_the_whole_picture_in_a_window_of_any_shape(session: Session, peer: Peer) -> None:
    """The camera starts at an oblique view, and moves back when the window becomes narrow, unless a person moved it."""
    session.show(drawing(), 0, lambda: {"Position", "LookAt", "Fov"} <= peer.camera.keys())
    there, at = np.array(place(peer)), np.array(peer.camera["LookAt"]["look_at"])
    assert 0.9 < seen(View(there, at, peer.camera["Fov"]["fov"]), SHOWN, 800 / 600, (0.0, 30.0)) <= 1.0
    assert there[0] < 0 < there[1], "from the left and from above"
    peer.look(wide=300, high=600, position=tuple(there.tolist()))
    wait_for(lambda: place(peer)[2] > 1.5 * there[2])


def test_a_late_start_pose_is_corrected(session: Session, peer: Peer) -> None:
    """Viser's replay to a new browser may overtake the fitted camera; a camera that a person moved stays."""
    session.show(drawing(), 0, lambda: "Position" in peer.camera)
    start = tuple(fit(PRESETS[FIRST], SHOWN, aspect=1.2).position.tolist())
    before = place(peer)
    peer.look(wide=400, high=560, position=before)
    wait_for(lambda: place(peer) != before)
    fitted = place(peer)
    del peer.camera["Position"]
    peer.look(wide=400, high=560, position=fitted)
    peer.look(wide=400, high=560, position=start)
    wait_for(lambda: "Position" in peer.camera)
    np.testing.assert_allclose(peer.camera.pop("Position")["position"], fitted)
    peer.look(wide=400, high=560, position=fitted)
    peer.look(wide=400, high=560, position=(fitted[0] + 200.0, *fitted[1:]))
    heard(session, peer)
    (watcher,) = session.viewer._cameras._watchers.values()
    assert watcher.arrived, "it was not sent back"


def test_a_camera_on_its_way_to_a_preset_does_not_change_heights(session: Session, peer: Peer) -> None:
    """Heights neither flash up while it is still aside, nor become NaN for all browsers because one sends NaN.

    A camera that jumps back to its first position while viser sets it up is sent to the preset again.
    """
    session.show(drawing(), 0, lambda: "/particles" in peer.nodes and "Position" in peer.camera)
    before, cameras = place(peer), session.viewer._cameras
    del peer.camera["Position"]
    peer.move_view("Front", until=lambda: "Position" in peer.camera and cameras.relief == 0.0)
    fitted = place(peer)
    for position in (before, (float("nan"), 0.0, 500.0)):
        peer.look(wide=800, high=600, position=position)
        heard(session, peer)
        assert cameras.relief == 0.0
    del peer.camera["Position"]
    peer.look(wide=800, high=600, position=fitted)
    peer.look(wide=800, high=600)
    wait_for(lambda: "Position" in peer.camera)
    np.testing.assert_allclose(place(peer), fitted)
    assert cameras.relief == 0.0
    peer.look(wide=800, high=600, position=(900.0, 300.0, 500.0))
    wait_for(lambda: cameras.relief == 1.0)


def heard(session: Session, peer: Peer) -> None:
    """Wait until the messages of a browser are processed."""
    value = session.values["occlusion_width_px"] + 1.0  # type: ignore[operator]  # a number
    peer.move("Occluder width (px)", value, lambda: session.values["occlusion_width_px"] == value)
