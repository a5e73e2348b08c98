"""Templates in relief: what a feature looks like once the surface that it lies on has turned."""

import numpy as np
import pytest

from pftrack.vision.likelihoods import separation
from pftrack.vision.likelihoods.separation import Reliefs

SIDE = 15
FRONTAL = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
PLACE = np.array([[[60.0, 50.0]]])


def plate(levels: np.ndarray | None = None) -> Reliefs:
    """One feature in the middle of a plate that faces the camera, a px a mm."""
    x, y = np.meshgrid(np.arange(SIDE) - SIDE // 2, np.arange(SIDE) - SIDE // 2)
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(float)
    known = pattern(points) if levels is None else levels
    return Reliefs(points, np.tile([0.0, 0.0, -1.0], (len(points), 1)), known, np.array([0, len(points)]))


def pattern(points: np.ndarray) -> np.ndarray:
    return np.round(128 + 60 * np.sin(0.7 * points[:, 0]) + 50 * np.cos(0.9 * points[:, 1] + 0.3 * points[:, 0]))


def picture(slopes: np.ndarray, size: tuple[int, int] = (100, 120)) -> np.ndarray:
    """The plate as it is seen by a camera with these slopes (2, 3), about `PLACE`."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    off = np.stack([columns - PLACE[0, 0, 0], rows - PLACE[0, 0, 1]], axis=-1).reshape(-1, 2)
    flat = off @ np.linalg.inv(slopes[:, :2]).T
    return pattern(flat).reshape(size).clip(0, 255).astype(np.uint8)


def turned(degrees: float, scale: float = 1.0) -> np.ndarray:
    turn = np.deg2rad(degrees)
    return scale * np.array([[[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0]]])


VIEWS = separation.project_views(plate(), FRONTAL)
SEEN = picture(FRONTAL[0])


def correlation(seen: np.ndarray, place: np.ndarray = PLACE, views: separation.Views = VIEWS) -> float:
    return float(separation.correlations(seen, place, views)[0, 0])


def test_as_it_was_seen_it_fits() -> None:
    """Gain and offset change nothing, and a flat picture fits nothing."""
    assert correlation(SEEN) == pytest.approx(1.0, abs=1e-6)
    assert VIEWS.levels.sum() == pytest.approx(0.0, abs=1e-9)
    assert np.square(VIEWS.levels).sum() == pytest.approx(1.0)
    assert correlation((0.5 * SEEN.astype(float) + 20).astype(np.uint8)) > 0.999
    assert correlation(np.full((100, 120), 77, np.uint8)) == -1.0


def test_what_has_turned_away_says_nothing() -> None:
    """Seen from the edge, from behind or without contrast there is no template, and every place is as good."""
    for plane, degrees in ((plate(), 85.0), (plate(), 180.0), (plate(np.full(SIDE * SIDE, 90.0)), 0.0)):
        views = separation.project_views(plane, turned(degrees))
        assert np.diff(views.ends).tolist() == [0]
        assert (separation.correlations(SEEN, PLACE, views) == 0.0).all()


@pytest.mark.parametrize("place", [(3.0, 50.0), (60.0, 97.0), (-1e9, 0.0), (np.nan, 20.0)])
def test_beyond_the_picture_nothing_fits(place: tuple[float, float]) -> None:
    assert correlation(SEEN, np.array([[place]])) == -1.0


@pytest.mark.parametrize("count", [1, 7])
def test_each_place_is_judged_by_itself(count: int) -> None:
    """However many places are looked at, and with some of them beyond the picture, each has what it has alone."""
    rng = np.random.default_rng(count)
    places = rng.uniform((-10.0, -10.0), (130.0, 110.0), (1, count, 2))
    seen, views = rng.integers(0, 255, (100, 120), np.uint8), separation.project_views(plate(), turned(20.0))
    alone = [separation.correlations(seen, places[:, [i]], views)[0, 0] for i in range(count)]
    assert separation.correlations(seen, places, views)[0].tolist() == alone


def test_beyond_its_reach_the_picture_does_not_matter() -> None:
    """Templates see the part of the picture within reach and nothing else, and no smaller part will do."""
    rng = np.random.default_rng(3)
    seen, views = rng.integers(0, 255, (100, 120), np.uint8), separation.project_views(plate(), turned(30.0, 1.3))
    places = rng.uniform((20.0, 30.0), (50.0, 60.0), (1, 40, 2))
    left, top, right, bottom = separation.reach(places, views, seen.shape)
    other = rng.integers(0, 255, seen.shape, np.uint8)
    other[top:bottom, left:right] = seen[top:bottom, left:right]
    found = separation.correlations(seen, places, views)
    assert np.array_equal(separation.correlations(other, places, views), found)
    for edge in ((slice(None), left), (slice(None), right - 1), (top, slice(None)), (bottom - 1, slice(None))):
        less = seen.copy()
        less[edge] ^= 255
        assert not np.array_equal(separation.correlations(less, places, views), found)
