"""Kalman filters of a chain: what they come to, and what they do with bad observations."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import quaternion, quaternion_matrix
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.linkage.gaussians import box, from_moments, noise
from pftrack.experiments.linkage.linearised import linearisation_points, predict
from pftrack.experiments.linkage.model import UPRIGHT, describe, observe, read_observation, slopes
from pftrack.experiments.linkage.scene import REFERENCE_RAD, LinkageTarget
from pftrack.experiments.linkage.state import LinkageState
from pftrack.filters import kalman
from tests.experiments.linkage.chains import CAREFUL

LINKAGE = find("linkage")
DEFAULTS = LINKAGE.simulate().parameters
THETA, R = np.array([1.0, 0.8, 0.7]), np.array([70.0, 60.0, 50.0])
FILTERS = ("ekf", "ekf-truncated", "ekf-mirrors", "ukf")
OF_BOTH = "with these ranges of both, got"


def plane(theta: NDArray[np.float64], r: NDArray[np.float64] = R) -> LinkageTarget:
    return LinkageTarget(np.zeros(6), theta=theta, r=r, origin_px=np.array([240.0, 120.0]))


def space(theta: NDArray[np.float64], omega: NDArray[np.float64]) -> LinkageTarget:
    turn = quaternion_matrix(quaternion(REFERENCE_RAD))
    return LinkageTarget(np.zeros(11), theta=theta, r=R, omega=omega, t=np.array([4.0, 2.0]), reference=turn)


def seen(index: int, target: LinkageTarget, *off: float) -> Frame:
    """The chain in the plane, measured without noise."""
    points = np.cumsum(target.r * np.cos(np.cumsum(target.theta))) + np.array(off or np.zeros(3)) + target.origin_px[0]
    measured = Measurements(np.column_stack([points, np.full(3, 120.0)]), np.ones((3, 2)))
    return Frame(index, 0.0, measurements=measured)


def seen_in_space(index: int, target: LinkageTarget) -> Frame:
    mean = np.concatenate([target.omega, target.t, target.theta[1:], np.zeros(7), target.r])
    points = observe(mean, quaternion(REFERENCE_RAD)).reshape(4, 2)
    return Frame(index, 0.0, measurements=Measurements(points, np.ones((4, 2))))


def start(tracker: str, target: LinkageTarget, **values: object) -> LinkageState:
    parameters = revise(DEFAULTS, {**CAREFUL, **values})
    return LINKAGE.trackers[tracker].start(target, Frame(0, 0.0), parameters, Stream(0, 0, Purpose.START))


def step(tracker: str, state: LinkageState, frame: Frame, **values: object) -> LinkageState:
    parameters = revise(DEFAULTS, {**CAREFUL, **values})
    return LINKAGE.trackers[tracker].step(state, frame, parameters, Stream(0, frame.index, Purpose.TRACK))


def exact(state: LinkageState, frame: Frame, rows: list[int]) -> Gaussian:
    """One step of the Kalman filter of the chain, linearised where the mean is."""
    chain = state.belief.members[0]
    parameters = revise(DEFAULTS, CAREFUL)
    prior = Gaussian(*predict(chain.mean, chain.covariance, noise(parameters, False)))
    jacobian = slopes(prior.mean, UPRIGHT)[rows]
    values = read_observation(frame, state.origin_px, in_space=False)[rows, 0]
    measured = values - observe(prior.mean, UPRIGHT)[rows] + jacobian @ prior.mean
    return kalman.update(prior, measured, jacobian, np.eye(len(rows)))[0]


@pytest.mark.parametrize("tracker", FILTERS)
def test_on_what_is_almost_linear_all_are_the_kalman_filter(tracker: str) -> None:
    """With small variances, far from bounds and from the parallel, every filter gives the exact posterior."""
    before, frame = start(tracker, plane(THETA)), seen(1, plane(THETA + 0.01), 0.5, -0.5, 1.0)
    after, wanted = step(tracker, before, frame), exact(before, frame, [0, 1, 2])
    chain = after.belief.members[0]
    tolerance = 0.02 * wanted.standard_deviations if tracker == "ukf" else np.full(9, 1e-9)
    assert (np.abs(chain.mean - wanted.mean) <= tolerance).all()
    most = np.maximum(np.outer(tolerance, wanted.standard_deviations), 1e-9)
    assert (np.abs(chain.covariance - wanted.covariance) <= most).all()
    assert after.mean == pytest.approx(np.delete(chain.mean, [3, 4, 5]))
    assert after.spread == pytest.approx(np.sqrt(np.delete(chain.covariance.diagonal(), [3, 4, 5])))
    assert after.directions_sd[1] ** 2 == pytest.approx(chain.covariance[:2, :2].sum())
    assert not after.events.outlier


def test_a_point_that_is_not_seen_is_left_out() -> None:
    """NaN in one point updates by the others; NaN in all leaves the prediction, and no evidence."""
    before, frame = start("ekf", plane(THETA)), seen(1, plane(THETA + 0.01), 0.0, np.nan, 0.0)
    assert step("ekf", before, frame).belief.members[0].mean == pytest.approx(exact(before, frame, [0, 2]).mean)
    for tracker in FILTERS:
        after = step(tracker, before, seen(1, plane(THETA), np.nan, np.inf, np.nan))
        assert after.mean.tolist() == before.mean.tolist()
        assert (after.spread >= before.spread).all()
        assert (after.log_evidence, after.events.outlier) == (0.0, False)


@pytest.mark.parametrize("tracker", [*FILTERS, "particles"])
def test_an_observation_far_outside_is_left_out_and_counted(tracker: str) -> None:
    """A point that is 200 px off changes no filter's belief but by the motion, and is reported."""
    before = step(tracker, start(tracker, plane(THETA), sample_count=100), seen(1, plane(THETA)), sample_count=100)
    after = step(tracker, before, seen(2, plane(THETA), 0.0, 0.0, 200.0), sample_count=100)
    assert after.events.outlier
    assert after.directions == pytest.approx(before.directions, abs=0.05)
    assert LINKAGE.trackers[tracker].measure(after)["outlier"] == 1.0


def test_wrong_frames_are_refused() -> None:
    """A frame without points, or with those of a chain in space, is no frame of a chain in the plane."""
    state, four = start("ekf", plane(THETA)), Measurements(np.zeros((4, 2)), np.ones((4, 2)))
    for measured, count in ((None, "none"), (four, "4")):
        with pytest.raises(ValueError, match=f"needs 3 measured points, got {count}"):
            step("ekf", state, Frame(1, 0.0, measurements=measured))
    with pytest.raises(TypeError, match="begins at the pose of one"):
        start("ekf", object())  # type: ignore[arg-type]


def test_bounds_keep_lengths_within() -> None:
    """The filter with bounds believes less in lengths that are not allowed; the plain one knows none of them."""
    before = start("ekf", plane(THETA, np.array([79.0, 60.0, 50.0])), start_length_variance_px2=100)
    frame = seen(1, plane(THETA, np.array([84.0, 60.0, 50.0])))
    free, bounded = (step(name, before, frame, start_length_variance_px2=100) for name in ("ekf", "ekf-truncated"))
    assert free.mean[3] > 80.0 > bounded.mean[3]
    assert bounded.spread[3] < free.spread[3]
    assert bounded.events.truncated > 0


def test_a_link_almost_parallel_has_two_sides() -> None:
    """A prediction is linearised at itself and at the mirror images of all links that are almost parallel."""
    state = np.concatenate([[1.2, 1.0, 0.8], np.zeros(3), R])  # directions 1.2, 2.2, 3.0
    points = linearisation_points(state, UPRIGHT, 0.35)
    assert len(points) == 2
    assert np.cumsum(points[1, :3]) == pytest.approx([1.2, 2.2, 2.0 * np.pi - 3.0])
    assert observe(points[1], UPRIGHT) == pytest.approx(observe(state, UPRIGHT))
    assert len(linearisation_points(state, UPRIGHT, 1.0)) == 8
    assert len(linearisation_points(state, UPRIGHT, -1.0)) == 1


def test_a_flat_chain_has_two_sides_in_space() -> None:
    """Almost parallel to the image a chain is mirrored as a whole, seen edge-on link by link, and else not at all."""
    flat = np.concatenate([np.zeros(5), [0.1, -0.3], np.zeros(7), R])
    for tilt, count in {0.1: 2, 0.8: 1, 1.5: 4}.items():
        attitude = quaternion(np.array([tilt, 0.0, 0.0]))
        points = linearisation_points(flat, attitude, 0.35)
        assert len(points) == count
        for point in points:
            assert observe(point, attitude) == pytest.approx(observe(flat, attitude), abs=8.0 if count == 4 else 1e-6)


def test_a_beam_tells_where_its_members_come_from() -> None:
    """Parents are places in the frame before; the first frame has none, and a plain filter keeps the best alone."""
    values = {"mirror_tau": 1.0, "rejection_sd": 100.0, "start_angle_variance_rad2": 0.05}
    state = start("ekf-mirrors", plane(THETA), **values)
    assert state.belief.parents.tolist() == [-1]
    for index in (1, 2):
        before, state = state, step("ekf-mirrors", state, seen(index, plane(THETA)), **values)
        assert 0 <= state.belief.parents.min() <= state.belief.parents.max() < len(before.belief)
    assert state.events.splits >= 0
    alone = step("ekf", state, seen(3, plane(THETA)), **values)
    assert alone.belief.parents.tolist() == [state.belief.best]
    reported = LINKAGE.trackers["ekf-mirrors"].measure(state)
    assert len(reported["hypotheses"].values) == reported["hypothesis_count"] == len(state.belief) > 1


@pytest.mark.parametrize("tracker", FILTERS)
def test_a_chain_in_space_is_followed(tracker: str) -> None:
    """Attitude, root, angles and lengths come out on a chain that turns, told of the reference attitude."""
    values = {"start_angle_variance_rad2": 0.01, "start_length_variance_px2": 9.0, "start_rate_variance_rad2": 1e-3}

    def at(frame: int) -> LinkageTarget:
        return space(np.array([0.0, 0.5 + 0.02 * frame, 0.4]), np.array([0.3, -0.1, 0.05]) + 0.02 * frame)

    off = replace(at(0), r=R + 2.0, omega=at(0).omega + 0.04)
    state = start(tracker, off, **values)
    assert state.mean[:3] == pytest.approx(off.omega)
    for frame in range(1, 25):
        state = step(tracker, state, seen_in_space(frame, at(frame)), observation_variance_px2=0.05, **values)
    true = at(24)
    assert state.mean[:5] == pytest.approx(np.concatenate([true.omega, true.t]), abs=0.1)
    assert state.directions == pytest.approx(np.cumsum(true.theta), abs=0.1)
    assert np.abs(state.mean[8:] - R).max() < 4.0
    assert state.spread[8:].max() < 2.0
    assert state.belief.members[0].mean[:3].tolist() == [0.0, 0.0, 0.0]


def test_a_gaussian_is_told_whatever_its_attitude() -> None:
    """A belief that its attitude has taken over is told with the same numbers as before."""
    rng = np.random.default_rng(1)
    root, turn = 0.1 * rng.normal(size=(17, 17)), quaternion(REFERENCE_RAD)
    mean = np.concatenate([[0.3, -0.2, 0.4], rng.normal(size=11), R])
    chain = from_moments(mean, root @ root.T, turn)
    before = describe(mean, root @ root.T, turn, turn)
    for one, other in zip(before, describe(chain.mean, chain.covariance, chain.attitude, turn), strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_box_is_taken_over_as_a_gaussian() -> None:
    """The centre, and a twelfth of the squared width; what does not move has the velocity of the first frame."""
    low, high = np.array([0.9, 0.7, 0.6, 60.0, 50.0, 40.0]), np.array([1.1, 0.9, 0.8, 80.0, 70.0, 40.0])
    chain = box(low, high, None, DEFAULTS)
    assert chain.mean == pytest.approx([1.0, 0.8, 0.7, 0.0, 0.0, 0.0, 70.0, 60.0, 40.0])
    assert np.sqrt(12.0 * chain.covariance.diagonal()[[0, 6, 8]]) == pytest.approx([0.2, 20.0, 1e-3])
    assert chain.covariance[3, 3] == DEFAULTS.start_rate_variance_rad2


def test_all_trackers_take_over_from_all() -> None:
    """Whatever tracker took the frame before, each takes the next, and goes on at the same pose."""
    values = {"sample_count": 50, "start_angle_variance_rad2": 0.001}
    for name in LINKAGE.trackers:
        state = step(name, start(name, plane(THETA), **values), seen(1, plane(THETA)), **values)
        for other in LINKAGE.trackers:
            after = step(other, state, seen(2, plane(THETA)), **values)
            assert after.directions == pytest.approx(np.cumsum(THETA), abs=0.35), (name, other)
            assert after.mean.shape == after.spread.shape == (6,)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"length_1_low_px": 90}, "length_1_low_px must be at most length_1_high_px, 80, got 90"),
        ({"joint_high_deg": -10}, "joint_low_deg must be at most joint_high_deg, -10, got 0"),
        ({"length_2_low_px": 20, "length_2_high_px": 30}, f"length_difference_12_px must be at least 30 {OF_BOTH} 15"),
        (
            {"first_joint_low_deg": 150, "joint_difference_12_deg": 20},
            f"joint_difference_12_deg must be at least 60 {OF_BOTH} 20",
        ),
        (
            {"length_1_low_px": 80, "length_2_low_px": 65, "length_3_high_px": 45, "length_difference_23_px": 15},
            f"length_difference_23_px must be at least 20 {OF_BOTH} 15",
        ),
    ],
)
def test_bounds_that_contradict_each_other_are_refused(changes: dict[str, float], sentence: str) -> None:
    """The sentence names both sides; bounds that only a chain of differences makes impossible are found as well."""
    with pytest.raises(ParameterError, match=sentence):
        revise(DEFAULTS, changes)
