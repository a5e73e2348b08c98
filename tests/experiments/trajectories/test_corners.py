"""Corners: how they are found, followed and simulated."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.trajectories import scene
from pftrack.experiments.trajectories.corners import GONE_FRAMES, CornerParameters, begin, find_corners, follow
from pftrack.vision.matching import cut, match

SIZE = (160, 120)


def rectangles(
    rng: np.random.Generator, size: tuple[int, int], count: int, sides: tuple[int, int] = (14, 9)
) -> NDArray[np.uint8]:
    """A grey texture of rectangles."""
    grey = np.full(size[::-1], 128, np.uint8)
    for x, y, level in rng.integers(0, [*size, 256], (count, 3)).tolist():
        cv2.rectangle(grey, (x, y), (x + sides[0], y + sides[1]), level, -1)
    return grey


WORLD = rectangles(np.random.default_rng(0), (400, 300), 500)
"""A large texture; pictures show a part of it."""


def noise(seed: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (*SIZE[::-1], 3)).astype(np.uint8)


def apart(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """The distances of all pairs of places."""
    first, second = np.triu_indices(len(places), 1)
    return np.hypot(*(places[first] - places[second]).T)


def seen(x: int, y: int = 60) -> NDArray[np.uint8]:
    """The part of the texture whose corner is there, in colour."""
    return np.repeat(WORLD[y : y + SIZE[1], x : x + SIZE[0], None], 3, axis=2)


def with_values(**values: object) -> CornerParameters:
    return revise(CornerParameters(), {"corner_count": 20, **values})


def test_corners_are_followed_as_the_picture_moves() -> None:
    """What moves by whole pixels is found there, at no cost, and what was known before is left as it was."""
    parameters = with_values()
    corners, first = begin(seen(60), parameters)
    followed, there = corners, np.zeros(0)
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
    parameters, found = with_values(largest_cost=10), []
    corners, first = begin(seen(60), parameters)
    for index, x in enumerate([62, 68, 74, 80, 86, 80, 74, 68, 62, 60], 1):
        corners, positions = follow(corners, seen(x), parameters, index)
        found.append(positions)
    left = first[:, 0] < 26
    assert left.any()
    assert np.isnan(found[4][left]).all()
    back = left | ((first[:, 0] > 35) & ~np.isnan(found[-1][:, 0]))
    assert (found[-1][back] == first[back]).all()


def test_matches_that_cost_too_much_are_none() -> None:
    """A picture of something else has no match at all: no place, and the search stays where it was."""
    parameters = with_values(largest_cost=5)
    corners, first = begin(seen(60), parameters)
    lost, positions = follow(corners, noise(1), parameters, 1)
    assert np.isnan(positions).all()
    assert (lost.places == first).all()
    assert (lost.missing == 1).all()
    assert (follow(lost, seen(60), parameters, 2)[1] == first).all()


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


@pytest.mark.parametrize("new", [True, False])
def test_gone_corners_are_replaced(new: bool) -> None:
    """With the option, after ten frames each that is gone gives its place to another; without, none does.

    New corners keep their distance from each other and from those that stay.
    """
    parameters = with_values(new_corners=new, corner_quality=0.01, largest_cost=20)
    corners, first = begin(seen(20), parameters)
    for index in range(1, 2 * GONE_FRAMES + 1):
        corners, positions = follow(corners, seen(180), parameters, index)
    slots = corners.born > 0
    assert slots.any() == new
    assert set(corners.born[slots]) <= {GONE_FRAMES, 2 * GONE_FRAMES}
    assert not np.isnan(positions[slots]).any()
    assert apart(positions[slots]).min(initial=np.inf) >= parameters.corner_distance_px
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
    resting = moving = begin(seen(60), parameters)[0]
    assert not resting.resting.any()
    for index in range(1, GONE_FRAMES + 1):
        resting, _ = follow(resting, noise(index) if index in {2, 3, 6} else seen(60), parameters, index)
        moving, _ = follow(moving, seen(60 + 3 * index), parameters, index)
    assert resting.resting.all()
    assert moving.resting.mean() < 0.2


@pytest.mark.parametrize(("largest", "found"), [(20, False), (200, True)])
def test_the_largest_correlation_cost_is_in_hundredths(largest: int, found: bool) -> None:
    """By correlation a cost is 0 to 2: what is unlike, at about 0.5 and more, is none at 20 and taken at 200."""
    parameters = with_values(match_cost="correlation", largest_cost=largest)
    corners, _ = begin(seen(60), parameters)
    assert np.isfinite(follow(corners, noise(1), parameters, 1)[1]).any() == found


def test_the_eigenvalue_finds_what_opencv_finds() -> None:
    """Where single precision does not matter, the list is that of OpenCV's detector, in its order."""
    rng = np.random.default_rng(0)
    grey = rectangles(rng, (160, 120), 40, (12, 8))
    grey = np.clip(grey + rng.normal(0, 2, grey.shape), 0, 255).astype(np.uint8)
    peer = cv2.goodFeaturesToTrack(grey, 60, 0.05, 9, blockSize=5).reshape(-1, 2)
    assert (find_corners(grey, with_values(corner_count=60, corner_margin_px=1)) == peer).all()


@pytest.mark.parametrize("detector", ["eigenvalue", "orientation"])
def test_the_corners_of_a_rectangle_are_found(detector: str) -> None:
    """A bright rectangle has four corners, each found within two pixels; a flat picture has none."""
    grey = np.full((80, 100), 40, np.uint8)
    assert find_corners(grey, with_values(corner_detector=detector)).shape == (0, 2)
    grey[25:55, 30:70] = 200
    found = find_corners(grey, with_values(corner_detector=detector, corner_quality=0.3))
    truth = np.array([[29.5, 24.5], [69.5, 24.5], [29.5, 54.5], [69.5, 54.5]])
    assert len(found) == 4
    assert np.abs(found[:, None] - truth).max(axis=2).min(axis=0).max() <= 2.0


@pytest.mark.parametrize("detector", ["eigenvalue", "orientation"])
def test_corners_keep_their_distance(detector: str) -> None:
    """From each other, from the edge, and to the number and the places that are allowed."""
    grey = rectangles(np.random.default_rng(1), (160, 120), 40, (12, 8))
    parameters = with_values(corner_detector=detector, corner_distance_px=15, corner_margin_px=20, corner_count=10)
    found = find_corners(grey, parameters)
    assert 1 < len(found) <= 10
    assert apart(found).min() >= 15
    assert ((found >= 20) & (found <= np.array([160, 120]) - 21)).all()
    among = np.zeros(grey.shape, np.bool_)
    among[:, 80:] = True
    assert (find_corners(grey, parameters, among)[:, 0] >= 80).all()


PLAIN = scene.CornerSceneParameters()
CLEAN = revise(PLAIN, {"image_noise_sd": 0, "gain_jump": 0, "gain_jump_share": 0})


def history(parameters: scene.CornerSceneParameters = PLAIN) -> History[scene.CornerSceneParameters]:
    return History(((0, parameters),))


def grey(source: scene.CornerSource, index: int, past: History[scene.CornerSceneParameters]) -> NDArray[np.uint8]:
    image = source.frame(index, past).image_rgb
    return image[:, :, 0]


@pytest.fixture(scope="module")
def source() -> scene.CornerSource:
    return scene.CornerSource(1, PLAIN)


def test_corners_stay_in_sight(source: scene.CornerSource) -> None:
    """At most 60 corners of all surfaces are followed, and for 60 frames none is near the edge or hidden."""
    points, motion = source.points_px, scene.SceneMotion(scene.shifts_px(np.arange(float(scene.CORNERS_FRAMES))))
    first = np.zeros(len(points), np.int64)
    assert 50 <= len(points) <= 60
    assert set(motion.surfaces(points, first)) == {scene.ON_WALL, scene.ON_BOOK, scene.ON_BOX}
    for index in (0, 20, 59):
        now = motion.path(points, index, first)
        assert ((now >= 12) & (now <= np.array(scene.CORNERS_SIZE_PX) - 13)).all()
        assert not motion.hidden(points, index, 8.0).any()


def test_the_truth_is_where_the_picture_has_moved_to() -> None:
    """Without noise and jumps, what is not ambiguous is matched within half a pixel of its true place, in any frame."""
    source, clean = scene.CornerSource(0, CLEAN), history(CLEAN)
    points = source.points_px
    first = np.zeros(len(points), np.int64)
    templates = cut(grey(source, 0, clean), points.astype(np.int64), 11)
    for index in (1, 25, 59):
        motion = source.frame(index, clean).target.motion  # type: ignore[union-attr]
        truth = motion.path(points, index, first)
        found = match(grey(source, index, clean), templates, np.rint(truth).astype(np.int64), 3, "correlation")
        off = np.abs(found.places + found.offsets - truth).max(axis=1)
        assert np.median(off) < 0.15
        assert np.quantile(off[motion.surfaces(points, first) != scene.ON_BOOK], 0.95) < 0.6


def test_points_that_are_taken_up_later_have_a_truth() -> None:
    """A point of a later picture moves with the surface that is in front there."""
    index, later, motion = 40, 55, scene.SceneMotion(scene.shifts_px(np.arange(60.0)))
    corners = scene.CORNERS_PX + motion.shifts[index]
    points = np.array([[20.0, 20.0], corners[scene.ON_BOOK] + 5.0, corners[scene.ON_BOX] + 5.0])
    born = np.full(3, index)
    assert motion.surfaces(points, born).tolist() == [scene.ON_WALL, scene.ON_BOOK, scene.ON_BOX]
    moved = motion.path(points, later, born)
    assert moved - points == pytest.approx(motion.shifts[later] - motion.shifts[index])
    assert motion.path(points, index, born) == pytest.approx(points)
    assert scene.SceneMotion(motion.shifts[:56]).path(points, later, born) == pytest.approx(moved)


def test_the_drift_turns_back() -> None:
    """After 60 frames what has drifted away comes back, so that an endless run stays in the picture."""
    shifts = scene.shifts_px(np.arange(600.0))
    for surface, size in ((scene.ON_BOOK, (110, 84)), (scene.ON_BOX, (70, 90))):
        corner = scene.CORNERS_PX[surface] + shifts[:, surface]
        assert (corner > 0).all()
        assert (corner + size < scene.CORNERS_SIZE_PX).all()
    assert np.abs(shifts[:, scene.ON_WALL]).max() < 48


def test_parameters_act_from_their_frame_on(source: scene.CornerSource) -> None:
    """A change leaves earlier frames alone: at half the speed all is where it was half as many frames later."""
    changed = History(((0, PLAIN), (11, revise(PLAIN, {"scene_speed": 0.5}))))
    assert (grey(source, 10, changed) == grey(source, 10, history())).all()
    one, other = (source.frame(index, past).target for index, past in ((30, changed), (20, history())))
    assert (one.position == other.position).all()  # type: ignore[union-attr]
    noisy = History(((0, PLAIN), (5, revise(PLAIN, {"image_noise_sd": 0}))))
    assert grey(source, 6, noisy).std() < grey(source, 6, history()).std()


def test_the_light_jumps() -> None:
    """With jumps in every frame the mean brightness is off by about a tenth; without, by the flicker alone."""
    source, jumping = scene.CornerSource(0, CLEAN), history(revise(CLEAN, {"gain_jump": 0.11, "gain_jump_share": 1}))
    pasts = history(CLEAN), jumping
    steady, unsteady = (np.array([grey(source, index, past).mean() for index in range(8)]) for past in pasts)
    assert np.abs(unsteady / steady - 1.0) == pytest.approx(0.11, abs=0.01)
    assert steady.std() / steady.mean() < 0.05


def test_the_lattice_is_what_was_asked_for() -> None:
    """Pitch and contrast of the wall are those of the parameters."""
    lines = scene.wall(0, 20, 100.0)[::-1][:, 5:9].mean(axis=1)[::-1]
    dark = lines < lines.max() - 16 * 60
    assert np.flatnonzero(dark[1:] & ~dark[:-1])[:3].tolist() == [19, 39, 59]


def test_a_scene_without_a_corner_is_refused() -> None:
    """Where nothing is left to be followed, a sentence says so."""
    with pytest.raises(ValueError, match=r"no corner of frame 0 stays in sight for 60 frames"):
        scene.CornerSource(0, revise(PLAIN, {"false_corners": 0, "corner_margin_px": 150}))
