import numpy as np
import pytest

from pftrack.experiments.linkage.sets.ellipsoids import OUTER, predict
from pftrack.reproduce.linkage_regions import random_shape, sticks_out


def test_the_bound_holds_where_some_coordinates_stay() -> None:
    """It does with a motion in the first coordinates alone, and in the others it stays finite."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        assert not sticks_out(random_shape(rng, 6), 3, rng.uniform(0.01, 50), OUTER, rng)


def test_no_other_bound_of_the_family_has_a_smaller_trace() -> None:
    """P = sqrt(tr P / tr U) does what it is for."""
    shape, radius = np.diag([4.0, 1.0, 9.0]), 2.0
    after = shape.copy()
    predict(after, 2, radius, OUTER)
    ratios = np.geomspace(0.01, 100, 4000)
    traces = (1 + 1 / ratios) * 14.0 + (1 + ratios) * 2 * radius**2
    assert np.trace(after) == pytest.approx(traces.min(), rel=1e-5)


def test_no_motion_moves_nothing() -> None:
    """With du = 0 the ellipsoid stays but for rounding, also if it is a point; a point that moves becomes the ball."""
    shape = np.diag([4.0, 1.0, 9.0])
    predict(shape, 3, 0.0, OUTER)
    assert np.allclose(shape, np.diag([4.0, 1.0, 9.0]), atol=1e-10)
    point = np.zeros((3, 3))
    predict(point, 2, 0.0, OUTER)
    assert np.allclose(point, 0, atol=1e-10)
    predict(point, 2, 1.5, OUTER)
    assert np.allclose(point, np.diag([2.25, 2.25, 0]), atol=1e-4)
