"""The primitives of a drawing become nodes that are updated in place."""

from dataclasses import replace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from pftrack.core.model import drawing as model
from pftrack.core.model.drawing import COLOURS, Drawing, Links, Mesh, Picture, Points, Polyline, Primitive
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.pictures import PictureEncoder
from tests.viewer.host import Peer, Session, Site, drawing, f32
from tests.waiting import wait_for

FACES = np.array(((0, 1, 2),), dtype=np.int32)
LINE = Polyline(f32((0, 0, 0), (5, 5, 5)), COLOURS["truth"], 1.0, "estimate")


def rows(peer: Peer, name: str, key: str = "points") -> np.ndarray:
    """Return the positions of a node as rows."""
    return np.frombuffer(peer.nodes[name][key], dtype=np.float32).reshape(-1, 3)


def count(peer: Peer) -> int:
    """Return how many particles are in the scene."""
    return len(rows(peer, "/particles")) if "/particles" in peer.nodes else 0


def with_items(shown: Drawing, **items: Primitive) -> Drawing:
    return replace(shown, primitives={**shown.primitives, **items})


def dark(size: tuple[int, int] = (240, 320)) -> Picture:
    return Picture(np.full((*size, 3), 20, dtype=np.uint8))


def triangle(side: float) -> Mesh:
    return Mesh(f32((0, 0, 1), (side, 0, 9), (0, side, 5)), FACES, COLOURS["estimate"], 0.5, "head")


def links(start: tuple[float, ...], end: tuple[float, ...], layer: str = "estimate") -> Links:
    return Links(f32((start, end)), COLOURS["truth"], 1.0, layer)


def test_picture_and_particles_reach_the_browser(session: Session, peer: Peer) -> None:
    """Positions are exact float32 with y upwards, and the picture is a JPEG of its own size.

    Another number of particles replaces the arrays of the same node. A hidden node has the number of the frame.
    """
    shown = drawing(3)
    session.show(shown, 3, lambda: {"/picture", "/particles", "/estimate"} <= peer.nodes.keys())
    cloud = shown.primitives["particles"]
    assert isinstance(cloud, Points)
    np.testing.assert_array_equal(rows(peer, "/particles")[:, :2], cloud.positions[:, :2] * (1, -1))
    node, picture = peer.nodes["/particles"], peer.nodes["/picture"]
    assert node["point_size"] == cloud.size / 2.0, "viser's sizes are radii"
    assert (picture["_format"], picture["render_width"], picture["render_height"]) == ("jpeg", 320.0, 240.0)
    decoded = cv2.imdecode(np.frombuffer(picture["_data"], dtype=np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_allclose(decoded[30, 30, ::-1], (208, 32, 32), atol=12)
    session.show(drawing(1, 200), 1, lambda: count(peer) == 200)
    assert peer.nodes["/particles"] is node
    assert len(node["colors"]) == 600
    wait_for(lambda: peer.nodes["/frame"]["position"] == [1.0, 0.0, 0.0])


def test_the_newest_drawing_wins(session: Session, peer: Peer) -> None:
    """Older drawings are not sent, and the last one always is."""
    sent = [session.pictures.for_scene(drawing(0, 10 + frame)) for frame in range(200)]
    session.loop.call(lambda: [session.viewer.show(each, frame) for frame, each in enumerate(sent)])
    wait_for(lambda: count(peer) == 209)
    assert peer.batches < 100


def test_a_scene_that_nobody_watches_is_not_drawn(session: Session, site: Site, drawn: list[str | None]) -> None:
    """The next browser gets the newest drawing at once."""
    for frame in range(20):
        session.show(drawing(frame, 50 + frame), frame)
    assert drawn == []
    with Peer(site.scene) as peer:
        wait_for(lambda: count(peer) == 69)
    assert set(drawn) == {"Frame 19"}


def test_an_absent_primitive_is_hidden_and_comes_back(session: Session, peer: Peer) -> None:
    """A mesh at NaN is hidden, too; another kind of primitive under the same name replaces the node."""
    shown = drawing()
    session.show(with_items(shown, mesh=triangle(3.0)), 0, lambda: peer.visible.get("/estimate"))
    wait_for(lambda: peer.visible.get("/mesh"))
    session.show(with_items(drawing(1, 50), mesh=triangle(np.nan)), 1, lambda: peer.visible.get("/mesh") is False)
    session.show(replace(shown, primitives={"picture": shown.primitives["picture"]}), 2)
    wait_for(lambda: peer.visible.get("/estimate") is False and peer.visible.get("/particles") is False)
    session.show(drawing(3), 3, lambda: peer.visible.get("/estimate"))
    axes = model.Axes(f32(10, 20, 5), np.eye(3, dtype=np.float32), 10.0, COLOURS["estimate"], 2.0, "pose")
    session.show(with_items(shown, mesh=LINE, axes=axes), 4, lambda: "/axes" in peer.nodes)
    wait_for(lambda: peer.nodes["/mesh"]["kind"] == "LineSegmentsMessage")


def test_old_names_are_forgotten(session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene does not grow if its primitives have new names in each frame."""
    monkeypatch.setattr("pftrack_server.viewer.scene.STALE_NODES", 2)
    for frame in range(6):
        shown = with_items(drawing(frame, 50), **{f"line {frame}": LINE})
        session.show(shown, frame, lambda frame=frame: f"/line {frame}" in peer.nodes)
    wait_for(lambda: {name for name in peer.nodes if name.startswith("/line")} == {f"/line {n}" for n in (3, 4, 5)})


def test_layers_are_switched_in_the_panel(session: Session, peer: Peer) -> None:
    """A hidden layer is not sent; switched on, it appears without another frame."""
    session.show(drawing(), 0, lambda: peer.visible.get("/particles"))
    assert "/label" not in peer.nodes
    peer.move("Labels", True, lambda: "/label" in peer.nodes)
    # A parameter has the same title.
    for item in peer.controls.values():
        if item["kind"] == "GuiCheckboxMessage" and item["label"] == "Particles":
            item["label"] = "Particles (layer)"
    peer.move("Particles (layer)", False, lambda: peer.visible.get("/particles") is False)


def test_layers_through_time_replace_flat_ones_from_aside(session: Session, peer: Peer) -> None:
    """The viewer decides by their roles; a layer that is switched off stays hidden from all sides."""
    shown = with_items(drawing(), past=links((0, 0, 0), (5, 5, -90), "history"))
    session.show(shown, 0, lambda: peer.visible.get("/past") and not peer.visible.get("/trail"))
    np.testing.assert_allclose(rows(peer, "/past")[1], (5, -5, -90), atol=0.5)
    peer.move_view("Front", until=lambda: not peer.visible["/past"] and peer.visible.get("/trail"))
    peer.move_view("Side", until=lambda: peer.visible["/past"] and not peer.visible["/trail"])
    peer.move("History", False, lambda: not peer.visible["/past"])


def test_depth_is_shown_from_aside(session: Session, peer: Peer) -> None:
    """A particle stands on a stem from its place in the picture; from the front there are no stems.

    A map over a picture is a relief, with a vertex at the height of its number in the middle of each cell.
    """
    levels = np.zeros((3, 4), dtype=np.float32)
    levels[1, 2] = 1.0
    shown: Any = drawing(0, 3).primitives
    raised = replace(shown["particles"], stems=True), replace(shown["picture"], relief=levels)
    session.show(with_items(drawing(0, 3), particles=raised[0], picture=raised[1]), 0)
    wait_for(lambda: peer.visible.get("/particles raised") and "/picture raised" in peer.nodes)
    stems = rows(peer, "/particles raised").reshape(-1, 2, 3)
    np.testing.assert_allclose(stems[:, :, 2], [(0, 15), (0, 30)], atol=1.0)
    np.testing.assert_allclose(stems[:, 0, :2], rows(peer, "/particles")[1:, :2])
    vertices = rows(peer, "/picture raised", "vertices")
    np.testing.assert_allclose(vertices[6], (199.5, -119.5, 320 / 6), atol=1.0)
    assert (len(vertices), np.delete(vertices[:, 2], 6).max() < 1.0) == (12, True)
    peer.move_view("Front", until=lambda: not peer.visible["/particles raised"])


def test_a_faulty_primitive_does_not_affect_others(session: Session, peer: Peer) -> None:
    """Later primitives and the caption are shown."""
    wrong = model.Text(f32(0, 0, 0), "APF", COLOURS["estimate"], "estimate", anchor=cast("Any", "nowhere"))
    bad = Points(np.zeros((3, 3), dtype=np.float32), np.zeros((2, 3), dtype=np.uint8), 1.0)
    session.show(with_items(drawing(0, 50), wrong=wrong, bad=bad), 0, lambda: count(peer) == 50)
    session.show(drawing(1, 60), 1)
    wait_for(lambda: any("Frame 1" in str(item.get("content")) for item in list(peer.controls.values())))
    assert count(peer) == 60


def test_an_error_of_the_panel_does_not_end_the_scene(
    session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is logged once, and the scene goes on."""
    monkeypatch.setattr("pftrack_server.viewer.viewer.warnings", RateLimitedLogger("viewer"))
    failed: list[int] = []

    def fail(frame: int) -> None:
        failed.append(frame)
        raise RuntimeError("on purpose")

    with monkeypatch.context() as broken:
        broken.setattr(session.viewer._panel, "frame", fail)
        for frame in range(3):
            session.show(drawing(frame, 50), frame, lambda frame=frame: frame in failed)
    session.show(drawing(4, 60), 4, lambda: count(peer) == 60)
    assert capsys.readouterr().out.count("RuntimeError: on purpose") == 1


def test_unchanged_nodes_are_not_sent_again(session: Session, peer: Peer) -> None:
    """A change while paused sends only what it moves, also if the same picture comes from another worker.

    The web process forwards the file of a picture unchanged.
    """
    shown = with_items(drawing(), axis=LINE)
    sent = session.pictures.for_scene(shown)
    session.show(shown, 0, lambda: {"/picture", "/axis"} <= peer.nodes.keys())
    data, line = peer.nodes["/picture"]["_data"], peer.nodes["/axis"]["points"]
    assert data == sent.pictures["picture"].file
    session.pictures = PictureEncoder()
    again = with_items(drawing(0, 50), axis=replace(LINE, positions=LINE.positions.copy()))
    session.show(with_items(again, picture=shown.primitives["picture"]), 0, lambda: count(peer) == 50)
    assert peer.nodes["/picture"]["_data"] is data
    assert peer.nodes["/axis"]["points"] is line
    other = with_items(shown, axis=replace(LINE, positions=2 * LINE.positions, colour=COLOURS["lost"]), picture=dark())
    session.show(other, 1, lambda: peer.nodes["/axis"]["colors"] == bytes(COLOURS["lost"]))
    assert peer.nodes["/axis"]["points"] is not line
    wait_for(lambda: peer.nodes["/picture"]["_data"] == session.pictures.for_scene(other).pictures["picture"].file)


def test_a_hidden_picture_comes_back_in_its_present_state(session: Session, peer: Peer) -> None:
    """It is not sent while its layer is off; then the newest one is, with its own size."""
    session.show(drawing(), 0, lambda: peer.visible.get("/picture"))
    data = peer.nodes["/picture"]["_data"]
    peer.move("Picture", False, lambda: peer.visible.get("/picture") is False)
    session.show(with_items(drawing(1, 50), picture=dark((60, 80))), 1, lambda: count(peer) == 50)
    assert peer.nodes["/picture"]["_data"] is data
    peer.move("Picture", True)
    wait_for(lambda: peer.visible.get("/picture") and peer.nodes["/picture"]["render_width"] == 80.0)
    assert peer.nodes["/picture"]["_data"] != data


def test_only_changed_parts_of_a_mesh_are_sent(session: Session, peer: Peer) -> None:
    """A change of vertices or colour leaves the triangles, which are the largest part."""
    session.show(with_items(drawing(), mesh=triangle(3.0)), 0, lambda: "/mesh" in peer.nodes)
    node = peer.nodes["/mesh"]
    faces = node["faces"]
    session.show(with_items(drawing(1), mesh=triangle(5.0)), 1, lambda: rows(peer, "/mesh", "vertices")[1, 0] == 5.0)
    assert node["faces"] is faces
    vertices, lost = node["vertices"], replace(triangle(5.0), colour=COLOURS["lost"])
    session.show(with_items(drawing(2), mesh=lost), 2, lambda: tuple(node["color"]) == COLOURS["lost"])
    assert (node["vertices"] is vertices, node["faces"] is faces) == (True, True)
    turned = replace(lost, faces=FACES[:, [0, 2, 1]])
    session.show(with_items(drawing(3), mesh=turned), 3, lambda: node["faces"] is not faces)


def test_a_mesh_with_colours_of_its_own_is_updated_in_place(session: Session, peer: Peer) -> None:
    """Only changed vertices, triangles or colours are sent; with a single colour the mesh becomes another node."""

    def show(frame: int, mesh: Mesh, until: Any) -> None:
        session.show(with_items(drawing(frame), mesh=mesh), frame, until)

    def colours() -> list[int]:
        return list(peer.nodes["/mesh colours"]["colors"])

    own = np.array(((255, 0, 0), (0, 255, 0), (0, 0, 255)), dtype=np.uint8)
    mesh = replace(triangle(3.0), colour=own, opacity=1.0)
    show(0, mesh, lambda: {"/mesh", "/mesh colours"} <= peer.nodes.keys())
    node, paint = peer.nodes["/mesh"], peer.nodes["/mesh colours"]
    assert colours() == [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255]
    assert (node["opacity"], peer.visible.get("/mesh colours")) == (None, False)
    faces, first = node["faces"], paint["colors"]
    moved = replace(mesh, vertices=triangle(5.0).vertices, colour=own.copy())
    show(1, moved, lambda: rows(peer, "/mesh", "vertices")[1, 0] == 5.0)
    assert (node["faces"] is faces, paint["colors"] is first) == (True, True)
    vertices = node["vertices"]
    fading = replace(moved, opacity=f32(1.0, 0.6, 0.0))
    show(2, fading, lambda: colours()[-3:] == [255, 153, 0])
    assert (node["opacity"], node["vertices"] is vertices, node["faces"] is faces) == (1.0, True, True)
    corners = np.concatenate([fading.vertices, fading.vertices[:1] + 1])
    grown = Mesh(corners, np.array(((0, 1, 2), (1, 2, 3)), np.int32), np.concatenate([own, own[:1]]), 0.5, "head")
    show(3, grown, lambda: len(colours()) == 3 * (4 + 2) and len(node["vertices"]) == 48)
    assert len(peer.nodes["/mesh colours"]["points"]) % 6 == 0
    show(4, triangle(3.0), lambda: tuple(peer.nodes["/mesh"]["color"]) == COLOURS["estimate"])


def test_a_mesh_is_pressed_into_its_layer(session: Session, peer: Peer) -> None:
    """From the front it lies behind later layers, with its parts in order; from aside it rises."""

    def heights() -> np.ndarray:
        return rows(peer, "/mesh", "vertices")[:, 2]

    shown = with_items(drawing(), mesh=triangle(9.0), line=links((0, 0, 2), (9, 9, 9)))
    session.show(shown, 0, lambda: {"/mesh", "/line"} <= peer.nodes.keys())
    peer.move_view("Front", until=lambda: heights().max() < 1.0)
    assert heights()[0] < heights()[2] < heights()[1] < rows(peer, "/line")[:, 2].min()
    peer.move_view("Side", until=lambda: heights().max() > 8.9)


def test_the_camera_is_visible_only_from_aside(session: Session, peer: Peer) -> None:
    """From the front its rays would cross the picture; from aside high points lie on them."""
    corners = f32((0, 0, 0), (320, 0, 0), (320, 240, 0), (0, 240, 0))
    camera = model.Frustum(f32(160, 120, 300), corners, COLOURS["camera"], 1.0, "camera")
    shown = with_items(drawing(), camera=camera, high=links((40, 60, 100), (40, 60, 200)))
    session.show(shown, 0, lambda: peer.visible.get("/high"))
    peer.move_view("Front", until=lambda: not peer.visible.get("/camera"))
    np.testing.assert_allclose(rows(peer, "/high")[:, :2], [(40, -60), (40, -60)])
    peer.move_view("Side", until=lambda: peer.visible.get("/camera"))
    rays = rows(peer, "/camera").reshape(-1, 2, 3)[:4]
    np.testing.assert_allclose(rays[:, 0], np.tile((160, -120, 300), (4, 1)), atol=1.0)
    np.testing.assert_allclose(rays[2, 1], (320, -240, 0), atol=1.0)
    np.testing.assert_allclose(rows(peer, "/high")[:, :2], [(80, -80), (120, -100)], atol=0.5)
    peer.move_view("Front", until=lambda: not peer.visible.get("/camera"))
