"""Worlds are seen without perspective: turned, at one scale, with all that is near before all that is far."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model import drawing as shapes
from pftrack.core.model.drawing import Drawing, Ellipse, Ellipsoids, Points, Viewpoint, World, WorldDrawing
from pftrack.vision.rendering import Projection, look_at, render, render_beside
from tests.vision.ink import BLUE, centre, f32

WORLD = World("w", "World", "mm", 50.0, middle=(10.0, 20.0, 30.0))


def blue(picture: np.ndarray) -> np.ndarray:
    return np.clip(picture[..., 2].astype(float) - picture[..., 0], 0, None)


def test_the_middle_of_a_world_is_the_middle_of_its_picture() -> None:
    """And what is as far from it as the world extends is just within the picture, whichever way one looks."""
    for azimuth, elevation in ((0, 0), (33, -20), (180, 90)):
        view = Projection.of(WORLD, azimuth, elevation, 200)
        np.testing.assert_allclose(view.points(f32(10, 20, 30)), [99.5, 99.5, 0], atol=1e-4)
        rim = view.points(f32(10, 20, 30) + 50 * (view.turn[0] + view.turn[1]).astype(np.float32) / np.float32(2**0.5))
        assert np.linalg.norm(rim[:2] - 99.5) == pytest.approx(200 / 2.08, abs=1e-3)


def test_every_primitive_is_mapped_like_its_points() -> None:
    """Positions, sizes in the world's unit and directions follow; widths of lines and colours stay."""
    view = Projection.of(WORLD, 40, 25, 300)
    ends = f32([0, 10, 20], [30, 5, 12])
    axes = shapes.Axes(f32(1, 2, 3), np.eye(3, dtype=np.float32), 10.0, BLUE, 2.0, "l")
    seen = view.primitive(axes)
    tips = seen.origin + seen.length * seen.rotation.T
    np.testing.assert_allclose(tips, view.points(f32(1, 2, 3) + 10 * np.eye(3, dtype=np.float32)), atol=1e-3)
    points = view.primitive(Points(ends, np.tile(np.uint8([BLUE]), (2, 1)), 3.0))
    assert points.size == pytest.approx(3.0 * view.scale)
    pairs = [view.primitive(kind(ends[None], BLUE, 2.0, "l")) for kind in (shapes.Links, shapes.Arrows)]
    assert [pair.width for pair in pairs] == [2.0, 2.0]
    line, text = view.primitive(shapes.Polyline(ends, BLUE, 1.0, "l")), shapes.Text(ends[0], "a", BLUE, "l")
    named = view.primitive(replace(text, point=ends[1]))
    triangle = np.array([[0, 1, 2]], np.int32)
    mesh = view.primitive(shapes.Mesh(f32(*ends, [0, 0, 0]), triangle, BLUE, 1.0, "l"))
    for found in (*(pair.segments[0] for pair in pairs), line.positions, mesh.vertices[:2]):
        np.testing.assert_allclose(found, view.points(ends))
    assert view.primitive(text).point is None
    np.testing.assert_allclose([view.primitive(text).position, named.point], view.points(ends))


def test_an_ellipsoid_keeps_its_spread() -> None:
    """The variance across the line of sight is what a viewer sees, times the square of the scale."""
    view = Projection.of(WORLD, 90, 0, 100)
    spread = np.diag([1.0, 4.0, 9.0]).astype(np.float32)[None]
    seen = view.primitive(Ellipsoids(f32([0, 0, 0]), spread, np.uint8([BLUE]), 0.5, "l"))
    # From the right z runs across, y upwards and x towards the viewer.
    np.testing.assert_allclose(np.diag(seen.covariances[0]), np.array([9, 4, 1]) * view.scale**2, rtol=1e-5)


def test_what_is_near_lies_above_what_is_far() -> None:
    """The nearest of points in one line of sight is seen, from either side."""
    red, green = (255, 0, 0), (0, 255, 0)
    cloud = Points(f32([10, 20, 10], [10, 20, 50]), np.array([red, green], np.uint8), 20.0, "points")
    drawn = WorldDrawing(WORLD, {"cloud": cloud})
    for azimuth, colour in ((0, green), (180, red)):
        picture = render(look_at(drawn, Viewpoint("v", "V", azimuth, 0), 101), caption=False)
        assert tuple(picture[50, 50]) == colour


def test_a_world_has_a_ruler_in_its_unit() -> None:
    """It is as long as it says, at the scale of the picture."""
    drawing = look_at(WorldDrawing(WORLD), Viewpoint("v", "From here", 0, 0), 208)
    line, text = drawing.primitives["ruler"], drawing.primitives["ruler length"]
    assert np.linalg.norm(line.segments[0, 1] - line.segments[0, 0]) == pytest.approx(20.0 * 208 / 104)
    assert text.text == "20 mm"
    assert drawing.caption == "World, mm · From here"


def test_a_film_shows_worlds_beside_the_picture() -> None:
    """Each is a square as high as the picture, to the right of it; layers hold for both."""
    ball = Points(f32([10, 20, 30]), np.uint8([BLUE]), 20.0, "points")
    drawing = Drawing(60, 40, {"here": Points(f32([10, 10, 0]), np.uint8([BLUE]), 5.0, "points")})
    both = Drawing(60, 40, drawing.primitives, "", (WorldDrawing(WORLD, {"ball": ball}),))
    film = render_beside(both, scale=2.0)
    assert film.shape == (80, 200, 3)
    np.testing.assert_array_equal(film[:, :120], render(drawing, scale=2.0))
    np.testing.assert_allclose(centre(blue(film[:, 120:])), [39.5, 39.5], atol=0.1)
    assert not blue(render_beside(both, layers={"points": False})).any()


def test_a_picture_has_no_place_in_a_world() -> None:
    """What lies in the picture's plane cannot be looked at from aside there, and is refused."""
    flat = Ellipse(f32(0, 0, 0), np.eye(2, dtype=np.float32), BLUE, 1.0, "l")
    with pytest.raises(TypeError, match="a Ellipse belongs to a picture"):
        WorldDrawing(WORLD, {"it": flat})
    with pytest.raises(TypeError, match="belongs to a picture"):
        Projection.of(WORLD, 0, 0, 10).primitive(flat)
