"""Worlds are to the right of the picture, one below the other, and have presets of their own."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Arrows, Drawing, Ellipsoids, Points, Viewpoint, World, WorldDrawing
from pftrack_server.viewer import shapes, worlds
from pftrack_server.viewer.camera import Box
from pftrack_server.viewer.shapes import FREE, Stance
from tests.viewer.host import Peer, Session, drawing, f32
from tests.waiting import wait_for

BLUE = COLOURS["estimate"]
BLUES = np.tile(np.uint8([BLUE]), (2, 1))
SIDES = (
    Viewpoint("front", "Ahead", 0.0, 0.0),
    Viewpoint("left", "Port", -90.0, 0.0),
    Viewpoint("up", "Sky", 0.0, 90.0),
)
HEAD = World("head", "Head", "mm", 50.0, middle=(1.0, 2.0, 3.0), up=(0, -1, 0), front=(0, 0, -1), viewpoints=SIDES)
SPREAD = np.diag([9.0, 4.0, 1.0]).astype(np.float32)[None]
ACROSS = 320 - 0.5 + 0.2 * 240 + 120
"""The middle of a single world, whose square is as high as the picture."""
SCALE = 0.86 * 120 / 50
"""px per mm."""


def with_worlds(*shown: WorldDrawing) -> Drawing:
    return replace(drawing(), worlds=shown)


def inside() -> WorldDrawing:
    """Return a world with a point in its middle, one 10 mm to the right, below and in front, and more."""
    places = f32([1, 2, 3], [11, 12, -7])
    return WorldDrawing(
        HEAD,
        {
            "points": Points(places, BLUES, 5.0),
            "bodies": Ellipsoids(places, np.tile(SPREAD, (2, 1, 1)), BLUES, 0.5, "estimate"),
            "arrow": Arrows(places[None], BLUE, 2.0, "estimate"),
        },
    )


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session(worlds=(HEAD,))
    yield made
    made.close()


def placed(*shown: WorldDrawing) -> dict[str, Any]:
    return dict(worlds.place_worlds(with_worlds(*shown)))


def test_a_world_stands_to_the_right_of_the_picture() -> None:
    """Its square is as high as the picture and separate; it is upright with its front towards the viewer.

    Its title has the unit, and its ruler the stated length in each direction.
    """
    shown = placed(inside())
    points, title, line, length = (shown[f"world head: {it}"] for it in ("points", "title", "ruler", "ruler length"))
    np.testing.assert_allclose(points.positions[0], [ACROSS, 119.5, 0], atol=1e-3)
    np.testing.assert_allclose(points.positions[1] - points.positions[0], np.full(3, 10 * SCALE), atol=1e-3)
    assert points.size == pytest.approx(5 * SCALE)
    assert (worlds.beside(1, 240), worlds.beside(0, 240)) == (ACROSS + 120 - 319.5, 0.0)
    assert (title.text, length.text) == ("Head, mm", "20 mm")
    ways = line.segments[:, 1] - line.segments[:, 0]
    np.testing.assert_allclose(np.abs(ways), 20 * SCALE * np.eye(3), atol=1e-3)
    assert line.segments[0, 0, 0] > 320


def test_worlds_stand_one_below_the_other() -> None:
    """Together two are as high as the picture."""
    shown = placed(inside(), replace(inside(), world=replace(HEAD, name="other")))
    ways = shown["world other: points"].positions - shown["world head: points"].positions
    np.testing.assert_allclose(ways, np.tile(f32(0, 120, 0), (2, 1)), atol=1e-3)


@pytest.mark.parametrize("aspect", [0.6, 1.3, 2.4])
@pytest.mark.parametrize("side", SIDES)
def test_a_viewpoint_holds_the_whole_ball(side: Viewpoint, aspect: float) -> None:
    """The world fills the window's shorter side, with any shape of window."""
    view = worlds.view(0, 1, HEAD, side, Box(320, 240), aspect)
    half = np.arcsin(50 * SCALE / view.distance)
    narrow = np.arctan(np.tan(view.fov_rad / 2) * min(1.0, aspect))
    assert 0.9 < np.tan(half) / np.tan(narrow) <= 1.0
    np.testing.assert_allclose(view.target, [ACROSS, -119.5, 0])


def test_viewpoints_have_their_directions() -> None:
    """Ahead is in front of the picture, port to the left, and the sky almost above."""
    views = [worlds.view(0, 1, HEAD, side, Box(9, 9), 1) for side in SIDES]
    ways = [(view.position - view.target) / view.distance for view in views]
    np.testing.assert_allclose(ways, [[0, 0, 1], [-1, 0, 0], [0, 1, 0]], atol=0.02)


def test_worlds_reach_the_browser(session: Session, peer: Peer) -> None:
    """Points, bodies and arrows are nodes that are updated in place; absent ones are hidden."""
    names = [f"/world head: {name}" for name in ("points", "bodies", "arrow", "title", "ruler", "ruler length")]
    shown, bodies = inside(), Ellipsoids(f32([21, 2, 3], [1, 2, 3]), np.tile(SPREAD, (2, 1, 1)), BLUES, 0.5, "estimate")
    session.show(with_worlds(shown), 0, lambda: peer.nodes.keys() >= set(names))
    node = peer.nodes[names[1]]

    def place() -> float:
        return float(np.frombuffer(node["batched_positions"], np.float32)[0])

    session.show(with_worlds(replace(shown, primitives={**shown.primitives, "bodies": bodies})), 1)
    wait_for(lambda: place() == pytest.approx(ACROSS + 20 * SCALE))
    assert peer.nodes[names[1]] is node
    fewer = Ellipsoids(f32([1, 2, 3]), SPREAD, BLUES[:1], 0.5, "estimate")
    session.show(with_worlds(WorldDrawing(HEAD, {"bodies": fewer})), 2, lambda: peer.visible.get(names[0]) is False)
    wait_for(lambda: len(peer.nodes[names[1]]["batched_positions"]) == 12)


def test_a_world_has_buttons_that_lead_to_its_sides(session: Session, peer: Peer) -> None:
    """The camera moves there, and back to the whole scene."""

    def looks_at(across: float) -> Callable[[], bool]:
        return lambda: peer.camera["LookAt"]["look_at"][0] == pytest.approx(across)

    session.show(with_worlds(inside()), 0, lambda: "Position" in peer.camera)
    peer.look(wide=800, high=600, position=tuple(peer.camera["Position"]["position"]))
    peer.move_view("Port", "Head", looks_at(ACROSS))
    assert peer.camera["Position"]["position"][0] < ACROSS - 50 * SCALE
    peer.move_view("Front", until=looks_at((319.5 + 288 - 0.5) / 2))  # all is seen


@pytest.mark.parametrize("stance", [FREE, Stance(1.0, 3.0)])
def test_a_body_is_a_stretched_and_rotated_ball(stance: Stance) -> None:
    """Its rotation and half axes give its covariance, mirrored like the scene; a flat body keeps some thickness."""
    rng = np.random.default_rng(4)
    roots = rng.normal(size=(3, 3, 3))
    spread = (roots @ np.swapaxes(roots, 1, 2)).astype(np.float32)
    shown = shapes.bodies(Ellipsoids(f32(*np.eye(3)), spread, np.zeros((3, 3), np.uint8), 0.5, "l"), stance)
    from viser.transforms import SO3

    mirror = np.array([1, -1, 1])
    for centre, wxyz, half_axes, place, covariance in zip(
        shown.centres, shown.wxyz, shown.half_axes, np.eye(3), spread, strict=True
    ):
        turn = SO3(wxyz.astype(np.float64)).as_matrix()
        mirrored = mirror[:, None] * covariance * mirror
        np.testing.assert_allclose(turn @ np.diag((half_axes / 2.0) ** 2) @ turn.T, mirrored, atol=1e-3)
        assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-5)
        np.testing.assert_allclose(centre, mirror * place + [0, 0, stance.lift], atol=1e-6)
    flat = np.diag([9.0, 4.0, 0.0]).astype(np.float32)[None]
    disc = shapes.bodies(Ellipsoids(f32([0, 0, 0]), flat, np.zeros((1, 3), np.uint8), 0.5, "l"), FREE)
    np.testing.assert_allclose(sorted(disc.half_axes[0]), [0.06, 4.0, 6.0], rtol=1e-5)


def test_the_ball_is_visible_from_outside() -> None:
    """Its triangles are counterclockwise there."""
    vertices, faces = shapes.BALL
    corners = vertices[faces]
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outwards * corners.mean(axis=1)).sum(axis=1) >= -1e-7).all()


def test_an_arrow_is_a_line_with_four_barbs() -> None:
    """The barbs end at its tip, in two planes; an arrow without length is omitted."""
    segments = shapes.arrow_segments(Arrows(f32([[0, 0, 0], [100, 0, 0]], [[5, 5, 5], [5, 5, 5]]), BLUE, 2.0, "l"))
    assert segments.shape == (5, 2, 3)
    np.testing.assert_allclose(segments[0], f32([0, 0, 0], [100, 0, 0]))
    np.testing.assert_allclose(segments[1:, 1], np.tile(f32(100, 0, 0), (4, 1)))
    np.testing.assert_allclose(segments[1:, 0, 0], 88, atol=1e-4)
    np.testing.assert_allclose(segments[1:, 0, 1:].sum(axis=0), 0, atol=1e-4)
