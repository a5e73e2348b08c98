"""The simulated chain: its shape and its paths, what is measured of it, and where the estimate begins."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import matrix
from pftrack.core.model.source import History, Measurements
from pftrack.experiments.linkage import model, scene


def seen(seed: int, index: int, **values: object) -> tuple[scene.LinkageTarget, Measurements]:
    """Return the truth of a frame of a scene and its measurements."""
    parameters = scene.LinkageSceneParameters.model_validate(values)
    frame = scene.LinkageSource(seed, parameters).frame(index, History(((0, parameters),)))
    return frame.target, frame.measurements


@pytest.mark.parametrize("name", scene.PATHS)
def test_paths_go_through_their_keys_and_have_no_leaps(name: scene.PathName) -> None:
    """At each key the angles are the key's, and between them they change smoothly."""
    for frame, *angles in scene.PATHS[name]:
        np.testing.assert_allclose(scene.ease(scene.PATHS[name], frame), angles, atol=1e-12)
    steps = np.diff([scene.ease(scene.PATHS[name], frame) for frame in range(scene.LENGTH[name])], axis=0)
    assert np.abs(steps).max() < 0.08
    np.testing.assert_array_equal(scene.ease(scene.PATHS[name], 1e4), scene.PATHS[name][-1][1:])


@pytest.mark.parametrize("path", get_args(scene.PathName))
def test_noise_is_bounded(path: scene.PathName) -> None:
    """No coordinate is off by more than three standard deviations."""
    for seed in range(3):
        target, measured = seen(seed, 7, chain_path=path, measurement_noise_px=2)
        off = measured.points_px - target.landmarks.points_px[4 - len(measured.points_px) :]
        assert 0.0 < np.abs(off).max() <= 6.0


def test_points_are_the_projected_links() -> None:
    """In the plane, columns are sums of r cos theta*, rows say nothing, and there are no lines.

    In space, points are the links' lengths apart, and the camera sees their first two coordinates.
    """
    target, measured = seen(0, 30, chain_path="mirror3", measurement_noise_px=0, links_seen_as="lines")
    along = np.cumsum(target.r * np.cos(np.cumsum(target.theta)))
    np.testing.assert_allclose(measured.points_px[:, 0] - target.origin_px[0], along, atol=1e-9)
    assert np.isinf(measured.sd_px[:, 1]).all()
    np.testing.assert_array_equal(target.position, np.append(np.rad2deg(target.theta), target.r))
    assert not isinstance(measured, scene.LinkMeasurements)
    target, measured = seen(0, 120, chain_path="3d", measurement_noise_px=0)
    at = scene.places(target)
    np.testing.assert_allclose(np.linalg.norm(np.diff(at, axis=0), axis=1), target.r)
    np.testing.assert_allclose(measured.points_px, at[:, :2] + target.origin_px)
    np.testing.assert_allclose(target.reference.T @ target.reference, np.eye(3), atol=1e-12)
    assert (target.position.shape, target.theta[0]) == ((11,), 0.0)


def test_what_is_behind_the_occluder_is_not_measured() -> None:
    """Its measurement is NaN, and its standard deviation infinite; with all of it hidden the chain is."""
    target, measured = seen(0, 0, chain_path="two", occlusion_width_px=60, occlusion_offset_px=60)
    gone = ~target.landmarks.visible[1:]
    assert gone.tolist() == [True, False, False]
    assert np.array_equal(np.isnan(measured.points_px).any(axis=1), gone)
    assert np.isinf(measured.sd_px[gone]).all()
    assert not target.hidden
    assert seen(0, 0, chain_path="two", occlusion_width_px=640)[0].hidden


def test_outliers_are_as_far_off_and_as_frequent_as_they_are_said_to_be() -> None:
    """With a share of a half about half of all points are off, by 40 px and the noise at most."""
    shown = [seen(1, index, chain_path="static", outlier_share=0.5, outlier_px=40) for index in range(200)]
    off = np.abs([(measured.points_px - target.landmarks.points_px[1:])[:, 0] for target, measured in shown])
    assert off.max() < 43.0
    assert 0.4 < np.mean(off > 3.0) < 0.5


def test_the_estimate_begins_off_the_truth() -> None:
    """Angles are off by at most what is said, differently by seed; lengths by what is said exactly."""
    off = {"start_angle_rad": 0.2, "start_length_1_px": 5, "start_length_3_px": -9}
    crossing = scene.LinkageSceneParameters(chain_path="cross", **off)
    sources = [scene.LinkageSource(seed, crossing) for seed in range(20)]
    for source in sources:
        np.testing.assert_allclose(source.start.r - source.target(0).r, [5.0, 0.0, -9.0])
    assert 0.15 < np.abs([source.start.theta - source.target(0).theta for source in sources]).max() <= 0.2
    space = scene.LinkageSource(3, scene.LinkageSceneParameters(chain_path="3d", start_angle_rad=0.08))
    assert space.start.theta[0] == 0.0
    assert 0.0 < np.abs(scene.in_radians(space.start.position - space.target(0).position)).max() <= 0.08


# Links of a chain in space that are seen as lines.

ALL = np.ones(4, dtype=np.bool_)


def measured(**values: object) -> tuple[scene.LinkMeasurements, np.ndarray]:
    """What is measured of the chain in space in frame 0, and its true points."""
    target, found = seen(3, 0, **{"chain_path": "3d", "links_seen_as": "lines", **values})
    assert isinstance(found, scene.LinkMeasurements)
    return found, target.landmarks.points_px


def test_a_line_goes_through_where_the_ends_seem_to_be() -> None:
    """Its normal is a unit vector, and no true end is farther from it than it errs, however short the link looks."""
    rng = np.random.default_rng(0)
    for length in (1.5, 4.0, 300.0):
        points = np.cumsum(np.vstack([rng.uniform(0, 300, 2), rng.normal(size=(3, 2)) * length]), axis=0)
        errors = rng.uniform(-3, 3, (3, 2))
        normals, offsets = scene.observe_lines(points, errors, ALL)
        for link in np.flatnonzero(np.isfinite(offsets)):
            distances = points[link : link + 2] @ normals[link] - offsets[link]
            assert np.hypot(*normals[link]) == pytest.approx(1.0)
            assert np.all(np.abs(distances) <= np.abs(errors[link]) + 1e-9)


def test_a_line_without_errors_is_that_of_the_link() -> None:
    """Both ends are on it, or within three deviations; points are not measured, or root and tip alone."""
    lines, points = measured(measurement_noise_px=0)
    for link in range(3):
        assert points[link : link + 2] @ lines.normals[link] == pytest.approx(lines.offsets_px[link])
    assert np.isnan(lines.points_px).all()
    noisy, _ = measured(measurement_noise_px=2)
    off = [points[k : k + 2] @ noisy.normals[k] - noisy.offsets_px[k] for k in range(3)]
    assert 0.0 < np.abs(off).max() <= 6.0
    ends, points = measured(measurement_noise_px=0, links_seen_as="lines-and-ends")
    assert np.isfinite(ends.points_px).all(axis=1).tolist() == [True, False, False, True]
    assert ends.points_px[[0, 3]] == pytest.approx(points[[0, 3]])


def test_a_link_shows_no_line_behind_the_occluder_or_on_end() -> None:
    """One with an end in sight still does."""
    points = np.array([[10.0, 10.0], [60.0, 20.0], [60.5, 20.0], [100.0, 60.0]])
    visible = np.array([False, True, True, False])
    assert np.isnan(scene.observe_lines(points, np.zeros((3, 2)), visible)[1]).tolist() == [False, True, False]
    assert np.isnan(scene.observe_lines(points, np.zeros((3, 2)), np.array([False, False, True, True]))[1][0])
    lines, _ = measured(occlusion_width_px=640)
    assert np.isnan(lines.offsets_px).all()


def test_a_slower_chain_takes_the_same_path() -> None:
    """Four times as slow, every fourth frame has the pose of one, and the run is as much longer."""
    for path in ("two", "3d"):
        scenes = (scene.LinkageSceneParameters(chain_path=path, path_slowing=by) for by in (1, 4))
        usual, slow = (scene.LinkageSource(0, each) for each in scenes)
        assert slow.frame_count == 4 * (scene.LENGTH[path] - 1) + 1
        for index in (0, 17, scene.LENGTH[path] - 1):
            assert np.array_equal(slow.target(4 * index).position, usual.target(index).position)


# Chains of links before an orthographic camera.

THETA, R = np.array([0.4, 0.7, -0.3]), np.array([70.0, 60.0, 50.0])
ANGLE = st.floats(-3.0, 3.0)


def test_the_image_is_the_sum_of_projected_links() -> None:
    """A chain stretched along the image is as long as its links; at right angles to it nothing of it is seen."""
    assert model.image_in_plane(np.zeros(3), R).tolist() == [70.0, 130.0, 180.0]
    assert model.image_in_plane(np.array([np.pi / 2, 0.0, 0.0]), R) == pytest.approx(np.zeros(3), abs=1e-12)
    assert model.joint_angles(model.directions(THETA)) == pytest.approx(THETA)


def test_space_holds_the_plane() -> None:
    """A chain that is turned about the image's axis by a right angle is seen as one in the plane."""
    turn = matrix(np.array([np.pi / 2, 0.0, 0.0]))
    seen = model.image_in_space(turn, np.array([3.0, -5.0]), THETA, R)
    assert seen[0].tolist() == [3.0, -5.0]
    assert seen[1:, 0] == pytest.approx(3.0 + model.image_in_plane(THETA, R))
    assert seen[:, 1] == pytest.approx(-5.0)


def test_derivatives_are_those_of_differences() -> None:
    """What a filter of a chain in the plane linearises with agrees with central differences."""
    state, step = np.append(np.random.default_rng(9).normal(size=6), R), 1e-5
    ends = [[model.observe(state + way * axis, model.UPRIGHT) for axis in np.eye(9)] for way in (step, -step)]
    differences = (np.array(ends[0]) - ends[1]).T / (2 * step)
    assert model.slopes(state, model.UPRIGHT) == pytest.approx(differences, abs=1e-6)


@given(st.tuples(ANGLE, ANGLE, ANGLE), st.integers(0, 2))
def test_a_mirrored_link_looks_the_same(theta: tuple[float, float, float], link: int) -> None:
    """Mirrored in depth a link leans to the other side, the others keep their directions, and the image is the same."""
    before = model.directions(np.array(theta))
    after = model.mirror(before, link)
    assert np.delete(after, link).tolist() == np.delete(before, link).tolist()
    assert np.sin(after[link]) == pytest.approx(-np.sin(before[link]), abs=1e-12)
    assert abs(after[link] - before[link]) <= np.pi + 1e-9
    images = [model.image_in_plane(each, R) for each in (model.joint_angles(after), np.array(theta))]
    assert images[0] == pytest.approx(images[1], abs=1e-9)


def test_bounds_are_inequalities() -> None:
    """Each range and each difference is a row, what is not bounded is left out, and in space so is the first joint."""
    free = (-np.inf, 0.0, 0.0)
    bounds = model.Bounds(free, (np.inf, 1.5, 1.5), (np.inf, 0.5), (60.0, 50.0, 40.0), (80.0, 70.0, 60.0), (15.0, 15.0))
    rows, low, high = bounds.constraints(in_space=False)
    assert rows.shape == (8, 6)
    assert rows[5].tolist() == [0, 1, -1, 0, 0, 0]
    assert (low[5], high[5]) == (-0.5, 0.5)
    assert not rows[:, 0].any()
    lengths = bounds.length_low, bounds.length_high
    tight = model.Bounds((0.0, 0.0, 0.0), (2.0, 1.5, 1.5), (0.8, 0.5), *lengths, (40.0, 10.0))
    assert len(tight.constraints(in_space=False).rows) == 10
    assert len(tight.constraints(in_space=True).rows) == 8
