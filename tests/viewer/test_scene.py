"""A drawing's primitives become nodes that are updated in place."""

from dataclasses import replace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from pftrack.core.model.drawing import (
    COLOURS,
    Axes,
    Drawing,
    Frustum,
    Links,
    Mesh,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
)
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.pictures import PictureEncoder
from tests.viewer.host import Peer, Session, Site, drawing
from tests.waiting import wait_for


def points(peer: Peer) -> np.ndarray:
    return np.frombuffer(peer.nodes["/particles"]["points"], dtype=np.float32).reshape(-1, 3)


def with_item(shown: Drawing, name: str, item: Primitive) -> Drawing:
    return replace(shown, primitives={**shown.primitives, name: item})


def test_picture_and_particles_reach_the_browser(session: Session, peer: Peer) -> None:
    """Positions are exact to the float32, y is turned, and the picture is a JPEG of its own size."""
    shown = drawing(3)
    session.show(shown, 3)
    wait_for(lambda: {"/picture", "/particles", "/estimate"} <= peer.nodes.keys())
    cloud = shown.primitives["particles"]
    assert isinstance(cloud, Points)
    np.testing.assert_array_equal(points(peer)[:, 0], cloud.positions[:, 0])
    np.testing.assert_array_equal(points(peer)[:, 1], -cloud.positions[:, 1])
    assert peer.nodes["/particles"]["point_size"] == cloud.size / 2.0, "viser's sizes are radii"
    picture = peer.nodes["/picture"]
    assert (picture["_format"], picture["render_width"], picture["render_height"]) == ("jpeg", 320.0, 240.0)
    decoded = cv2.imdecode(np.frombuffer(picture["_data"], dtype=np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_allclose(decoded[30, 30, ::-1], (208, 32, 32), atol=12)


def test_nodes_are_updated_not_added_again(session: Session, peer: Peer) -> None:
    """Another number of particles replaces the arrays of the same node."""
    session.show(drawing(0, 800), 0)
    wait_for(lambda: "/particles" in peer.nodes)
    node = peer.nodes["/particles"]
    session.show(drawing(1, 200), 1)
    wait_for(lambda: len(points(peer)) == 200)
    assert peer.nodes["/particles"] is node
    assert len(node["colors"]) == 600


def test_the_newest_drawing_wins(session: Session, peer: Peer) -> None:
    """Drawings that were overtaken are not sent, and the last one always is."""
    for frame in range(200):
        session.show(drawing(0, 10 + frame), frame)
    wait_for(lambda: "/particles" in peer.nodes and len(points(peer)) == 209)
    assert peer.batches < 100


def test_a_scene_that_nobody_watches_is_not_drawn(session: Session, site: Site, drawn: list[str | None]) -> None:
    """Whoever comes next is shown the newest drawing at once."""
    for frame in range(20):
        session.show(drawing(frame, 50 + frame), frame)
    assert drawn == []
    with Peer(site.scene) as peer:
        wait_for(lambda: "/particles" in peer.nodes and len(points(peer)) == 69)
    assert set(drawn) == {"Frame 19"}


def test_what_is_absent_is_hidden_and_comes_back(session: Session, peer: Peer) -> None:
    """An estimate that is lost for a while leaves nothing behind."""
    shown = drawing()
    session.show(shown, 0)
    wait_for(lambda: peer.visible.get("/estimate"))
    session.show(replace(shown, primitives={"picture": shown.primitives["picture"]}), 1)
    wait_for(lambda: peer.visible.get("/estimate") is False and peer.visible.get("/particles") is False)
    session.show(drawing(2), 2)
    wait_for(lambda: peer.visible.get("/estimate"))


def test_names_that_do_not_come_back_are_forgotten(
    session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scene whose primitives have a new name in each frame does not grow."""
    monkeypatch.setattr("pftrack_server.viewer.scene.STALE_NODES", 2)
    line = Polyline(np.array(((0, 0, 0), (5, 5, 5)), dtype=np.float32), COLOURS["truth"], 1.0, "estimate")
    for frame in range(6):
        session.show(with_item(drawing(frame, 50), f"line {frame}", line), frame)
        wait_for(lambda frame=frame: f"/line {frame}" in peer.nodes)
    wait_for(
        lambda: sorted(name for name in peer.nodes if name.startswith("/line")) == [f"/line {n}" for n in (3, 4, 5)]
    )


def test_layers_are_switched_in_the_panel(session: Session, peer: Peer) -> None:
    """A layer that is off is not sent at all; switched on, it appears without waiting for a new frame."""
    session.show(drawing(), 0)
    wait_for(lambda: peer.visible.get("/particles"))
    assert "/label" not in peer.nodes
    peer.move("Labels", True)
    wait_for(lambda: "/label" in peer.nodes)
    peer.move(_layer(peer, "Particles"), False)
    wait_for(lambda: peer.visible.get("/particles") is False)


def test_layers_through_time_take_the_place_of_flat_ones_seen_from_aside(session: Session, peer: Peer) -> None:
    """The viewer knows their roles, not their names; a layer that is switched off is seen from nowhere."""
    past = np.array((((0, 0, 0), (5, 5, -90)),), dtype=np.float32)
    session.show(with_item(drawing(), "past", Links(past, COLOURS["truth"], 1.0, "history")), 0)
    wait_for(lambda: peer.visible.get("/past") and not peer.visible.get("/trail"))
    np.testing.assert_allclose(ends(peer, "/past")[1], (5, -5, -90), atol=0.5)
    peer.move_view("Front")
    wait_for(lambda: not peer.visible["/past"] and peer.visible.get("/trail"))
    peer.move_view("Side")
    wait_for(lambda: peer.visible["/past"] and not peer.visible["/trail"])
    peer.move("History", False)
    wait_for(lambda: not peer.visible["/past"])


def test_a_particle_stands_on_a_stem_where_there_is_depth(session: Session, peer: Peer) -> None:
    """From its place in the picture up to where it is; from the front there are no stems."""
    shown = drawing(0, 3)
    session.show(with_item(shown, "particles", replace(shown.primitives["particles"], stems=True)), 0)  # type: ignore[type-var]
    wait_for(lambda: peer.visible.get("/particles raised"))
    stems = ends(peer, "/particles raised").reshape(-1, 2, 3)
    np.testing.assert_allclose(stems[:, :, 2], [(0, 15), (0, 30)], atol=1.0)
    np.testing.assert_allclose(stems[:, 0, :2], points(peer)[1:, :2])
    peer.move_view("Front")
    wait_for(lambda: not peer.visible["/particles raised"])


def test_what_is_mapped_over_a_picture_is_a_relief_where_there_is_depth(session: Session, peer: Peer) -> None:
    """Each cell has a vertex in its middle, as high as its number says."""
    levels = np.zeros((3, 4), dtype=np.float32)
    levels[1, 2] = 1.0
    shown = drawing()
    session.show(with_item(shown, "picture", replace(shown.primitives["picture"], relief=levels)), 0)  # type: ignore[type-var]
    wait_for(lambda: "/picture raised" in peer.nodes)
    vertices = np.frombuffer(peer.nodes["/picture raised"]["vertices"], dtype=np.float32).reshape(-1, 3)
    np.testing.assert_allclose(vertices[6], (199.5, -119.5, 320 / 6), atol=1.0)
    assert len(vertices) == 12
    assert np.delete(vertices[:, 2], 6).max() < 1.0


def _layer(peer: Peer, title: str) -> str:
    """Return the label of a layer's box, renamed where a parameter has the same title."""
    for item in peer.controls.values():
        if item["kind"] == "GuiCheckboxMessage" and item["label"] == title:
            item["label"] = f"{title} (layer)"
    return f"{title} (layer)"


def test_every_primitive_has_a_node(session: Session, peer: Peer) -> None:
    """Frames, meshes and links are shown as well, and may change their kind under the same name."""
    centre = np.array((10, 20, 5), dtype=np.float32)
    shown = drawing()
    shown = with_item(shown, "axes", Axes(centre, np.eye(3, dtype=np.float32), 10.0, COLOURS["estimate"], 2.0, "pose"))
    faces = np.array(((0, 1, 2),), dtype=np.int32)
    shown = with_item(shown, "mesh", Mesh(np.eye(3, dtype=np.float32), faces, COLOURS["second"], 0.5, "pose"))
    segments = np.array((((0, 0, 0), (5, 5, 5)),), dtype=np.float32)
    shown = with_item(shown, "links", Links(segments, COLOURS["second"], 2.0, "pose"))
    for _ in range(2):  # once to add, once to update
        session.show(replace(shown, primitives=dict(shown.primitives)), 0)
        wait_for(lambda: {"/axes", "/mesh", "/links"} <= peer.nodes.keys())
        shown = with_item(shown, "mesh", Mesh(2 * np.eye(3, dtype=np.float32), faces, COLOURS["second"], 0.5, "pose"))
    wait_for(lambda: np.frombuffer(peer.nodes["/mesh"]["vertices"], dtype=np.float32).max() > 1.9)
    line = Polyline(np.array(((0, 0, 0), (5, 5, 5)), dtype=np.float32), COLOURS["truth"], 1.0, "pose")
    session.show(with_item(shown, "mesh", line), 1)
    wait_for(lambda: peer.nodes["/mesh"]["kind"] == "LineSegmentsMessage")


def test_a_picture_arrives_as_the_worker_has_encoded_it(session: Session, peer: Peer) -> None:
    """The web process forwards the file; of the pixels it has seen nothing."""
    sent = session.pictures.for_scene(drawing())
    session.loop.call(session.viewer.show, sent, 0)
    wait_for(lambda: "/picture" in peer.nodes)
    assert peer.nodes["/picture"]["_data"] == sent.pictures["picture"].file
    other = session.pictures.for_scene(with_item(drawing(1), "picture", dark()))
    session.loop.call(session.viewer.show, other, 1)
    wait_for(lambda: peer.nodes["/picture"]["_data"] == other.pictures["picture"].file)


def test_a_primitive_that_cannot_be_shown_ends_nothing(session: Session, peer: Peer) -> None:
    """What comes after it is shown to the end, which is the caption, whether it is still there or not."""
    wrong = Text(np.zeros(3, dtype=np.float32), "APF", COLOURS["estimate"], "estimate", anchor=cast("Any", "nowhere"))
    bad = Points(np.zeros((3, 3), dtype=np.float32), np.zeros((2, 3), dtype=np.uint8), 1.0)
    session.show(with_item(with_item(drawing(0, 50), "wrong", wrong), "bad", bad), 0)
    wait_for(lambda: "/particles" in peer.nodes and len(points(peer)) == 50)
    session.show(drawing(1, 60), 1)
    wait_for(lambda: any("Frame 1" in str(item.get("content")) for item in list(peer.controls.values())))
    assert len(points(peer)) == 60


def test_a_failure_beside_the_drawing_ends_nothing(
    session: Session, peer: Peer, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The panel that fails is written down once, and the scene goes on."""
    monkeypatch.setattr("pftrack_server.viewer.viewer.warnings", RateLimitedLogger("viewer"))
    failed: list[int] = []

    def fail(frame: int) -> None:
        failed.append(frame)
        raise RuntimeError("on purpose")

    with monkeypatch.context() as broken:
        broken.setattr(session.viewer._panel, "frame", fail)
        for frame in range(3):
            session.show(drawing(frame, 50), frame)
            wait_for(lambda frame=frame: frame in failed)
    session.show(drawing(4, 60), 4)
    wait_for(lambda: "/particles" in peer.nodes and len(points(peer)) == 60)
    assert capsys.readouterr().out.count("RuntimeError: on purpose") == 1


def test_the_scene_tells_which_frame_it_shows(session: Session, peer: Peer) -> None:
    """A node that nobody sees stands there, where the page around looks for it."""
    for frame in (7, 3):
        session.show(drawing(frame), frame)
        wait_for(lambda frame=frame: peer.nodes.get("/frame", {}).get("position") == [float(frame), 0.0, 0.0])


def test_what_is_unchanged_is_not_sent_again(session: Session, peer: Peer) -> None:
    """While paused only what a parameter moves is sent, also when the same file comes from another worker."""
    corners = np.array([(0, 0, 0), (9, 9, 9)], dtype=np.float32)
    shown = with_item(drawing(), "axis", Polyline(corners, COLOURS["truth"], 1.0, "truth"))
    session.show(shown, 0)
    wait_for(lambda: {"/picture", "/axis"} <= peer.nodes.keys())
    data, line = peer.nodes["/picture"]["_data"], peer.nodes["/axis"]["points"]
    session.pictures = PictureEncoder()
    again = with_item(drawing(0, 50), "axis", Polyline(corners.copy(), COLOURS["truth"], 1.0, "truth"))
    session.show(with_item(again, "picture", shown.primitives["picture"]), 0)
    wait_for(lambda: len(points(peer)) == 50)
    assert peer.nodes["/picture"]["_data"] is data
    assert peer.nodes["/axis"]["points"] is line
    session.show(with_item(shown, "axis", Polyline(2 * corners, COLOURS["lost"], 1.0, "truth")), 1)
    wait_for(lambda: peer.nodes["/axis"]["colors"] == bytes(COLOURS["lost"]))
    assert peer.nodes["/axis"]["points"] is not line


def test_a_picture_that_was_hidden_comes_back_as_it_is_by_now(session: Session, peer: Peer) -> None:
    """While its layer is off nothing of it is sent; then the newest is, of its own size."""
    session.show(drawing(), 0)
    wait_for(lambda: peer.visible.get("/picture"))
    data = peer.nodes["/picture"]["_data"]
    peer.move("Picture", False)
    wait_for(lambda: peer.visible.get("/picture") is False)
    session.show(with_item(drawing(1, 50), "picture", dark((60, 80))), 1)
    wait_for(lambda: len(points(peer)) == 50)
    assert peer.nodes["/picture"]["_data"] is data
    peer.move("Picture", True)
    wait_for(lambda: peer.visible.get("/picture") and peer.nodes["/picture"]["render_width"] == 80.0)
    assert peer.nodes["/picture"]["_data"] != data


def dark(size: tuple[int, int] = (240, 320)) -> Picture:
    return Picture(np.full((*size, 3), 20, dtype=np.uint8))


def triangle(side: float) -> Mesh:
    vertices = np.array(((0, 0, 1), (side, 0, 9), (0, side, 5)), dtype=np.float32)
    return Mesh(vertices, np.array(((0, 1, 2),), dtype=np.int32), COLOURS["estimate"], 0.5, "head")


def test_of_a_mesh_only_what_changes_is_sent(session: Session, peer: Peer) -> None:
    """Its vertices, or its colour; its triangles, which are most of it, stay what they were until there are others."""
    session.show(with_item(drawing(), "mesh", triangle(3.0)), 0)
    wait_for(lambda: "/mesh" in peer.nodes)
    node = peer.nodes["/mesh"]
    faces = node["faces"]
    session.show(with_item(drawing(1), "mesh", triangle(5.0)), 1)
    wait_for(lambda: np.frombuffer(node["vertices"], dtype=np.float32)[3] == 5.0)
    assert node["faces"] is faces
    vertices, lost = node["vertices"], replace(triangle(5.0), colour=COLOURS["lost"])
    session.show(with_item(drawing(2), "mesh", lost), 2)
    wait_for(lambda: tuple(node["color"]) == COLOURS["lost"])
    assert (node["vertices"] is vertices, node["faces"] is faces) == (True, True)
    session.show(with_item(drawing(3), "mesh", replace(lost, faces=np.array(((0, 2, 1),), dtype=np.int32))), 3)
    wait_for(lambda: node["faces"] is not faces)


def test_a_mesh_with_colours_of_its_own_is_updated_in_place(session: Session, peer: Peer) -> None:
    """Of vertices, triangles and colours only what changes is sent; as one of one colour it is another node."""

    def colours() -> list[int]:
        return list(peer.nodes["/mesh colours"]["colors"])

    own = np.array(((255, 0, 0), (0, 255, 0), (0, 0, 255)), dtype=np.uint8)
    mesh = replace(triangle(3.0), colour=own, opacity=1.0)
    session.show(with_item(drawing(), "mesh", mesh), 0)
    wait_for(lambda: {"/mesh", "/mesh colours"} <= peer.nodes.keys())
    node, paint = peer.nodes["/mesh"], peer.nodes["/mesh colours"]
    assert colours() == [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255]
    assert node["opacity"] is None
    assert peer.visible.get("/mesh colours") is False
    vertices, faces, first = node["vertices"], node["faces"], paint["colors"]
    moved = replace(mesh, vertices=triangle(5.0).vertices, colour=own.copy())
    session.show(with_item(drawing(1), "mesh", moved), 1)
    wait_for(lambda: np.frombuffer(node["vertices"], dtype=np.float32)[3] == 5.0)
    assert (node["faces"] is faces, paint["colors"] is first) == (True, True)
    vertices = node["vertices"]
    fading = replace(moved, opacity=np.array((1.0, 0.6, 0.0), dtype=np.float32))
    session.show(with_item(drawing(2), "mesh", fading), 2)
    wait_for(lambda: colours()[-3:] == [255, 153, 0])
    assert node["opacity"] == 1.0
    assert (node["vertices"] is vertices, node["faces"] is faces) == (True, True)
    grown = Mesh(
        np.concatenate([fading.vertices, fading.vertices[:1] + 1]),
        np.array(((0, 1, 2), (1, 2, 3)), dtype=np.int32),
        np.concatenate([own, own[:1]]),
        0.5,
        "head",
    )
    session.show(with_item(drawing(3), "mesh", grown), 3)
    wait_for(lambda: len(colours()) == 3 * (4 + 2) and len(node["vertices"]) == 48)
    assert len(peer.nodes["/mesh colours"]["points"]) % 6 == 0
    session.show(with_item(drawing(4), "mesh", triangle(3.0)), 4)
    wait_for(lambda: tuple(peer.nodes["/mesh"]["color"]) == COLOURS["estimate"])


def test_a_mesh_that_is_nowhere_is_not_shown(session: Session, peer: Peer) -> None:
    """A place that is not a number hides it, as in a film, until there is one."""
    session.show(with_item(drawing(), "mesh", triangle(3.0)), 0)
    wait_for(lambda: peer.visible.get("/mesh"))
    session.show(with_item(drawing(1), "mesh", triangle(np.nan)), 1)
    wait_for(lambda: peer.visible.get("/mesh") is False)


def test_a_mesh_is_pressed_into_its_layer(session: Session, peer: Peer) -> None:
    """From the front what is painted later lies before it, and its own parts keep their order; from aside it rises."""

    def heights() -> np.ndarray:
        return np.frombuffer(peer.nodes["/mesh"]["vertices"], dtype=np.float32)[2::3]

    shown = drawing()
    line = np.array((((0, 0, 2), (9, 9, 9)),), dtype=np.float32)
    shown = with_item(with_item(shown, "mesh", triangle(9.0)), "line", Links(line, COLOURS["truth"], 1.0, "estimate"))
    session.show(shown, 0)
    wait_for(lambda: {"/mesh", "/line"} <= peer.nodes.keys())
    peer.move_view("Front")
    wait_for(lambda: heights().max() < 1.0)
    assert heights()[0] < heights()[2] < heights()[1] < ends(peer, "/line")[:, 2].min()
    peer.move_view("Side")
    wait_for(lambda: heights().max() > 8.9)


def test_the_camera_is_seen_from_aside_only(session: Session, peer: Peer) -> None:
    """Its rays would cross the picture from the front; from aside what is high stands on them."""
    corners = np.array(((0, 0, 0), (320, 0, 0), (320, 240, 0), (0, 240, 0)), dtype=np.float32)
    camera = Frustum(np.array((160, 120, 300), dtype=np.float32), corners, COLOURS["camera"], 1.0, "camera")
    high = np.array((((40, 60, 100), (40, 60, 200)),), dtype=np.float32)
    shown = with_item(drawing(), "camera", camera)
    shown = with_item(shown, "high", Links(high, COLOURS["estimate"], 1.0, "estimate"))
    session.show(shown, 0)
    wait_for(lambda: peer.visible.get("/high"))
    peer.move_view("Front")
    wait_for(lambda: not peer.visible.get("/camera"))
    np.testing.assert_allclose(ends(peer, "/high")[:, :2], [(40, -60), (40, -60)])
    peer.move_view("Side")
    wait_for(lambda: peer.visible.get("/camera"))
    rays = ends(peer, "/camera").reshape(-1, 2, 3)[:4]
    np.testing.assert_allclose(rays[:, 0], np.tile((160, -120, 300), (4, 1)), atol=1.0)
    np.testing.assert_allclose(rays[2, 1], (320, -240, 0), atol=1.0)
    np.testing.assert_allclose(ends(peer, "/high")[:, :2], [(80, -80), (120, -100)], atol=0.5)
    peer.move_view("Front")
    wait_for(lambda: not peer.visible.get("/camera"))


def ends(peer: Peer, name: str) -> np.ndarray:
    return np.frombuffer(peer.nodes[name]["points"], dtype=np.float32).reshape(-1, 3)
