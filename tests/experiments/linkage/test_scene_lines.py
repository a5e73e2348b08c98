"""Links of a chain in space that are seen as lines."""

import numpy as np
import pytest

from pftrack.core.model.source import History
from pftrack.experiments.linkage.scene import (
    LENGTH,
    LinkageSceneParameters,
    LinkageSource,
    LinkMeasurements,
    observe_lines,
)

ALL = np.ones(4, dtype=np.bool_)


def measured(index: int = 0, **values: object) -> tuple[LinkMeasurements, np.ndarray]:
    """What is measured of the chain in space in a frame, and its true points."""
    parameters = LinkageSceneParameters.model_validate({"chain_path": "3d", "links_seen_as": "lines", **values})
    frame = LinkageSource(3, parameters).frame(index, History(((0, parameters),)))
    assert isinstance(frame.measurements, LinkMeasurements)
    assert frame.target is not None
    assert frame.target.landmarks is not None
    return frame.measurements, frame.target.landmarks.points_px


def test_a_line_goes_through_where_the_ends_seem_to_be() -> None:
    """Its normal is a unit vector, and no true end is farther from it than it errs, however short the link looks."""
    rng = np.random.default_rng(0)
    for length in (1.5, 4.0, 300.0):
        points = np.cumsum(np.vstack([rng.uniform(0, 300, 2), rng.normal(size=(3, 2)) * length]), axis=0)
        errors = rng.uniform(-3, 3, (3, 2))
        normals, offsets = observe_lines(points, errors, ALL)
        for link in np.flatnonzero(np.isfinite(offsets)):
            distances = points[link : link + 2] @ normals[link] - offsets[link]
            assert np.hypot(*normals[link]) == pytest.approx(1.0)
            assert np.all(np.abs(distances) <= np.abs(errors[link]) + 1e-9)


def test_a_line_without_errors_is_that_of_the_link() -> None:
    """Both ends are on it; the points themselves are not measured, or root and tip alone."""
    lines, points = measured(measurement_noise_px=0)
    for link in range(3):
        assert points[link : link + 2] @ lines.normals[link] == pytest.approx(lines.offsets_px[link])
    assert np.isnan(lines.points_px).all()
    ends, points = measured(measurement_noise_px=0, links_seen_as="lines-and-ends")
    assert np.isfinite(ends.points_px).all(axis=1).tolist() == [True, False, False, True]
    assert ends.points_px[[0, 3]] == pytest.approx(points[[0, 3]])


def test_a_link_shows_no_line_behind_the_occluder_or_on_end() -> None:
    """One with an end in sight still does."""
    points = np.array([[10.0, 10.0], [60.0, 20.0], [60.5, 20.0], [100.0, 60.0]])
    visible = np.array([False, True, True, False])
    assert np.isnan(observe_lines(points, np.zeros((3, 2)), visible)[1]).tolist() == [False, True, False]
    assert np.isnan(observe_lines(points, np.zeros((3, 2)), np.array([False, False, True, True]))[1][0])
    lines, _ = measured(occlusion_width_px=640)
    assert np.isnan(lines.offsets_px).all()


def test_errors_of_lines_are_bounded_and_outliers_are_not() -> None:
    """With a seed the same lines come again; outliers are as far off as they are said to be."""
    for index in range(12):
        lines, points = measured(index, measurement_noise_px=2)
        off = [points[k : k + 2] @ lines.normals[k] - lines.offsets_px[k] for k in range(3)]
        assert 0.0 < np.abs(off).max() <= 6.0
        again, _ = measured(index, measurement_noise_px=2)
        assert np.array_equal(again.normals, lines.normals)
    far = [measured(index, outlier_share=0.5, outlier_px=200) for index in range(12)]
    worst = [np.abs(points[:2] @ lines.normals[0] - lines.offsets_px[0]).max() for lines, points in far]
    assert 20.0 < max(worst) <= 203.0


def test_a_slower_chain_takes_the_same_path() -> None:
    """Four times as slow, every fourth frame has the pose of one, and the run is as much longer."""
    for path in ("two", "3d"):
        usual, slow = (LinkageSource(0, LinkageSceneParameters(chain_path=path, path_slowing=by)) for by in (1, 4))
        assert slow.frame_count == 4 * (LENGTH[path] - 1) + 1
        for index in (0, 17, LENGTH[path] - 1):
            assert np.array_equal(slow.target(4 * index).position, usual.target(index).position)
    between = slow.target(2).position - slow.target(1).position
    assert 0.0 < np.abs(between).max() < np.abs(usual.target(1).position - usual.target(0).position).max()


def test_a_chain_in_the_plane_is_measured_by_points() -> None:
    """An image of one coordinate has no lines."""
    parameters = LinkageSceneParameters(links_seen_as="lines")
    frame = LinkageSource(0, parameters).frame(1, History(((0, parameters),)))
    assert frame.measurements is not None
    assert not isinstance(frame.measurements, LinkMeasurements)
    assert np.isfinite(frame.measurements.points_px).all()
