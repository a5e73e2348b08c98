import numpy as np
import pytest

from pftrack.core.geometry import matrix
from pftrack.experiments.linkage.sets.ellipsoids import OUTER
from pftrack.experiments.linkage.sets.regions import CENTRE, SHAPE, Ways, region_of
from pftrack.experiments.linkage.sets.space import Link, image, observe_in_space, rotate, space_cells
from tests.experiments.linkage.sets.ellipsoids import lost, within

FULL = Ways(True, True, True, OUTER)
BOXES = FULL._replace(ellipsoids=False)
REFERENCE = matrix(np.array([0.5, -0.4, 0.2]))
SCALE = 55.0


def shown(link: Link, points: np.ndarray) -> np.ndarray:
    """What a link shows (m, 2) in poses (m, 8)."""
    seen = []
    for point in points:
        turn = link.reference @ matrix(point[:3] / SCALE)
        theta = point[link.angle] / SCALE if link.angle >= 0 else 0.0
        seen.append(point[link.length] * (turn[:2, 0] * np.cos(theta) + turn[:2, 1] * np.sin(theta)))
    return np.array(seen)


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
    rng = np.random.default_rng(0)
    for _ in range(20):
        omega, theta, step = rng.uniform(-1.5, 1.5, 3), rng.uniform(-2, 2), 1e-6
        told = np.array([image(*rotate(REFERENCE, omega), np.cos(theta), np.sin(theta), k) for k in range(2)])
        for j in range(4):
            ends = []
            for sign in (-1, 1):
                place = np.append(omega, theta)
                place[j] += sign * step
                turn = REFERENCE @ matrix(place[:3].copy())
                ends.append(turn[:2, 0] * np.cos(place[3]) + turn[:2, 1] * np.sin(place[3]))
            assert np.allclose(told[:, 1 + j], (ends[1] - ends[0]) / (2 * step), atol=1e-8)


def test_what_cannot_be_leaves_nothing() -> None:
    """A link that is shown longer than it can be refutes its region, with ellipsoids and without."""
    region = random_region(np.random.default_rng(1), 0.2)
    link = Link(3, 6, SCALE, REFERENCE)
    for ways in (FULL, BOXES):
        assert len(observe_in_space(region, link, np.array([90.0, 10.0]), np.full(2, 0.5), 5, 8, ways)) == 0


def test_two_sides_of_the_image_make_two_regions() -> None:
    """Where a link may lean to either side of the image and not lie in it, its region splits; it need not."""
    low = np.concatenate([np.full(3, -0.01), np.full(2, -0.6)]) * SCALE
    region = region_of(np.append(low, [49.5] * 3), np.append(-low, [50.5] * 3))
    link = Link(3, 6, SCALE, np.eye(3)[[0, 2, 1]])
    seen = np.array([50 * np.cos(0.45), 0.0])
    left = observe_in_space(region, link, seen, np.full(2, 0.2), 9, 8, FULL)
    assert len(left) == 2
    assert sorted(np.sign(left[:, CENTRE, 3]).tolist()) == [-1.0, 1.0]
    assert len(observe_in_space(region, link, seen, np.full(2, 0.2), 9, 1, FULL)) == 1
    assert len(observe_in_space(region, link, seen, np.full(2, 0.2), 9, 8, FULL._replace(splitting=False))) == 1
