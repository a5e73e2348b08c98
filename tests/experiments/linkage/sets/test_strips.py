from itertools import product

import numpy as np
import pytest

from pftrack.experiments.linkage.sets.plane import TRACE, VOLUME, cut, cut_along, volume_ratio
from pftrack.reproduce.linkage_regions import (
    algebra,
    count_lost_points,
    points_of_both,
    random_cases,
    random_shape,
    random_strip,
    values,
)
from pftrack.reproduce.pool import Pool

BOTH = [TRACE, VOLUME]


def test_no_point_of_both_is_lost() -> None:
    """A quarter of a million points in an ellipsoid and in a strip are all in the ellipsoid that is made of them."""
    tested, outside = count_lost_points(np.random.default_rng(0), 26, 410)
    assert tested > 250_000
    assert outside == 0


def test_the_algebra_is_that_of_the_reference() -> None:
    """In 3000 cases no dense search finds a smaller trace, the cubic as printed is worse in most, and so forth."""
    with Pool(1) as pool:
        findings = algebra(pool, full=True)
    assert [one.result for one in findings if one.verdict not in {"reproduced", "our own figure"}] == []


def test_points_of_both_are_points_of_both() -> None:
    """What the test of containment takes is in the ellipsoid and in the strip, and comes close to the surface."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        centre, shape = rng.normal(size=4), random_shape(rng, 4)
        normal, offset, width = random_strip(rng, centre, shape)
        points = points_of_both(rng, 100, (centre, shape), (normal, offset, width))
        assert np.all(abs(points @ normal - offset) <= width * (1 + 1e-6) + 1e-9)
        assert 0.98 < values(points, centre, shape).max() <= 1 + 1e-9


def test_no_other_ellipsoid_of_the_family_has_a_smaller_volume() -> None:
    """A dense search of the determinant finds none."""
    cases = random_cases(np.random.default_rng(2), 200)
    tried = 1 + np.geomspace(1e-6, 1e6, 1500)
    for size, (_, _, width2, gap2, _, _) in zip(np.arange(200) % 6 + 2, cases, strict=True):

        def volume(ratio, n=int(size), width2=width2, gap2=gap2):  # noqa: ANN001, ANN202
            factor = 1 + (ratio - 1) * width2 - (ratio - 1) / ratio * gap2
            return factor**n / ratio

        assert volume(volume_ratio(int(size), width2, gap2)) <= volume(tried).min() * (1 + 1e-9)


def test_sets_that_share_nothing_are_found_empty() -> None:
    """A strip beside the ellipsoid empties it, one that touches it does not, and an empty one leaves it as it is."""
    for least, tighten in product(BOTH, [False, True]):
        centre, shape = np.zeros(3), np.diag([4.0, 1.0, 9.0])
        assert not cut(centre, shape, np.array([1.0, 0, 0]), 3.5, 1.4, least, tighten)
        assert np.array_equal(shape, np.diag([4.0, 1.0, 9.0]))
        assert cut(centre, shape, np.array([1.0, 0, 0]), 3.5, 1.5, least, tighten)
        assert np.all(np.linalg.eigvalsh(shape) > 0)
        assert values(np.array([[2.0, 0, 0]]), centre, shape)[0] <= 1 + 1e-6


def test_tightening_finds_a_one_sided_cut() -> None:
    """A strip of which one side is far off cuts more of an ellipsoid with tightening than without."""
    plain, tight = np.diag([4.0, 1.0]), np.diag([4.0, 1.0])
    for shape, tighten in ((plain, False), (tight, True)):
        assert cut(np.zeros(2), shape, np.array([1.0, 0.0]), -10.0, 9.0, TRACE, tighten)
    assert np.trace(tight) < 0.7 * np.trace(plain)


def test_a_strip_along_an_axis_is_a_strip() -> None:
    """Cutting along an axis comes to the same as cutting by its unit vector."""
    rng = np.random.default_rng(3)
    for axis in range(4):
        centre, shape = rng.normal(size=4), random_shape(rng, 4)
        half = np.sqrt(shape[axis, axis])
        low, high = centre[axis] - 0.3 * half, centre[axis] + 0.9 * half
        one, other = (centre.copy(), shape.copy()), (centre.copy(), shape.copy())
        assert cut_along(*one, axis, low, high)
        assert cut(*other, np.eye(4)[axis], 0.5 * (low + high), 0.5 * (high - low), TRACE, True)
        assert np.allclose(one[0], other[0])
        assert np.allclose(one[1], other[1])


@pytest.mark.parametrize("least", BOTH)
def test_thousands_of_hostile_cuts_leave_it_definite(least: int) -> None:
    """Strips of no width, directions of no extent and cuts at the very edge leave a shape that has a root."""
    rng = np.random.default_rng(4)
    centre, shape = np.zeros(4), np.diag([1e4, 1.0, 1e-4, 1.0])
    for turn in range(3000):
        normal = rng.normal(size=4) * (rng.random(4) < 0.5)
        half = float(np.sqrt(max(normal @ shape @ normal, 0)))
        offset = float(normal @ centre) + rng.choice([0.0, 0.5, 1.0, -1.0]) * half
        assert cut(centre, shape, normal, offset, 0.0, least, bool(turn % 2))
        shape[np.diag_indices(4)] += 1e-12
        assert np.all(np.isfinite(shape))
        np.linalg.cholesky(shape)
