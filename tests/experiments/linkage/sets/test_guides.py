import numpy as np

from pftrack.experiments.linkage.sets.regions import circumscribe, contract, cut_by_guides, shrink_to_extent
from pftrack.reproduce.linkage_regions import random_shape, values


def test_contraction_keeps_every_point_and_is_tight() -> None:
    """Points of box and strip stay in the box; each side that has moved is one that a point of both touches."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        size = int(rng.integers(1, 7))
        low = rng.normal(size=size) * 10
        high = low + rng.uniform(0, 20, size)
        normal = rng.normal(size=size) * (rng.random(size) < 0.7)
        points = low + rng.choice([0.0, 1.0, 0.5, 0.1], (600, size)) * (high - low)
        inside = points @ normal
        least = float(np.quantile(inside, 0.3))
        most = least + rng.uniform(0, 5)
        after = low.copy(), high.copy()
        assert contract(*after, normal, least, most)
        kept = points[(inside >= least) & (inside <= most)]
        assert np.all(kept >= after[0])
        assert np.all(kept <= after[1])
        assert np.all(after[0] >= low)
        assert np.all(after[1] <= high)


def test_contraction_bounds_by_the_extremes_of_the_others() -> None:
    """From x - y within +-1, x in [0, 10] and y in [4, 5] follow x in [3, 6] and y as it was."""
    low, high = np.array([0.0, 4.0]), np.array([10.0, 5.0])
    assert contract(low, high, np.array([1.0, -1.0]), -1.0, 1.0)
    assert np.allclose(low, [3, 4], atol=1e-6)
    assert np.allclose(high, [6, 5], atol=1e-6)


def test_a_strip_that_misses_the_box_empties_it() -> None:
    """So does one along an axis, and one of no normal that excludes 0; touching is no missing."""
    low, high = np.zeros(2), np.ones(2)
    assert not contract(low.copy(), high.copy(), np.array([1.0, 1.0]), 2.1, 3.0)
    assert not contract(low.copy(), high.copy(), np.array([0.0, 1.0]), -3.0, -0.1)
    assert not contract(low.copy(), high.copy(), np.zeros(2), 0.5, 1.0)
    assert contract(low.copy(), high.copy(), np.zeros(2), -0.5, 1.0)
    assert contract(low, high, np.array([1.0, 1.0]), 2.0, 3.0)
    assert np.allclose(low, 1, atol=1e-6)


def test_a_box_of_one_point_stays() -> None:
    """A point that fits is not refuted by rounding, however often the strip comes."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        point = rng.normal(size=4) * 50
        low, high = point.copy(), point.copy()
        for _ in range(20):
            normal = rng.normal(size=4)
            value = float(normal @ point)
            assert contract(low, high, normal, value, value)


def test_the_ellipsoid_bounds_the_box_and_the_box_the_ellipsoid() -> None:
    """The box shrinks to the extent; cut by its guides the ellipsoid keeps all that is in both."""
    rng = np.random.default_rng(2)
    for _ in range(15):
        shape, centre = random_shape(rng, 4), rng.normal(size=4)
        low, high = centre - rng.uniform(0, 2, 4) ** 2 * 20, centre + rng.uniform(0, 2, 4) ** 2 * 20
        points = rng.normal(size=(3000, 4)) @ np.linalg.cholesky(shape).T * 0.4 + centre
        points = points[(values(points, centre, shape) <= 1) & ((points >= low) & (points <= high)).all(axis=1)]
        assert shrink_to_extent(low, high, centre, shape)
        assert np.all(points >= low)
        assert np.all(points <= high)
        assert cut_by_guides(low, high, centre, shape)
        assert np.all(values(points, centre, shape) <= 1 + 1e-7)
    assert not shrink_to_extent(np.full(4, 1e3), np.full(4, 1e4), centre, shape)
    assert not cut_by_guides(np.full(4, 1e3), np.full(4, 1e4), centre, shape)


def test_the_ellipsoid_around_a_box_has_its_corners_on_it() -> None:
    """And no other has a smaller trace: squared semi-axes are h_j sum(h)."""
    low, high = np.array([-1.0, 0.0, 5.0]), np.array([1.0, 8.0, 5.5])
    centre, shape = np.empty(3), np.empty((3, 3))
    circumscribe(low, high, centre, shape)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    assert np.allclose(values(corners, centre, shape), 1, atol=1e-6)
    half = 0.5 * (high - low)
    assert np.allclose(np.diag(shape), half * half.sum(), atol=1e-6)
