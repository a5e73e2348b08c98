"""Polygons of strips in the picture."""

import numpy as np
import pytest

from pftrack.experiments.linkage.sets.space import Strip, extent, intersect


def unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("count", [2, 3, 4])
def test_the_extent_is_that_of_all_points_in_the_strips(count: int) -> None:
    """No point of a dense grid that is in all strips is outside, and it is no larger than the grid says."""
    rng = np.random.default_rng(count)
    grid = np.stack(np.meshgrid(*[np.linspace(-40, 40, 401)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(60):
        angles = np.array([0.0, 1.5, *rng.uniform(0, np.pi, count - 2)])
        strips: list[Strip] = [
            (unit(angle), float(at - 8), float(at + 8))
            for angle, at in zip(angles, rng.uniform(-9, 9, count), strict=True)
        ]
        inside = grid[
            np.all([(low <= grid @ normal) & (grid @ normal <= high) for normal, low, high in strips], axis=0)
        ]
        corners, direction = intersect(strips), unit(rng.uniform(0, np.pi))
        if len(inside):
            low, high = extent(corners, direction)
            along = inside @ direction
            assert low <= along.min() <= low + 1.0
            assert high - 1.0 <= along.max() <= high


def test_one_strip_has_no_end_and_two_that_miss_have_no_point() -> None:
    """Across itself a strip is as wide as it is; parallel strips apart have nothing in common."""
    strip = (unit(0.3), 1.0, 3.0)
    assert extent(intersect([strip]), unit(0.3 + np.pi / 2)) == (-np.inf, np.inf)
    assert extent(intersect([strip]), unit(0.3)) == pytest.approx((1.0, 3.0), abs=1e-5)
    assert len(intersect([strip, (unit(0.3), 4.0, 5.0)])) == 0
