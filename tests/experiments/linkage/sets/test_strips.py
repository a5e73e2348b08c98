import numpy as np

from pftrack.experiments.linkage.sets.ellipsoids import cut, cut_along
from pftrack.reproduce.linkage_regions import (
    algebra,
    count_lost_points,
    random_shape,
    values,
)
from pftrack.reproduce.pool import Pool


def test_no_point_of_both_is_lost() -> None:
    """A quarter of a million points in an ellipsoid and in a strip are all in the ellipsoid that is made of them."""
    tested, outside = count_lost_points(np.random.default_rng(0), 26, 410)
    assert tested > 250_000
    assert outside == 0


def test_the_algebra_is_that_of_the_reference() -> None:
    """In 3000 cases no dense search finds a smaller trace, the cubic as printed is worse in most, and so forth."""
    with Pool(1) as pool:
        findings = list(algebra(pool, full=True))
    assert [one.result for one in findings if one.verdict not in {"reproduced", "our own figure"}] == []


def test_sets_that_share_nothing_are_found_empty() -> None:
    """A strip beside the ellipsoid empties it, one that touches it does not, and an empty one leaves it as it is."""
    centre, shape = np.zeros(3), np.diag([4.0, 1.0, 9.0])
    assert not cut(centre, shape, np.array([1.0, 0, 0]), 3.5, 1.4)
    assert np.array_equal(shape, np.diag([4.0, 1.0, 9.0]))
    assert cut(centre, shape, np.array([1.0, 0, 0]), 3.5, 1.5)
    assert np.all(np.linalg.eigvalsh(shape) > 0)
    assert values(np.array([[2.0, 0, 0]]), centre, shape)[0] <= 1 + 1e-6


def test_a_cut_on_one_side_takes_what_is_beyond_it() -> None:
    """A strip of which one side is far off cuts as much as one that ends at the ellipsoid."""
    far, near = np.diag([4.0, 1.0]), np.diag([4.0, 1.0])
    assert cut(np.zeros(2), far, np.array([1.0, 0.0]), -10.0, 9.0)
    assert cut(np.zeros(2), near, np.array([1.0, 0.0]), -1.5, 0.5)
    assert np.allclose(far, near)


def test_a_strip_along_an_axis_is_a_strip() -> None:
    """Cutting along an axis comes to the same as cutting by its unit vector."""
    rng = np.random.default_rng(3)
    for axis in range(4):
        centre, shape = rng.normal(size=4), random_shape(rng, 4)
        half = np.sqrt(shape[axis, axis])
        low, high = centre[axis] - 0.3 * half, centre[axis] + 0.9 * half
        one, other = (centre.copy(), shape.copy()), (centre.copy(), shape.copy())
        assert cut_along(*one, axis, low, high)
        assert cut(*other, np.eye(4)[axis], 0.5 * (low + high), 0.5 * (high - low))
        assert np.allclose(one[0], other[0])
        assert np.allclose(one[1], other[1])


def test_thousands_of_hostile_cuts_leave_it_definite() -> None:
    """Strips of no width, directions of no extent and cuts at the very edge leave a shape that has a root."""
    rng = np.random.default_rng(4)
    centre, shape = np.zeros(4), np.diag([1e4, 1.0, 1e-4, 1.0])
    for _ in range(3000):
        normal = rng.normal(size=4) * (rng.random(4) < 0.5)
        half = float(np.sqrt(max(normal @ shape @ normal, 0)))
        offset = float(normal @ centre) + rng.choice([0.0, 0.5, 1.0, -1.0]) * half
        assert cut(centre, shape, normal, offset, 0.0)
        shape[np.diag_indices(4)] += 1e-12
        assert np.all(np.isfinite(shape))
        np.linalg.cholesky(shape)
