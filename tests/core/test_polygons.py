"""Convex polygons on a grid: what lies inside, counted row by row."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pftrack.core import geometry
from pftrack.core.geometry import convex_hull, distance_to_polygon, distance_to_segment, fill, row_sums

HEIGHT, WIDTH = 40, 60
PLACE = st.tuples(st.floats(-30.0, 90.0), st.floats(-30.0, 70.0))
POINTS = st.lists(PLACE, min_size=3, max_size=12).map(np.array)
SQUARE = np.array([[10.0, 10.0], [20.0, 10.0], [20.0, 20.0], [10.0, 20.0]])


def inside(polygon: np.ndarray, slack: float) -> np.ndarray:
    """Return which pixel centres are on the inner side of every edge, or at most `slack` px beyond."""
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    following = np.roll(polygon, -1, axis=0)
    area = np.sum(polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0])
    mask = np.ones((HEIGHT, WIDTH), bool)
    for first, second in zip(polygon, following, strict=True):
        across, down = second - first
        side = across * (rows - first[1]) - down * (columns - first[0])
        mask &= np.sign(area) * side >= -slack * np.hypot(across, down)
    return mask


@settings(max_examples=50, deadline=None)
@given(POINTS)
def test_a_hull_is_that_of_opencv(points: np.ndarray) -> None:
    """The hull has the same area as OpenCV's, and contains all points."""
    hull = convex_hull(points)
    around = cv2.convexHull(points.astype(np.float32))
    expected = 0.0 if around is None else cv2.contourArea(around)  # it finds none of points that are all the same
    assert abs(cv2.contourArea(hull.astype(np.float32))) == pytest.approx(expected, abs=0.01)
    assert max(distance_to_polygon(point, hull) for point in points) < 1e-6 or len(hull) < 3


@settings(max_examples=50, deadline=None)
@given(POINTS, st.integers(0, 99))
def test_spans_hold_the_pixels_whose_centres_are_inside(points: np.ndarray, seed: int) -> None:
    """A drawn polygon has the pixels on the inner side of every edge, either way on one; row sums count the same."""
    hull = convex_hull(points)
    mask = fill(hull[None], np.array([len(hull)]), HEIGHT, WIDTH)
    drawn = np.random.default_rng(seed).random((HEIGHT, WIDTH)) < 0.4
    assert geometry.sum_within(row_sums(drawn), *geometry.spans(hull, HEIGHT, WIDTH)) == np.count_nonzero(drawn & mask)
    if len(hull) >= 3 and cv2.contourArea(hull.astype(np.float32)) >= 1.0:
        assert (mask >= inside(hull, -1e-6)).all()
        assert (mask <= inside(hull, 1e-6)).all()


def test_several_polygons_are_filled_together() -> None:
    """What is filled is the union, and corners beyond a polygon's count are not looked at."""
    corners = np.full((2, 5, 2), 1e9)
    corners[0, :4], corners[1, :3] = SQUARE, [[15.0, 15.0], [30.0, 15.0], [15.0, 30.0]]
    counts = np.array([4, 3])
    both = fill(corners, counts, HEIGHT, WIDTH)
    each = [fill(corners[i : i + 1], counts[i : i + 1], HEIGHT, WIDTH) for i in range(2)]
    assert (both == (each[0] | each[1])).all()
    assert np.count_nonzero(each[0]) == 11 * 11


def test_distances() -> None:
    """From a segment beside, before and behind it; from a polygon, 0 inside."""
    ends = np.array([0.0, 0.0]), np.array([10.0, 0.0])
    places = [(4.0, 3.0), (-3.0, 4.0), (13.0, 4.0)]
    assert [distance_to_segment(np.array(place), *ends) for place in places] == [3.0, 5.0, 5.0]
    assert distance_to_segment(np.array([3.0, 4.0]), ends[0], ends[0]) == 5.0
    for polygon in (SQUARE, SQUARE[::-1].copy()):
        places = [(12.0, 13.0), (23.0, 24.0), (15.0, 4.0)]
        assert [distance_to_polygon(np.array(place), polygon) for place in places] == [0.0, 5.0, 6.0]
