import numpy as np
import pytest

from pftrack.experiments.head.painting import lit, project, rasterise

FOCAL, CENTRE = 100.0, (32.0, 24.0)
RAMP = np.tile(np.linspace(0, 1, 101, dtype=np.float32), (101, 1))
"""Albedo x / 100 for x in 0..100 mm."""


def drawn(*quads: np.ndarray, light: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw squares of four corners in the camera's frame; the model's x runs from 0 to 100 along each."""
    image, inverse_depth = np.full((48, 64), 7, np.float32), np.zeros((48, 64), np.float32)
    model = np.array([[0.0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    for quad in quads:
        pixels, inverse_depths = project(quad, FOCAL, CENTRE)
        shine = np.full(4, light)
        rasterise(
            image, inverse_depth, triangles, pixels, inverse_depths, model, shine, RAMP, (0.0, 0.0, 1.0), (1e9, 0.0)
        )
    return image, inverse_depth


def square(depth_left: float, depth_right: float, half: float = 10.0) -> np.ndarray:
    return np.array(
        [[-half, -half, depth_left], [half, -half, depth_right], [half, half, depth_right], [-half, half, depth_left]]
    )


def test_texture_is_interpolated_in_perspective() -> None:
    """On a slanted square each pixel shows the albedo of the point that its ray meets, not of the share of pixels."""
    image, inverse_depth = drawn(square(60, 180))
    for column in range(20, 36):
        # The ray (t, 0, 1) z meets the square where -10 + 20 s = t z and z = 60 + 120 s.
        t = (column - CENTRE[0]) / FOCAL
        s = (10 + 60 * t) / (20 - 120 * t)
        assert image[24, column] == pytest.approx(255 * s, abs=0.01)
        assert 1 / inverse_depth[24, column] == pytest.approx(60 + 120 * s, rel=1e-5)


def test_only_the_square_s_own_pixels_are_touched() -> None:
    """Pixels inside the outline are drawn, all others keep what they had."""
    image, inverse_depth = drawn(square(100, 100))
    rows, columns = np.mgrid[:48, :64]
    inside = (np.abs(columns - 32) <= 10) & (np.abs(rows - 24) <= 10)
    assert np.array_equal(inverse_depth > 0, inside)
    assert (image[~inside] == 7).all()


def test_what_is_nearer_is_seen() -> None:
    """The nearer of two squares is seen, in whichever order they are drawn."""
    near, far = square(80, 80, 4), square(120, 120, 30)
    assert np.array_equal(drawn(near, far)[0], drawn(far, near)[0])
    assert drawn(near, far)[1][24, 32] == pytest.approx(1 / 80)
    assert drawn(near, far)[1][24, 50] == pytest.approx(1 / 120)


def test_backs_are_not_drawn() -> None:
    """A square that is seen from behind leaves no pixel."""
    assert not drawn(square(100, 100)[::-1].copy())[1].any()


def test_what_leaves_the_picture_is_cut() -> None:
    """A square larger than the picture fills it and writes nowhere else."""
    assert (drawn(square(100, 100, 500))[1] > 0).all()


def test_light_adds_up() -> None:
    """Light is ambient, plus the lamp by how much the surface faces the camera, plus the sun likewise."""
    normals = np.array([[0.0, 0, -1], [1, 0, 0], [0, 0, 1]])
    light = lit(normals, np.array([1.0, 0, 0]), 0.18, 0.72, 0.3)
    assert light.tolist() == pytest.approx([0.9, 0.48, 0.18])
    assert drawn(square(100, 100), light=0.5)[0][24, 32] == pytest.approx(255 * 0.5 * 0.5, abs=0.5)
