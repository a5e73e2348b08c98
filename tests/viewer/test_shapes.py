"""Geometry between drawings, with y downwards, and the scene, with y upwards."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Axes, Ellipse, Frustum, Links, Mesh, Picture, Points, Polyline
from pftrack_server.viewer import shapes
from pftrack_server.viewer.shapes import Stance
from tests.viewer.host import f32

NEAR = (50.0, 60.0, 100.0)


@pytest.mark.parametrize(
    ("point", "stance", "place"),
    [
        ((3, 5, 0), Stance(1.0, 0.0), (3, -5, 0)),
        ((0, 0, 20), Stance(0.5, 1.0), (0, 0, 11)),
        ((0, 0, 20), Stance(0.0, 1.0), (0, 0, 1)),
        ((10, 40, 25), Stance(1.0, 0.0, NEAR), (20, -45, 25)),
        ((10, 40, 25), Stance(1.0, 25.0, NEAR), (30, -50, 50)),
        ((10, 40, 25), Stance(0.0, 0.5, NEAR), (10, -40, 0.5)),
    ],
)
def test_the_place_of_a_point_in_the_scene(point: object, stance: Stance, place: object) -> None:
    """The picture is upright, and heights are flattened before the lift, which keeps the painting order.

    From aside, a high point lies on the ray from its pixel to the camera; from the front it is upright. The arrays of a
    drawing, which belong to the run, stay unchanged.
    """
    positions = f32(point)
    np.testing.assert_allclose(shapes.to_scene(positions, stance), f32(place))
    np.testing.assert_array_equal(positions, f32(point))


def test_a_frustum_goes_from_its_apex_to_the_corners() -> None:
    """Four rays end in the picture's corners; the corners and the camera's body have a border."""
    corners = f32((0, 0, 0), (8, 0, 0), (8, 6, 0), (0, 6, 0))
    segments = shapes.frustum_segments(Frustum(f32(4, 3, 10), corners, (0, 0, 0), 1.0, "camera"))
    assert segments.shape == (12, 2, 3)
    np.testing.assert_array_equal(segments[:4, 0], np.tile(f32(4, 3, 10), (4, 1)))
    np.testing.assert_array_equal(segments[:4, 1], corners)
    np.testing.assert_array_equal(segments[4:8, 1], np.roll(corners, -1, axis=0))
    own = segments[8:].reshape(-1, 3)
    assert (own[:, 2] > 8.0).all()
    np.testing.assert_allclose(own.mean(axis=0)[:2], (4, 3))


def test_a_line_has_a_gap_where_a_position_is_unknown() -> None:
    """No segment touches a position that is not finite."""
    line = f32((0, 0, 0), (1, 0, 0), (np.nan, 0, 0), (3, 0, 0), (4, 0, 0))
    np.testing.assert_array_equal(shapes.polyline_segments(line)[:, :, 0], f32((0, 1), (3, 4)))


def test_an_ellipse_runs_through_the_ends_of_its_half_axes() -> None:
    """The end of the second half axis is at a quarter; a dashed outline has half of the segments."""
    ellipse = Ellipse(f32(10, 20, 5), f32((4, 0), (0, 2)), (0, 0, 0), 1.0, "x")
    segments = shapes.ellipse_segments(ellipse)
    assert (len(segments), len(shapes.ellipse_segments(replace(ellipse, dashed=True)))) == (64, 32)
    np.testing.assert_allclose(segments[[0, 16], 0], [(14, 20, 5), (10, 22, 5)], atol=1e-5)


def test_axes_end_where_the_columns_of_the_rotation_point() -> None:
    """Each axis is one segment from the origin."""
    turned = f32((0, -1, 0), (1, 0, 0), (0, 0, 1))
    segments = shapes.axes_segments(Axes(f32(1, 1, 0), turned, 10.0, COLOURS["estimate"], 2.0, "x"))
    np.testing.assert_allclose(segments[:, 0], f32((1, 1, 0), (1, 1, 0), (1, 1, 0)))
    np.testing.assert_allclose(segments[0, 1], (1, 11, 0))


def test_faces_are_turned_over() -> None:
    """Otherwise the mirrored y would show a mesh inside out."""
    np.testing.assert_array_equal(shapes.turn_over(np.array([[0, 1, 2]], dtype=np.int32)), [[2, 1, 0]])


def test_depth_is_the_highest_of_all() -> None:
    """The box of a camera contains clouds, trails, links and meshes, but neither the camera nor negative heights."""
    cloud = Points(f32((0, 0, 3)), np.zeros((1, 3), dtype=np.uint8), 1.0)
    past = Polyline(f32((0, 0, 0), (0, 0, -60), (0, 0, np.nan)), COLOURS["truth"], 1.0, "x")
    items = (
        Picture(np.zeros((4, 4, 3), dtype=np.uint8)),
        cloud,
        Mesh(f32((0, 0, 4)), np.array([[0, 0, 0]], dtype=np.int32), (0, 0, 0), 1.0, "x"),
        Links(f32(((0, 0, 0), (0, 0, 5))), (0, 0, 0), 1.0, "x"),
        Polyline(f32((0, 0, 0), (0, 0, 6), (0, 0, np.nan)), (0, 0, 0), 1.0, "x"),
        Frustum(f32(0, 0, 900), f32((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), (0, 0, 0), 1.0, "x"),
    )
    depths = [shapes.depth(each) for each in (items, items[:4], items[:3], (past, cloud), ())]
    assert depths == [6.0, 5.0, 4.0, 3.0, 0.0]
    assert (shapes.behind((past, cloud)), shapes.behind((cloud,))) == (60.0, 0.0)
