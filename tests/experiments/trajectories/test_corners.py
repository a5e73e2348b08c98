import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.experiments.trajectories.corners import GONE_FRAMES, CornerParameters, begin, follow

SIZE = (160, 120)


def world(seed: int = 0) -> NDArray[np.uint8]:
    """A large grey texture of rectangles, of which pictures show a part."""
    rng = np.random.default_rng(seed)
    grey = np.full((300, 400), 128, np.uint8)
    for x, y, level in rng.integers(0, [400, 300, 256], (500, 3)).tolist():
        cv2.rectangle(grey, (x, y), (x + 14, y + 9), level, -1)
    return grey


WORLD = world()


def seen(x: int, y: int = 60) -> NDArray[np.uint8]:
    """The part of the texture whose corner is there, in colour."""
    return np.repeat(WORLD[y : y + SIZE[1], x : x + SIZE[0], None], 3, axis=2)


def with_values(**values: object) -> CornerParameters:
    return revise(CornerParameters(), {"corner_count": 20, **values})


def test_corners_are_followed_as_the_picture_moves() -> None:
    """What moves by whole pixels is found there, at no cost, and what was known before is left as it was."""
    parameters = with_values()
    corners, first = begin(seen(60), parameters)
    followed, positions = corners, first
    for step in range(1, 5):
        followed, positions = follow(followed, seen(60 + 3 * step, 60 - 2 * step), parameters, step)
        there = ~np.isnan(positions[:, 0])
        assert (positions[there] == (first - np.array([3, -2]) * step)[there]).all()
        assert (followed.costs[there] == 0).all()
    assert there.mean() > 0.7
    assert (corners.places == first).all()
    assert (followed.born == 0).all()


def test_a_corner_that_leaves_is_not_found() -> None:
    """Beyond the edge of the picture there is no match; when the picture comes back, so does the corner."""
    parameters = with_values(largest_cost=10)
    corners, first = begin(seen(60), parameters)
    path = [62, 68, 74, 80, 86, 80, 74, 68, 62, 60]
    found = []
    for index, x in enumerate(path, 1):
        corners, positions = follow(corners, seen(x), parameters, index)
        found.append(positions)
    left = first[:, 0] < 26
    assert left.any()
    assert np.isnan(found[4][left]).all()
    assert (found[-1][left] == first[left]).all()
    stayed = (first[:, 0] > 35) & ~np.isnan(found[-1][:, 0])
    assert (found[-1][stayed] == first[stayed]).all()


def test_matches_that_cost_too_much_are_none() -> None:
    """A picture of something else has no match at all: no place, and the search stays where it was."""
    parameters = with_values(largest_cost=5)
    corners, first = begin(seen(60), parameters)
    other = np.random.default_rng(1).integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)
    lost, positions = follow(corners, other, parameters, 1)
    assert np.isnan(positions).all()
    assert (lost.places == first).all()
    assert (lost.missing == 1).all()
    _, back = follow(lost, seen(60), parameters, 2)
    assert (back == first).all()


def test_matches_that_are_ambiguous_are_none() -> None:
    """On a lattice another place is nearly as good, and is told by the ratio of the costs."""
    lattice = np.full((*SIZE[::-1], 3), 170, np.uint8)
    lattice[::11] = 95
    lattice[:, ::11] = 95
    noise = np.random.default_rng(0).normal(0, 4, (2, *lattice.shape))
    one, other = (np.clip(lattice + it, 0, 255).astype(np.uint8) for it in noise)
    corners, first = begin(one, with_values())
    taken, found = follow(corners, other, with_values(), 1)
    assert not np.isnan(found).any()
    assert (taken.ratios > 0.7).all()
    assert np.isnan(follow(corners, other, with_values(largest_ratio=0.7), 1)[1]).all()
    assert len(first) == 20


def test_gone_corners_are_replaced() -> None:
    """With the option, after ten frames each that is gone gives its place to another, elsewhere; without, none does."""
    parameters = with_values(new_corners=True, corner_quality=0.01, largest_cost=20)
    begun, first = begin(seen(20), parameters)
    for new in (True, False):
        corners = begun
        for index in range(1, 2 * GONE_FRAMES + 1):
            values = revise(parameters, {"new_corners": new})
            corners, positions = follow(corners, seen(180), values, index)
        assert (corners.born > 0).any() == new
        if new:
            slots = corners.born > 0
            assert set(corners.born[slots]) <= {GONE_FRAMES, 2 * GONE_FRAMES}
            assert not np.isnan(positions[slots]).any()
            apart = np.hypot(*(positions[slots][:, None] - positions[slots]).transpose(2, 0, 1))
            assert (apart + 1e9 * np.eye(slots.sum()) >= parameters.corner_distance_px).all()
            assert len(corners.born) == len(first)


def test_renewed_templates_adapt() -> None:
    """A picture that becomes darker by and by is followed at the cost of one step, not of all together."""
    darker = [np.clip(seen(60).astype(float) * (1 - 0.03 * step), 0, 255).astype(np.uint8) for step in range(8)]
    costs = {}
    for renewal in (False, True):
        parameters = with_values(template_renewal=renewal)
        corners, _ = begin(darker[0], parameters)
        for index, image in enumerate(darker[1:], 1):
            corners, _ = follow(corners, image, parameters, index)
        costs[renewal] = float(np.median(corners.costs))
    assert costs[True] < 0.3 * costs[False]


@pytest.mark.parametrize("size", [(1, 1), (11, 11), (400, 3)])
def test_a_picture_without_room_has_no_corner(size: tuple[int, int]) -> None:
    """Nothing is found in a picture that is smaller than a template, or flat, and nothing can be followed: no error."""
    image = np.random.default_rng(0).integers(0, 256, (*size, 3)).astype(np.uint8)
    corners, positions = begin(image, with_values(corner_margin_px=0))
    assert positions.shape == (0, 2)
    assert follow(corners, image, with_values(new_corners=True), 10)[1].shape == (0, 2)


def test_what_rests_is_told_by_its_place() -> None:
    """A corner rests if its first place goes on showing it, however wrong the matches are; what moves does not rest."""
    parameters = with_values(match_cost="difference")
    corners, _ = begin(seen(60), parameters)
    assert not corners.resting.any()
    rng = np.random.default_rng(2)
    moving = corners
    for index in range(1, GONE_FRAMES + 1):
        hidden = rng.integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)
        corners, _ = follow(corners, hidden if index in {2, 3, 6} else seen(60), parameters, index)
        moving, _ = follow(moving, seen(60 + 3 * index), parameters, index)
    assert corners.resting.all()
    assert moving.resting.mean() < 0.2


def test_new_corners_are_away_from_those_that_stay() -> None:
    """Where half of the picture becomes another one, what is taken up there and elsewhere is not taken up twice."""
    parameters = with_values(new_corners=True, corner_count=40, corner_quality=0.001, largest_cost=5)
    other = seen(60).copy()
    other[:, 80:] = seen(200)[:, 80:]
    corners, _ = begin(seen(60), parameters)
    for index in range(1, GONE_FRAMES + 1):
        corners, positions = follow(corners, other, parameters, index)
    new, stayed = corners.born > 0, (corners.born == 0) & ~np.isnan(positions[:, 0])
    assert new.any()
    assert stayed.any()
    apart = np.hypot(*(positions[new][:, None] - positions[stayed]).transpose(2, 0, 1))
    assert apart.min() >= parameters.corner_distance_px


def test_the_largest_correlation_cost_is_in_hundredths() -> None:
    """By correlation a cost is 0 to 2: what is unlike, at about 0.5 and more, is none at 20 and taken at 200."""
    other = np.random.default_rng(1).integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)
    for largest, found in ((20, False), (200, True)):
        parameters = with_values(match_cost="correlation", largest_cost=largest)
        corners, _ = begin(seen(60), parameters)
        _, positions = follow(corners, other, parameters, 1)
        assert np.isfinite(positions[:, 0]).any() == found
