"""The simulated chain: its paths, what is measured of it, and where the estimate begins."""

from typing import get_args

import numpy as np
import pytest

from pftrack.core.model.source import Frame, History, Measurements
from pftrack.experiments.linkage.scene import (
    LENGTH,
    PATHS,
    LinkageSceneParameters,
    LinkageSource,
    LinkageTarget,
    PathName,
    ease,
    in_radians,
    places,
)


def seen(seed: int, index: int, **values: object) -> tuple[Frame, LinkageTarget, Measurements]:
    """Return a frame of a scene, its truth and its measurements."""
    parameters = LinkageSceneParameters.model_validate(values)
    frame = LinkageSource(seed, parameters).frame(index, History(((0, parameters),)))
    assert isinstance(frame.target, LinkageTarget)
    assert frame.measurements is not None
    return frame, frame.target, frame.measurements


@pytest.mark.parametrize("name", PATHS)
def test_paths_go_through_their_keys_and_have_no_leaps(name: PathName) -> None:
    """At each key the angles are the key's, and between them they change smoothly."""
    for frame, *angles in PATHS[name]:
        np.testing.assert_allclose(ease(PATHS[name], frame), angles, atol=1e-12)
    steps = np.diff([ease(PATHS[name], frame) for frame in range(LENGTH[name])], axis=0)
    assert np.abs(steps).max() < 0.08
    np.testing.assert_array_equal(ease(PATHS[name], 1e4), PATHS[name][-1][1:])


@pytest.mark.parametrize("path", get_args(PathName))
def test_noise_is_bounded_and_the_same_again(path: PathName) -> None:
    """No coordinate is off by more than three standard deviations, and the same arguments give the same frame."""
    for seed in range(3):
        frame, target, measured = seen(seed, 7, chain_path=path, measurement_noise_px=2)
        assert target.landmarks is not None
        first = 4 - len(measured.points_px)
        off = measured.points_px - target.landmarks.points_px[first:]
        assert 0.0 < np.abs(off).max() <= 6.0
        again, _, same = seen(seed, 7, chain_path=path, measurement_noise_px=2)
        np.testing.assert_array_equal(measured.points_px, same.points_px)
        np.testing.assert_array_equal(frame.image_rgb, again.image_rgb)


def test_a_chain_in_the_plane_is_measured_across_alone() -> None:
    """Image coordinates are sums of r cos theta*; the row says nothing."""
    _, target, measured = seen(0, 30, chain_path="mirror3", measurement_noise_px=0)
    along = np.cumsum(target.r * np.cos(np.cumsum(target.theta)))
    np.testing.assert_allclose(measured.points_px[:, 0] - target.origin_px[0], along, atol=1e-9)
    assert np.isinf(measured.sd_px[:, 1]).all()
    np.testing.assert_array_equal(target.position, np.append(np.rad2deg(target.theta), target.r))


def test_a_chain_in_space_keeps_its_lengths() -> None:
    """Points lie the links' lengths apart, and the camera sees their first two coordinates."""
    _, target, measured = seen(0, 120, chain_path="3d", measurement_noise_px=0)
    at = places(target)
    np.testing.assert_allclose(np.linalg.norm(np.diff(at, axis=0), axis=1), target.r)
    np.testing.assert_allclose(measured.points_px, at[:, :2] + target.origin_px)
    assert target.is_spatial
    assert target.reference is not None
    np.testing.assert_allclose(target.reference.T @ target.reference, np.eye(3), atol=1e-12)
    assert target.position.shape == (11,)
    assert target.theta[0] == 0.0


def test_what_is_behind_the_occluder_is_not_measured() -> None:
    """Its measurement is NaN, and its standard deviation infinite; with all of it hidden the chain is."""
    _, target, measured = seen(0, 0, chain_path="two", occlusion_width_px=60, occlusion_offset_px=60)
    assert target.landmarks is not None
    gone = ~target.landmarks.visible[1:]
    assert gone.tolist() == [True, False, False]
    assert np.isnan(measured.points_px[gone]).all()
    assert np.isinf(measured.sd_px[gone]).all()
    assert np.isfinite(measured.points_px[~gone]).all()
    assert not target.hidden
    assert seen(0, 0, chain_path="two", occlusion_width_px=640)[1].hidden


def test_outliers_are_as_far_off_and_as_frequent_as_they_are_said_to_be() -> None:
    """With a share of a half about half of all points are off, by 40 px and the noise at most."""
    off = []
    for index in range(200):
        _, target, measured = seen(1, index, chain_path="static", outlier_share=0.5, outlier_px=40)
        assert target.landmarks is not None
        off += (measured.points_px - target.landmarks.points_px[1:])[:, 0].tolist()
    assert np.abs(off).max() < 43.0
    assert 0.4 < np.mean(np.abs(off) > 3.0) < 0.5


def test_the_estimate_begins_off_the_truth() -> None:
    """Angles are off by at most what is said, differently by seed; lengths by what is said exactly."""
    values = {"chain_path": "cross", "start_angle_rad": 0.2, "start_length_1_px": 5, "start_length_3_px": -9}
    parameters = LinkageSceneParameters.model_validate(values)
    angles = []
    for seed in range(20):
        source = LinkageSource(seed, parameters)
        assert isinstance(source.start, LinkageTarget)
        np.testing.assert_allclose(source.start.r - source.target(0).r, [5.0, 0.0, -9.0])
        angles.append(source.start.theta - source.target(0).theta)
    assert 0.15 < np.abs(angles).max() <= 0.2
    space = LinkageSource(3, LinkageSceneParameters.model_validate({"chain_path": "3d", "start_angle_rad": 0.08}))
    assert isinstance(space.start, LinkageTarget)
    assert space.start.theta[0] == 0.0
    assert space.start.omega is not None
    off = in_radians(space.start.position - space.target(0).position)
    assert 0.0 < np.abs(off).max() <= 0.08
