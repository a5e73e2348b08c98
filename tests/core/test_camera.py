import numpy as np
import pytest

from pftrack.core.numerics.matrices import NEAREST_MM, affine_fit, affine_projection, pinhole, pinhole_jacobian

POINTS = np.random.default_rng(0).normal(size=(11, 3)) * 20
AHEAD = POINTS + np.array([0.0, 0.0, 100.0])


def test_the_pinhole_divides_by_depth() -> None:
    """A point at twice the depth is seen at half the distance from the principal point."""
    assert np.allclose(pinhole(AHEAD, 400.0), 400.0 * AHEAD[:, :2] / AHEAD[:, 2:])
    assert np.allclose(pinhole(2 * AHEAD, 400.0), pinhole(AHEAD, 400.0))
    assert np.allclose(pinhole(AHEAD * [1, 1, 2], 400.0), pinhole(AHEAD, 400.0) / 2)


def test_the_pinhole_s_derivative_is_that_of_differences() -> None:
    """The Jacobian agrees with a central difference within 1e-6 px/mm."""
    slopes = pinhole_jacobian(AHEAD, 400.0)
    for axis in range(3):
        change = 1e-4 * np.eye(3)[axis]
        difference = (pinhole(AHEAD + change, 400.0) - pinhole(AHEAD - change, 400.0)) / 2e-4
        assert np.abs(slopes[:, :, axis] - difference).max() < 1e-6


def test_points_behind_the_camera_stay_finite() -> None:
    """At the pinhole itself and behind it nothing becomes infinite."""
    behind = np.array([[3.0, -2.0, 0.0], [3.0, -2.0, -50.0]])
    assert np.allclose(pinhole(behind, 400.0), 400.0 * behind[:, :2] / NEAREST_MM)
    assert np.isfinite(pinhole_jacobian(behind, 400.0)).all()


def test_the_affine_fit_is_the_best_one() -> None:
    """On pinhole pixels no small change of the fitted camera comes closer."""
    pixels = pinhole(AHEAD, 400.0)
    best = affine_fit(POINTS, pixels)
    least = ((affine_projection(best, POINTS) - pixels) ** 2).sum()
    for change in np.random.default_rng(1).normal(size=(50, 2, 4)) * 1e-2:
        assert ((affine_projection(best + change, POINTS) - pixels) ** 2).sum() > least


def test_what_does_not_determine_a_camera_is_refused() -> None:
    """Points in a plane, points that are no numbers and mismatched shapes are refused, with what was expected."""
    flat = POINTS * [1, 1, 0]
    with pytest.raises(ValueError, match="do not lie in one plane"):
        affine_fit(flat, pinhole(AHEAD, 400.0))
    with pytest.raises(ValueError, match="expected finite"):
        affine_fit(POINTS, np.full((11, 2), np.nan))
    with pytest.raises(ValueError, match=r"got \(11, 3\) and \(10, 2\)"):
        affine_fit(POINTS, np.zeros((10, 2)))
