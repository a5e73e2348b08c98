"""Ellipsoids, boxes and cells: strips that cut them, motion that widens them, and what an observation leaves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from pftrack.core.geometry import matrix
from pftrack.experiments.linkage.sets import ellipsoids, regions, space
from pftrack.experiments.linkage.sets.cells import cosine_range, label_components, link_cells, observe_in_plane, section
from pftrack.experiments.linkage.sets.ellipsoids import OUTER
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways, region_of
from pftrack.experiments.linkage.sets.space import Link, Strip, extent, intersect, observe_in_space
from pftrack.reproduce.linkage_regions import random_shape, sticks_out, values


def test_sets_that_share_nothing_are_found_empty() -> None:
    """A strip beside the ellipsoid empties it, one that touches it does not, and an empty one leaves it as it is."""
    centre, shape, normal = np.zeros(3), np.diag([4.0, 1.0, 9.0]), np.array([1.0, 0, 0])
    assert not ellipsoids.cut(centre, shape, normal, 3.5, 1.4)
    assert np.array_equal(shape, np.diag([4.0, 1.0, 9.0]))
    assert ellipsoids.cut(centre, shape, normal, 3.5, 1.5)
    assert np.all(np.linalg.eigvalsh(shape) > 0)
    assert values(np.array([[2.0, 0, 0]]), centre, shape)[0] <= 1 + 1e-6


def test_a_strip_along_an_axis_is_a_strip() -> None:
    """Cutting along an axis equals cutting by its unit vector.

    A strip with one side far off cuts as much as one that ends at the ellipsoid.
    """
    rng = np.random.default_rng(3)
    for axis in range(4):
        centre, shape, normal = rng.normal(size=4), random_shape(rng, 4), np.eye(4)[axis]
        half = np.sqrt(shape[axis, axis])
        low, high = centre[axis] - 0.3 * half, centre[axis] + 0.9 * half
        one, other, far, near = ((centre.copy(), shape.copy()) for _ in range(4))
        assert ellipsoids.cut_along(*one, axis, low, high)
        assert ellipsoids.cut(*other, normal, 0.5 * (low + high), 0.5 * (high - low))
        assert ellipsoids.cut(*far, normal, high - 50.0 * half, 50.0 * half)
        assert ellipsoids.cut(*near, normal, high - 0.95 * half, 0.95 * half)
        for found, wanted in ((one, other), (far, near)):
            assert all(map(np.allclose, found, wanted))


def test_thousands_of_hostile_cuts_leave_it_definite() -> None:
    """Strips of no width, directions of no extent and cuts at the very edge leave a shape that has a root."""
    rng = np.random.default_rng(4)
    centre, shape = np.zeros(4), np.diag([1e4, 1.0, 1e-4, 1.0])
    for _ in range(1000):
        normal = rng.normal(size=4) * (rng.random(4) < 0.5)
        half = float(np.sqrt(max(normal @ shape @ normal, 0)))
        offset = float(normal @ centre) + rng.choice([0.0, 0.5, 1.0, -1.0]) * half
        assert ellipsoids.cut(centre, shape, normal, offset, 0.0)
        shape[np.diag_indices(4)] += 1e-12
        assert np.all(np.isfinite(shape))
        np.linalg.cholesky(shape)


def test_the_bound_holds_where_some_coordinates_stay() -> None:
    """It does with a motion in the first coordinates alone, and in the others it stays finite."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        assert not sticks_out(random_shape(rng, 6), 3, rng.uniform(0.01, 50), ellipsoids.OUTER, rng)


def test_no_other_bound_of_the_family_has_a_smaller_trace() -> None:
    """P = sqrt(tr P / tr U) has the least trace; no motion moves nothing, and a point that moves becomes the ball."""
    shape, radius = np.diag([4.0, 1.0, 9.0]), 2.0
    after = shape.copy()
    ellipsoids.predict(after, 2, radius, ellipsoids.OUTER)
    ratios = np.geomspace(0.01, 100, 4000)
    traces = (1 + 1 / ratios) * 14.0 + (1 + ratios) * 2 * radius**2
    assert np.trace(after) == pytest.approx(traces.min(), rel=1e-5)
    kept, point = shape.copy(), np.zeros((3, 3))
    ellipsoids.predict(kept, 3, 0.0, ellipsoids.OUTER)
    assert np.allclose(kept, shape, atol=1e-10)
    ellipsoids.predict(point, 2, 1.5, ellipsoids.OUTER)
    assert np.allclose(point, np.diag([2.25, 2.25, 0]), atol=1e-4)


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
        first, last = low.copy(), high.copy()
        assert regions.contract(first, last, normal, least, most)
        kept = points[(inside >= least) & (inside <= most)]
        assert ((kept >= first) & (kept <= last)).all()
        assert ((first >= low) & (last <= high)).all()


def test_contraction_bounds_by_the_extremes_of_the_others() -> None:
    """From x - y within +-1, x in [0, 10] and y in [4, 5] follow x in [3, 6] and y as it was."""
    low, high = np.array([0.0, 4.0]), np.array([10.0, 5.0])
    assert regions.contract(low, high, np.array([1.0, -1.0]), -1.0, 1.0)
    assert np.allclose(low, [3, 4], atol=1e-6)
    assert np.allclose(high, [6, 5], atol=1e-6)


def test_a_strip_that_misses_the_box_empties_it() -> None:
    """So does one along an axis, and one of no normal that excludes 0; one that only touches leaves a point."""
    strips = [([1.0, 1.0], 2.1, 3.0), ([0.0, 1.0], -3.0, -0.1), ([0.0, 0.0], 0.5, 1.0), ([0.0, 0.0], -0.5, 1.0)]
    left = [regions.contract(np.zeros(2), np.ones(2), np.array(normal), *ends) for normal, *ends in strips]
    assert left == [False, False, False, True]
    low, high = np.zeros(2), np.ones(2)
    assert regions.contract(low, high, np.array([1.0, 1.0]), 2.0, 3.0)
    assert np.allclose(low, 1, atol=1e-6)


def test_the_ellipsoid_bounds_the_box_and_the_box_the_ellipsoid() -> None:
    """The box shrinks to the extent; cut by its guides the ellipsoid keeps all that is in both."""
    rng = np.random.default_rng(2)
    for _ in range(15):
        shape, centre = random_shape(rng, 4), rng.normal(size=4)
        low, high = centre - rng.uniform(0, 2, 4) ** 2 * 20, centre + rng.uniform(0, 2, 4) ** 2 * 20
        points = rng.normal(size=(3000, 4)) @ np.linalg.cholesky(shape).T * 0.4 + centre
        points = points[(values(points, centre, shape) <= 1) & ((points >= low) & (points <= high)).all(axis=1)]
        assert regions.shrink_to_extent(low, high, centre, shape)
        assert ((points >= low) & (points <= high)).all()
        assert regions.cut_by_guides(low, high, centre, shape)
        assert np.all(values(points, centre, shape) <= 1 + 1e-7)
    for shrink in (regions.shrink_to_extent, regions.cut_by_guides):
        assert not shrink(np.full(4, 1e3), np.full(4, 1e4), centre, shape)


def test_the_ellipsoid_around_a_box_has_its_corners_on_it() -> None:
    """And no other has a smaller trace: squared semi-axes are h_j sum(h)."""
    low, high = np.array([-1.0, 0.0, 5.0]), np.array([1.0, 8.0, 5.5])
    centre, shape = np.empty(3), np.empty((3, 3))
    regions.circumscribe(low, high, centre, shape)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    assert np.allclose(values(corners, centre, shape), 1, atol=1e-6)
    half = 0.5 * (high - low)
    assert np.allclose(np.diag(shape), half * half.sum(), atol=1e-6)


Triple = tuple[float, float, float]


@pytest.mark.parametrize(
    ("centre", "shape", "inside"),
    [
        ((0, 0, 0), (0.999, 0.999, 0.999), True),
        ((0, 0, 0), (1, 0.2, 0.9), True),
        ((0, 0, 0), (1.01, 0.2, 0.9), False),
        ((0.499, 0, 0), (0.25, 0.25, 0.25), True),
        ((0.501, 0, 0), (0.25, 0.25, 0.25), False),
        ((9, 0, 0), (1, 1, 1), False),
        ((0, 0.5, 0), (0.6, 0.2, 0.2), True),
    ],
)
def test_an_ellipsoid_lies_in_another_if_all_its_points_do(centre: Triple, shape: Triple, inside: bool) -> None:
    """The answer is that of the unit ball after any linear map of both."""
    rng = np.random.default_rng(0)
    for _ in range(10):
        root = rng.normal(size=(3, 3))
        small, ball = root @ np.diag(shape) @ root.T, root @ root.T
        assert ellipsoids.ellipsoid_in_ellipsoid(root @ centre, small, np.zeros(3), ball) == inside


def test_a_box_lies_in_an_ellipsoid_if_its_corners_do() -> None:
    """The ellipsoid around it holds it, and one that is smaller by a thousandth does not."""
    low, high = np.array([-1.0, 2.0]), np.array([3.0, 2.5])
    region = region_of(low, high)
    assert ellipsoids.box_in_ellipsoid(low, high, region[0], region[3:] * 1.000001)
    assert not ellipsoids.box_in_ellipsoid(low, high, region[0], region[3:] * 0.999)


def test_a_region_lies_in_another_by_box_and_by_ellipsoid() -> None:
    """Both must be inside, unless boxes are all there is; every region lies in itself."""
    large, small = regions.region_of(np.zeros(2), np.ones(2)), regions.region_of(np.full(2, 0.3), np.full(2, 0.6))
    assert regions.lies_in(small, large, True)
    assert regions.lies_in(large, large, True)
    assert not regions.lies_in(large, small, True)
    thin = regions.region_of(np.zeros(2), np.ones(2), np.diag([1.0, 1e-3]))
    assert not regions.lies_in(small, thin, True)
    assert regions.lies_in(small, thin, False)
    assert not regions.lies_in(regions.region_of(np.full(2, 0.5), np.full(2, 1.1)), large, False)


def test_a_point_is_in_a_region_by_box_and_by_ellipsoid() -> None:
    """A corner of the guides may be outside the ellipsoid, and the other way round."""
    region = regions.region_of(np.zeros(2), np.ones(2), 0.3 * np.eye(2))
    assert regions.contains(region, np.array([0.5, 0.5]))
    assert not regions.contains(region, np.array([0.99, 0.99]))
    assert regions.contains(region, np.array([0.99, 0.99]), ellipsoids=False)
    assert not regions.contains(region, np.array([0.5, 1.02]))


# Polygons of strips in the picture.


def unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("count", [2, 4])
def test_the_extent_is_that_of_all_points_in_the_strips(count: int) -> None:
    """It bounds all points of a dense grid that are in all strips, as closely as the grid can show."""
    rng = np.random.default_rng(count)
    grid = np.stack(np.meshgrid(*[np.linspace(-40, 40, 201)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(20):
        angles = np.array([0.0, 1.5, *rng.uniform(0, np.pi, count - 2)])
        ends = zip(map(unit, angles), rng.uniform(-9, 9, count), strict=True)
        strips: list[Strip] = [(normal, float(at - 8), float(at + 8)) for normal, at in ends]
        inside = grid[np.all([(low <= grid @ it) & (grid @ it <= high) for it, low, high in strips], axis=0)]
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


NOTHING = (-1.0, 0.0, 0.0)


def within(region: np.ndarray, points: np.ndarray, *, ellipsoids: bool) -> np.ndarray:
    """Whether points (m, n) are in a region, as `contains` would have it."""
    slack = 1e-6
    inside = ((points >= region[LOW] - slack) & (points <= region[HIGH] + slack)).all(axis=1)
    if ellipsoids:
        inside &= values(points, region[CENTRE], region[SHAPE:]) <= 1 + slack
    return np.asarray(inside)


def lost(regions: np.ndarray, points: np.ndarray, *, ellipsoids: bool) -> int:
    """How many points (m, n) are in none of some regions (K, n + 3, n)."""
    held = [within(region, points, ellipsoids=ellipsoids) for region in regions]
    return int((~np.any(held, axis=0)).sum()) if held else len(points)


@given(st.floats(-10, 10), st.floats(0, 7))
def test_the_range_of_cosines_is_exact(first: float, wide: float) -> None:
    """It is that of a dense sample, within what the sample misses."""
    least, most = cosine_range(first, first + wide)
    sample = np.cos(np.linspace(first, first + wide, 4001))
    assert -1e-15 <= sample.min() - least < 1e-5
    assert -1e-15 <= most - sample.max() < 1e-5


def test_a_section_is_the_extent_of_a_slice_of_the_ellipse() -> None:
    """Its ends are those of the ellipse's points between two values of x, the apex included."""
    rng = np.random.default_rng(0)
    circle = np.linspace(0, 2 * np.pi, 5001)
    for _ in range(60):
        shape = random_shape(rng, 2)
        x, y = np.linalg.cholesky(shape) @ np.array([np.cos(circle), np.sin(circle)])
        first, last = np.sort(rng.uniform(-1.2, 1.2, 2)) * np.sqrt(shape[0, 0])
        low, high = section(first, last, shape[0, 0], shape[0, 1], shape[1, 1])
        chosen = y[(x >= first) & (x <= last)]
        if len(chosen) < 50:
            continue
        assert low <= chosen.min() + 1e-9
        assert high >= chosen.max() - 1e-9
        assert low == pytest.approx(chosen.min(), abs=2e-2 * np.sqrt(shape[1, 1]))
        assert high == pytest.approx(chosen.max(), abs=2e-2 * np.sqrt(shape[1, 1]))
    assert section(3.0, 4.0, 4.0, 0.0, 1.0) == (1.0, -1.0)
    assert section(-1.0, 1.0, 0.0, 0.0, 4.0) == (-2.0, 2.0)


def test_what_nothing_shows_has_no_cell() -> None:
    """A length beyond the longest link is shown by no direction, one above 0 by none that points away."""
    for angles, seen in (((-1.0, 1.0), 90.0), ((2.0, 3.0), 10.0), ((-1.0, 1.0), -1.0)):
        _, low, high = link_cells(angles, (50.0, 80.0), seen, 0.5, (0.0, 0.0), NOTHING, 64)
        assert np.all(low > high)
    _, low, high = link_cells((0.0, 1.0), (50.0, 80.0), 60.0, 3.0, (5.0, 60.0), (1.0, 0.0, 1.0), 8)
    assert np.all(low > high)


def test_cells_are_as_tight_as_they_are_many() -> None:
    """With ever more of them the least length that shows 60 px anywhere tends to 60 px, less the bound."""
    for count in (4, 32, 256):
        _, low, high = link_cells((-0.5, 0.5), (40.0, 80.0), 60.0, 1.0, (0.0, 0.0), NOTHING, count)
        assert low[low <= high].min() == pytest.approx(59, abs=1e-6)
    _, low, high = link_cells((0.4, 0.5), (40.0, 80.0), 60.0, 1.0, (0.0, 0.0), NOTHING, 256)
    assert (low[0], high[-1]) == pytest.approx((59 / np.cos(0.4), 61 / np.cos(0.5)), abs=0.05)


@pytest.mark.parametrize("sizes", [(30,), (9, 11), (6, 7, 8), (5, 6, 7, 4)])
def test_runs_of_any_grid_are_those_of_scipy(sizes: tuple[int, ...]) -> None:
    """Neighbours touch at least at a corner, in any dimension."""
    rng = np.random.default_rng(0)
    for share in (0.02, 0.05, 0.3, 1.0):
        feasible = rng.random(sizes) < share
        wanted, count = ndimage.label(feasible, np.ones((3,) * len(sizes)))
        labels, found = label_components(feasible.ravel(), np.array(sizes))
        assert found == count
        assert np.array_equal(labels.reshape(sizes) + 1, wanted)


FULL = Ways(True, True, True, OUTER)
BOXES = FULL._replace(ellipsoids=False)
UNSPLIT = FULL._replace(splitting=False)
TREATMENTS = {"full": FULL, "literal": FULL._replace(guided=False), "boxes": BOXES, "unsplit": UNSPLIT}
REFERENCE = matrix(np.array([0.5, -0.4, 0.2]))
SCALE = 55.0


def directed(omega: np.ndarray, theta: float) -> np.ndarray:
    """What a link of length 1 shows (2,) in this direction."""
    turn = REFERENCE @ matrix(omega.copy())
    return np.asarray(turn[:2, 0] * np.cos(theta) + turn[:2, 1] * np.sin(theta))


def shown(link: Link, points: np.ndarray) -> np.ndarray:
    """What a link shows (m, 2) in poses (m, 8)."""
    angles = points[:, link.angle] / SCALE if link.angle >= 0 else np.zeros(len(points))
    return np.array([one[link.length] * directed(one[:3] / SCALE, at) for one, at in zip(points, angles, strict=True)])


def random_region(rng: np.random.Generator, half_rad: float) -> np.ndarray:
    """A region about a random pose; its ellipsoid, turned at random, is not much larger than the box."""
    middle = np.concatenate([rng.uniform(-1.5, 1.5, 5) * SCALE, rng.uniform(45, 75, 3)])
    half = np.concatenate([np.full(5, half_rad * SCALE), np.full(3, 10.0)])
    region = region_of(middle - half, middle + half)
    turn = np.eye(8) + 0.2 * rng.normal(size=(8, 8))
    region[SHAPE:] = 0.3 * turn @ region[SHAPE:] @ turn.T
    return region


@pytest.mark.parametrize("ways", [FULL, BOXES], ids=["ellipsoids", "boxes"])
@pytest.mark.parametrize("half_rad", [0.02, 0.2, 1.2])
def test_no_pose_that_fits_is_lost(half_rad: float, ways: Ways) -> None:
    """All poses of a region that show what was seen, within the bound, are in a cell and in what is left of it."""
    rng = np.random.default_rng(int(100 * half_rad))
    for case in range(24):
        region, number = random_region(rng, half_rad), case % 3
        link = Link(2 + number if number else -1, 5 + number, SCALE, REFERENCE)
        points = rng.uniform(region[1], region[2], (400, 8))
        inside = points[within(region, points, ellipsoids=ways.ellipsoids)]
        if not len(inside):
            continue
        seen = shown(link, inside)
        bound = float(rng.choice([0.5, 5.0, 40.0]))
        truth = seen[rng.integers(len(seen))] + rng.uniform(-bound, bound, 2)
        fits = inside[np.abs(seen - truth).max(axis=1) <= bound]
        grid = space.space_cells(region, link, truth, np.full(2, bound), 4, ways)
        for point in fits:
            off = (point[grid.axes] / SCALE - grid.low[:, 0]) / np.maximum(2 * grid.half, 1e-12)
            place = np.ravel_multi_index(tuple(np.clip(off.astype(int), 0, 3)), (4,) * len(grid.axes))
            assert grid.shortest[place] <= point[link.length] <= grid.longest[place]
        left = observe_in_space(region, link, truth, np.full(2, bound), 4, 8, ways)
        assert lost(left, fits, ellipsoids=ways.ellipsoids) == 0


def test_the_slopes_are_those_of_the_image() -> None:
    """Derivatives by the rotation vector and the direction agree with differences."""
    rng, step = np.random.default_rng(0), 1e-6
    for _ in range(20):
        place = np.append(rng.uniform(-1.5, 1.5, 3), rng.uniform(-2, 2))
        turned, cosine, sine = space.rotate(REFERENCE, place[:3]), np.cos(place[3]), np.sin(place[3])
        told = np.array([space.image(*turned, cosine, sine, k) for k in range(2)])
        for j, axis in enumerate(np.eye(4)):
            first, last = (directed(at[:3], at[3]) for at in (place - step * axis, place + step * axis))
            assert np.allclose(told[:, 1 + j], (last - first) / (2 * step), atol=1e-8)


def test_two_sides_of_the_image_make_two_regions() -> None:
    """Where a link may lean to either side of the image and not lie in it, its region splits; it need not.

    A link that is shown longer than it can be refutes its region, with ellipsoids and without.
    """
    low = np.concatenate([np.full(3, -0.01), np.full(2, -0.6)]) * SCALE
    region = region_of(np.append(low, [49.5] * 3), np.append(-low, [50.5] * 3))
    link = Link(3, 6, SCALE, np.eye(3)[[0, 2, 1]])
    seen, bound = np.array([50 * np.cos(0.45), 0.0]), np.full(2, 0.2)
    left = observe_in_space(region, link, seen, bound, 9, 8, FULL)
    assert sorted(np.sign(left[:, CENTRE, 3]).tolist()) == [-1.0, 1.0]
    assert len(observe_in_space(region, link, seen, bound, 9, 1, FULL)) == 1
    assert len(observe_in_space(region, link, seen, bound, 9, 8, UNSPLIT)) == 1
    for ways in (FULL, BOXES):
        assert len(observe_in_space(region, link, np.array([90.0, 10.0]), bound, 5, 8, ways)) == 0


@pytest.mark.parametrize("ways", TREATMENTS.values(), ids=TREATMENTS)
def test_no_pose_that_fits_is_lost_in_observation(ways: Ways) -> None:
    """All poses of a region that show what was seen, within the bound, are in what is left of it."""
    rng = np.random.default_rng(0)
    for _ in range(60):
        middle = np.concatenate([rng.uniform(-3, 3, 3) * SCALE, rng.uniform(45, 75, 3)])
        half = np.concatenate([np.full(3, rng.choice([0.02, 0.3, 1.0]) * SCALE), np.full(3, 10.0)])
        region = region_of(middle - half, middle + half)
        turn = np.eye(6) + 0.2 * rng.normal(size=(6, 6))
        region[SHAPE:] = 0.4 * turn @ region[SHAPE:] @ turn.T
        points = rng.uniform(region[LOW], region[HIGH], (600, 6))
        inside = points[within(region, points, ellipsoids=ways.ellipsoids)]
        link = int(rng.integers(3))
        seen = inside[:, 3 + link] * np.cos(inside[:, link] / SCALE)
        bound = float(rng.choice([0.01, 1.0, 6.0]))
        truth = seen[0] + rng.uniform(-bound, bound)
        left = observe_in_plane(region, (link, 3 + link), SCALE, truth, bound, 64, 8, ways)
        assert lost(left, inside[abs(seen - truth) <= bound], ellipsoids=ways.ellipsoids) == 0
