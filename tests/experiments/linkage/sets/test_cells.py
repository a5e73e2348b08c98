"""Cells of a link's poses, in the plane and in space, and what an observation leaves of a region."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from pftrack.core.geometry import matrix
from pftrack.experiments.linkage.sets.cells import cosine_range, label_components, link_cells, observe_in_plane, section
from pftrack.experiments.linkage.sets.ellipsoids import OUTER
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways, contains, region_of
from pftrack.experiments.linkage.sets.space import Link, image, observe_in_space, rotate, space_cells
from pftrack.reproduce.linkage_regions import random_shape, values
from tests.experiments.linkage.sets.ellipsoids import lost, within

NOTHING = (-1.0, 0.0, 0.0)


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
    circle = np.linspace(0, 2 * np.pi, 20001)
    for _ in range(300):
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


@pytest.mark.parametrize("count", [1, 7, 128])
def test_no_pose_that_fits_is_outside_the_cells(count: int) -> None:
    """Of random directions and lengths, all that are possible are in their cell, for any sign and bound."""
    rng = np.random.default_rng(count)
    for case in range(60):
        start = rng.uniform(-7, 7)
        angles, lengths = (start, start + rng.choice([1e-3, 0.3, 4.0])), (30.0, 80.0)
        theta, r = rng.uniform(*angles, 4000), rng.uniform(*lengths, 4000)
        truth, bound = rng.integers(4000), rng.choice([0.0, 0.5, 3.0, 30.0])
        seen = float(r[truth] * np.cos(theta[truth]))
        place, shape, ellipse = np.array([start, 55.0]), random_shape(rng, 2), NOTHING
        fits = abs(r * np.cos(theta) - seen) <= bound
        if case % 2:
            ellipse = (shape[0, 0], shape[0, 1], shape[1, 1])
            fits &= values(np.stack([theta, r], axis=1), place, shape) <= 1
        edges, low, high = link_cells(angles, lengths, seen, bound, (place[0], place[1]), ellipse, count)
        cell = np.clip(np.searchsorted(edges, theta, side="right") - 1, 0, count - 1)
        assert ((low[cell] <= r) & (r <= high[cell]))[fits].all()


def test_what_nothing_shows_has_no_cell() -> None:
    """A length beyond the longest link is shown by no direction, one above 0 by none that points away."""
    for angles, seen in (((-1.0, 1.0), 90.0), ((2.0, 3.0), 10.0), ((-1.0, 1.0), -1.0)):
        _, low, high = link_cells(angles, (50.0, 80.0), seen, 0.5, (0.0, 0.0), NOTHING, 64)
        assert np.all(low > high)
    _, low, high = link_cells((0.0, 1.0), (50.0, 80.0), 60.0, 3.0, (5.0, 60.0), (1.0, 0.0, 1.0), 8)
    assert np.all(low > high)


def test_cells_are_as_tight_as_they_are_many() -> None:
    """With ever more of them the least length that shows 60 px anywhere comes to 60 px, less the bound."""
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
TREATMENTS = {
    "full": FULL,
    "literal": FULL._replace(guided=False),
    "boxes": BOXES,
    "unsplit": FULL._replace(splitting=False),
}
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
    """Of poses of a region that show what was seen, within the bound, all are in a cell and in what is left of it."""
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
        grid = space_cells(region, link, truth, np.full(2, bound), 4, ways)
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
        turned, cosine, sine = rotate(REFERENCE, place[:3]), np.cos(place[3]), np.sin(place[3])
        told = np.array([image(*turned, cosine, sine, k) for k in range(2)])
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
    assert len(observe_in_space(region, link, seen, bound, 9, 8, TREATMENTS["unsplit"])) == 1
    for ways in (FULL, BOXES):
        assert len(observe_in_space(region, link, np.array([90.0, 10.0]), bound, 5, 8, ways)) == 0


@pytest.mark.parametrize("ways", TREATMENTS.values(), ids=TREATMENTS)
def test_no_pose_that_fits_is_lost_in_observation(ways: Ways) -> None:
    """Of poses of a region that show what was seen, within the bound, all are in what is left of it."""
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


def leaning(least_rad: float) -> np.ndarray:
    """A region of a first link of 49 to 51 px that leans by at most 0.6 rad to either side."""
    return region_of(np.array([least_rad * SCALE, 0, 0, 49, 50, 50]), np.array([0.6 * SCALE, 1, 1, 51, 60, 60]))


def test_a_link_that_cannot_lie_in_the_image_leans_to_either_side() -> None:
    """Cells that fall apart make two regions, each about its own direction, unless there is no room for them.

    A link that is shown longer than it can be refutes its region.
    """
    seen = 50 * np.cos(0.45)
    left = observe_in_plane(leaning(-0.6), (0, 3), SCALE, seen, 0.5, 64, 8, FULL)
    assert len(left) == 2
    assert left[0, HIGH, 0] < -0.3 * SCALE < 0.3 * SCALE < left[1, LOW, 0]
    assert len(observe_in_plane(leaning(-0.6), (0, 3), SCALE, seen, 0.5, 64, 1, FULL)) == 1
    assert len(observe_in_plane(leaning(-0.1), (0, 3), SCALE, seen, 0.5, 64, 8, FULL)) == 1
    for ways in TREATMENTS.values():
        assert len(observe_in_plane(leaning(-0.6), (0, 3), SCALE, 53.0, 1.5, 64, 8, ways)) == 0


def test_a_region_of_one_point_stays_where_it_is() -> None:
    """Observed exactly, again and again, it is neither lost nor empty."""
    point = np.array([0.3 * SCALE, 0.9 * SCALE, 1.4 * SCALE, 60, 55, 50])
    region = region_of(point, point)
    for link in [0, 1, 2] * 66:
        seen = float(point[3 + link] * np.cos(point[link] / SCALE))
        (region,) = observe_in_plane(region, (link, 3 + link), SCALE, seen, 0.0, 16, 8, FULL)
        assert contains(region, point)
