import numpy as np
import pytest

from pftrack.experiments.linkage.sets.cells import observe_in_plane
from pftrack.experiments.linkage.sets.ellipsoids import OUTER
from pftrack.experiments.linkage.sets.regions import HIGH, LOW, SHAPE, Ways, contains, region_of
from tests.experiments.linkage.sets.ellipsoids import lost, within

FULL = Ways(True, True, True, OUTER)
TREATMENTS = {
    "full": FULL,
    "literal": FULL._replace(guided=False),
    "boxes": FULL._replace(ellipsoids=False),
    "unsplit": FULL._replace(splitting=False),
}
SCALE = 55.0


@pytest.mark.parametrize("ways", TREATMENTS.values(), ids=TREATMENTS)
def test_no_pose_that_fits_is_lost(ways: Ways) -> None:
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
    low, high = np.array([-0.6 * SCALE, 0, 0, 49, 50, 50]), np.array([0.6 * SCALE, 1, 1, 51, 60, 60])
    low[0] = least_rad * SCALE
    return region_of(low, high)


def test_a_link_that_cannot_lie_in_the_image_leans_to_either_side() -> None:
    """Cells that fall apart make two regions, each about its own direction, unless there is no room for them."""
    seen = 50 * np.cos(0.45)
    left = observe_in_plane(leaning(-0.6), (0, 3), SCALE, seen, 0.5, 64, 8, FULL)
    assert len(left) == 2
    assert left[0, HIGH, 0] < -0.3 * SCALE < 0.3 * SCALE < left[1, LOW, 0]
    assert len(observe_in_plane(leaning(-0.6), (0, 3), SCALE, seen, 0.5, 64, 1, FULL)) == 1
    assert len(observe_in_plane(leaning(-0.1), (0, 3), SCALE, seen, 0.5, 64, 8, FULL)) == 1


def test_an_impossible_length_leaves_nothing() -> None:
    """A link that is shown longer than it can be refutes its region."""
    for ways in TREATMENTS.values():
        assert len(observe_in_plane(leaning(-0.6), (0, 3), SCALE, 53.0, 1.5, 64, 8, ways)) == 0


def test_a_region_of_one_point_stays_where_it_is() -> None:
    """Observed exactly, again and again, it is neither lost nor empty."""
    point = np.array([0.3 * SCALE, 0.9 * SCALE, 1.4 * SCALE, 60, 55, 50])
    region = region_of(point, point)
    for turn in range(200):
        link = turn % 3
        seen = float(point[3 + link] * np.cos(point[link] / SCALE))
        left = observe_in_plane(region, (link, 3 + link), SCALE, seen, 0.0, 16, 8, FULL)
        assert len(left) == 1
        region = left[0]
        assert contains(region, point)
