"""Filters of a chain, by points and by lines, beside what is exact or drawn in large numbers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import quaternion
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, History, Measurements
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.linkage import model
from pftrack.experiments.linkage import particles as filtering
from pftrack.experiments.linkage.gaussians import box, from_moments, noise
from pftrack.experiments.linkage.linearised import linearisation_points, predict
from pftrack.experiments.linkage.model import UPRIGHT, observe, observed_rows, project, project_slopes, slopes
from pftrack.experiments.linkage.scene import REFERENCE_RAD, LinkageSource, LinkageTarget
from pftrack.experiments.linkage.sets.space import link_images, places_of
from pftrack.experiments.linkage.state import LinkageState
from pftrack.filters import kalman
from pftrack.runs.run import Run
from tests.making import whole_run

LINKAGE = find("linkage")
DEFAULTS = LINKAGE.simulate().parameters
Numbers = NDArray[np.float64]
THETA, R = np.array([1.0, 0.8, 0.7]), np.array([70.0, 60.0, 50.0])
ORIGIN = np.array([240.0, 120.0])
FILTERS = ("ekf", "ekf-truncated", "ekf-mirrors", "ukf")
START = "start_angle_variance_rad2", "start_rate_variance_rad2", "start_length_variance_px2", "observation_variance_px2"


def variances(*values: float) -> dict[str, float]:
    return dict(zip(START, values, strict=True))


LOOSE = {"length_difference_12_px": 100, "length_difference_23_px": 100, "noise_unknown": False}
NARROW = {**LOOSE, **variances(1e-4, 1e-6, 1.0, 1.0)}
"""Parameters by which a chain is almost linear."""
WIDE = {**variances(0.02, 1e-6, 60.0, 9.0), "acceleration_rad": 1e-3, "noise_unknown": False}
FREE = {
    **LOOSE,
    **variances(0.04, 1e-3, 400.0, 1.0),
    "acceleration_rad": 0.02,
    "joint_low_deg": -360,
    "joint_high_deg": 360,
    "joint_difference_23_deg": 360,
}
"""Parameters of a chain whose first link alone is seen, and whose joints have no bounds."""


def image(theta: Numbers = THETA, r: Numbers = R) -> Numbers:
    return np.cumsum(r * np.cos(np.cumsum(theta, axis=-1)), axis=-1)


def start(tracker: str, theta: Numbers = THETA, r: Numbers = R, **values: object) -> LinkageState:
    target = LinkageTarget(np.zeros(6), theta=theta, r=r, origin_px=ORIGIN)
    parameters = revise(DEFAULTS, values)
    return LINKAGE.trackers[tracker].start(target, Frame(0, 0.0), parameters, Stream(0, 0, Purpose.START))


def step(tracker: str, state: LinkageState, seen: Numbers, frame: int = 1, **values: object) -> LinkageState:
    measured = Measurements(np.column_stack([seen, np.zeros(3)]) + ORIGIN, np.ones((3, 2)))
    parameters, rng = revise(DEFAULTS, values), Stream(4, frame, Purpose.TRACK)
    return LINKAGE.trackers[tracker].step(state, Frame(frame, 0.0, measurements=measured), parameters, rng)


def exact(state: LinkageState, seen: Numbers, rows: list[int]) -> Gaussian:
    """Return a step of the Kalman filter of the chain, linearised where the mean is."""
    chain = state.belief.members[0]
    prior = Gaussian(*predict(chain.mean, chain.covariance, noise(revise(DEFAULTS, NARROW), False)))
    jacobian = slopes(prior.mean, UPRIGHT)[rows]
    measured = seen[rows] - observe(prior.mean, UPRIGHT)[rows] + jacobian @ prior.mean
    return kalman.update(prior, measured, jacobian, np.eye(len(rows)))[0]


SEEN = image(THETA + 0.01) + np.array([0.5, -0.5, 1.0])


@pytest.mark.parametrize("tracker", FILTERS)
def test_on_what_is_almost_linear_all_are_the_kalman_filter(tracker: str) -> None:
    """With small variances, far from bounds and from the parallel, every filter gives the exact posterior."""
    before = start(tracker, **NARROW)
    after, wanted = step(tracker, before, SEEN, **NARROW), exact(before, SEEN, [0, 1, 2])
    chain = after.belief.members[0]
    tolerance = 0.02 * wanted.standard_deviations if tracker == "ukf" else np.full(9, 1e-9)
    assert (np.abs(chain.mean - wanted.mean) <= tolerance).all()
    most = np.maximum(np.outer(tolerance, wanted.standard_deviations), 1e-9)
    assert (np.abs(chain.covariance - wanted.covariance) <= most).all()
    assert after.mean == pytest.approx(np.delete(chain.mean, [3, 4, 5]))
    assert after.spread == pytest.approx(np.sqrt(np.delete(chain.covariance.diagonal(), [3, 4, 5])))
    assert after.directions_sd[1] ** 2 == pytest.approx(chain.covariance[:2, :2].sum())
    assert not after.events.outlier


def test_on_what_is_almost_linear_particles_are_the_kalman_filter() -> None:
    """Mean, covariance and evidence are the extended filter's, which is exact there, and hardly a weight differs."""
    wanted = step("ekf", start("ekf", **NARROW), SEEN, **NARROW)
    gaussian = wanted.belief.members[0]
    found = step("particles", start("particles", **NARROW), SEEN, sample_count=2000, **NARROW)
    mean, covariance = found.belief.moments
    deviations = np.sqrt(gaussian.covariance.diagonal())
    assert (np.abs(mean - gaussian.mean) < 0.1 * deviations).all()
    assert np.sqrt(covariance.diagonal()) == pytest.approx(deviations, rel=0.06)
    assert found.belief.effective_sample_size > 1500
    assert found.log_evidence == pytest.approx(wanted.log_evidence + 1.5 * np.log(2.0 * np.pi), abs=0.02)


def test_a_point_that_is_not_seen_is_left_out() -> None:
    """NaN in one point updates by the others; NaN in all leaves the motion alone, and no evidence."""
    before, seen = start("ekf", **NARROW), image(THETA + 0.01) + np.array([0.0, np.nan, 0.0])
    assert step("ekf", before, seen, **NARROW).belief.members[0].mean == pytest.approx(exact(before, seen, [0, 2]).mean)
    for tracker in FILTERS:
        after = step(tracker, before, np.array([np.nan, np.inf, np.nan]), **NARROW)
        assert after.mean.tolist() == before.mean.tolist()
        assert (after.spread >= before.spread).all()
        assert (after.log_evidence, after.events.outlier) == (0.0, False)
    values = {**NARROW, "sample_count": 1000}
    particles = step("particles", start("particles", **values), image(), **values)
    after = step("particles", particles, np.full(3, np.nan), 2, **values)
    assert after.mean == pytest.approx(particles.mean, abs=0.2)
    _, wanted = predict(*particles.belief.moments, noise(revise(DEFAULTS, NARROW), False))
    assert np.sqrt(after.belief.covariance.diagonal()) == pytest.approx(np.sqrt(wanted.diagonal()), rel=0.1)
    assert (after.events.outlier, after.log_evidence) == (False, pytest.approx(0.0, abs=1e-9))


@pytest.mark.parametrize("tracker", [*FILTERS, "particles"])
def test_an_observation_far_outside_is_left_out_and_counted(tracker: str) -> None:
    """A point that is 200 px off changes no filter's belief but by the motion, and is reported."""
    values = {**NARROW, "sample_count": 100}
    before = step(tracker, start(tracker, **values), image(), **values)
    after = step(tracker, before, image() + np.array([0.0, 0.0, 200.0]), 2, **values)
    assert after.directions == pytest.approx(before.directions, abs=0.05)
    assert LINKAGE.trackers[tracker].measure(after)["outlier"] == after.events.outlier == 1.0


def test_bounds_keep_lengths_within() -> None:
    """The filter with bounds believes less in lengths that are not allowed; the plain one knows none of them."""
    values = {**NARROW, "start_length_variance_px2": 100}
    before = start("ekf", r=np.array([79.0, 60.0, 50.0]), **values)
    seen = image(r=np.array([84.0, 60.0, 50.0]))
    free, bounded = (step(name, before, seen, **values) for name in ("ekf", "ekf-truncated"))
    assert free.mean[3] > 80.0 > bounded.mean[3]
    assert bounded.spread[3] < free.spread[3]
    assert bounded.events.truncated > 0


def test_a_link_almost_parallel_has_two_sides() -> None:
    """Links in the plane are mirrored one by one; in space a flat chain is mirrored whole, one edge-on link by link."""
    state = np.concatenate([[1.2, 1.0, 0.8], np.zeros(3), R])  # directions 1.2, 2.2, 3.0
    points = linearisation_points(state, UPRIGHT, 0.35)
    assert np.cumsum(points[1, :3]) == pytest.approx([1.2, 2.2, 2.0 * np.pi - 3.0])
    assert observe(points[1], UPRIGHT) == pytest.approx(observe(state, UPRIGHT))
    assert [len(linearisation_points(state, UPRIGHT, tau)) for tau in (-1.0, 0.35, 1.0)] == [1, 2, 8]
    flat = np.concatenate([np.zeros(5), [0.1, -0.3], np.zeros(7), R])
    for tilt, count in {0.1: 2, 0.8: 1, 1.5: 4}.items():
        attitude = quaternion(np.array([tilt, 0.0, 0.0]))
        points = linearisation_points(flat, attitude, 0.35)
        assert len(points) == count
        for point in points:
            assert observe(point, attitude) == pytest.approx(observe(flat, attitude), abs=8.0 if count == 4 else 1e-6)


def test_a_gaussian_is_described_alike_whatever_its_attitude() -> None:
    """A belief that its attitude has taken over has the same numbers as before."""
    rng = np.random.default_rng(1)
    root, turn = 0.1 * rng.normal(size=(17, 17)), quaternion(REFERENCE_RAD)
    mean = np.concatenate([[0.3, -0.2, 0.4], rng.normal(size=11), R])
    chain = from_moments(mean, root @ root.T, turn)
    before = model.describe(mean, root @ root.T, turn, turn)
    for one, other in zip(before, model.describe(chain.mean, chain.covariance, chain.attitude, turn), strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_a_box_is_taken_over_as_a_gaussian() -> None:
    """The centre, and a twelfth of the squared width; what does not move has the velocity of the first frame."""
    low, high = np.array([0.9, 0.7, 0.6, 60.0, 50.0, 40.0]), np.array([1.1, 0.9, 0.8, 80.0, 70.0, 40.0])
    chain = box(low, high, None, DEFAULTS)
    assert chain.mean == pytest.approx([1.0, 0.8, 0.7, 0.0, 0.0, 0.0, 70.0, 60.0, 40.0])
    assert np.sqrt(12.0 * chain.covariance.diagonal()[[0, 6, 8]]) == pytest.approx([0.2, 20.0, 1e-3])
    assert chain.covariance[3, 3] == DEFAULTS.start_rate_variance_rad2


def test_all_trackers_take_over_from_all() -> None:
    """Whatever tracker took the frame before, each takes the next, and continues at the same pose."""
    values = {**NARROW, "sample_count": 50, "start_angle_variance_rad2": 0.001}
    for name in LINKAGE.trackers:
        state = step(name, start(name, **values), image(), **values)
        for other in LINKAGE.trackers:
            after = step(other, state, image(), 2, **values)
            assert after.directions == pytest.approx(np.cumsum(THETA), abs=0.35), (name, other)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"length_1_low_px": 90}, "length_1_low_px must be at most length_1_high_px, 80, got 90"),
        (
            {"length_2_low_px": 20, "length_2_high_px": 30},
            "length_difference_12_px must be at least 30 with these ranges of both, got 15",
        ),
        ({"first_joint_low_deg": 150, "joint_difference_12_deg": 20}, "joint_difference_12_deg must .* 60 .*, got 20"),
        (
            {"length_1_low_px": 80, "length_2_low_px": 65, "length_3_high_px": 45, "length_difference_23_px": 15},
            "length_difference_23_px must be at least 20 with these ranges of both, got 15",
        ),
    ],
)
def test_bounds_that_contradict_each_other_are_refused(changes: dict[str, float], sentence: str) -> None:
    """The sentence names both sides; bounds that only a chain of differences makes impossible are found as well."""
    with pytest.raises(ParameterError, match=sentence):
        revise(DEFAULTS, changes)


# What is not linear.


def test_what_is_not_linear_is_drawn_rightly() -> None:
    """Under bounds and a wide prior the moments are those of many draws of the prior, weighed by hand.

    No particle's length leaves its bounds. The unscented filter, whose posterior is cut instead, comes near; half a
    deviation is what cutting costs.
    """
    seen = image(THETA + 0.1, R - 2.0)
    sd = np.sqrt([WIDE["start_angle_variance_rad2"] + 1e-6, WIDE["start_length_variance_px2"]]).repeat(3)
    draws = np.append(THETA, R) + sd * np.random.default_rng(0).normal(size=(200_000, 6))
    rows, low, high = revise(DEFAULTS, WIDE).bounds.constraints(in_space=False)
    along = draws @ rows.T
    off = seen - image(draws[:, :3], draws[:, 3:])
    weights = ((along >= low) & (along <= high)).all(axis=1).astype(float)
    weights *= np.exp(-0.5 * np.square(off).sum(axis=1) / WIDE["observation_variance_px2"])
    weights /= weights.sum()
    mean = weights @ draws
    deviations = np.sqrt(weights @ np.square(draws - mean))
    found, near = (step(name, start(name, **WIDE), seen, sample_count=4000, **WIDE) for name in ("particles", "ukf"))
    assert (np.abs(found.mean - mean) < 0.2 * deviations).all()
    assert found.spread == pytest.approx(deviations, rel=0.1)
    assert (np.abs(near.mean - mean) < 0.5 * deviations).all()
    lengths = found.belief.values[:, :3]
    assert ((lengths >= [60.0, 50.0, 40.0]) & (lengths <= [80.0, 70.0, 60.0])).all()
    assert (np.abs(np.diff(lengths, axis=1)) <= 15.0).all()


PATHS = {"through the parallel": np.linspace(0.4, -0.3, 13), "to and fro": 0.6 + 0.5 * np.sin(np.arange(25) / 4.0)}
"""Directions of the first link, rad."""


def by_grid(path: Numbers, seen: Numbers) -> tuple[float, float]:
    """Mean and deviation of the first length by Bayes's rule on a grid, its pose by 4,000 particles at each node."""
    lengths, count = np.linspace(60.0, 80.0, 21), 4_000
    log_density = -0.5 * np.square(lengths - R[0]) / FREE["start_length_variance_px2"]
    for node, length in enumerate(lengths):
        rng = np.random.default_rng(5)
        theta = path[0] + np.sqrt(FREE["start_angle_variance_rad2"]) * rng.normal(size=count)
        rate = np.sqrt(FREE["start_rate_variance_rad2"]) * rng.normal(size=count)
        for y in seen:
            push = FREE["acceleration_rad"] * rng.normal(size=count)
            theta, rate = theta + rate + 0.5 * push, rate + push
            log_weights = -0.5 * np.square(y - length * np.cos(theta)) / FREE["observation_variance_px2"]
            weights = np.exp(log_weights - log_weights.max())
            log_density[node] += log_weights.max() + np.log(weights.mean())
            shares = np.cumsum(weights) / weights.sum()
            parents = np.searchsorted(shares, (np.arange(count) + rng.random()) / count).clip(max=count - 1)
            theta, rate = theta[parents], rate[parents]
    density = np.exp(log_density - log_density.max())
    density[[0, -1]] *= 0.5
    density /= density.sum()
    mean = density @ lengths
    return float(mean), float(np.sqrt(density @ np.square(lengths - mean)))


@pytest.mark.parametrize("name", PATHS)
def test_a_length_has_the_posterior_of_a_grid(name: str) -> None:
    """Mean within 0.6 deviations and deviation within a quarter of what Bayes's rule gives on a grid of lengths.

    The difference is that of a Gaussian pose where the link is nearly parallel, and of 600 particles.
    """
    path = PATHS[name]
    seen = 72.0 * np.cos(path[1:]) + np.random.default_rng(0).normal(size=len(path) - 1)
    mean, deviation = by_grid(path, seen)
    state = start("particles", np.array([path[0], 0.8, 0.7]), **FREE)
    for frame, y in enumerate(seen, 1):
        state = step("particles", state, np.array([y, np.nan, np.nan]), frame, sample_count=600, **FREE)
    lengths, weights = state.belief.values[:, 0], state.belief.weights
    found = weights @ lengths
    assert found == pytest.approx(mean, abs=0.6 * deviation)
    assert np.sqrt(weights @ np.square(lengths - found)) == pytest.approx(deviation, rel=0.25)


def test_an_observation_in_portions_is_the_same_observation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Taken bit by bit, it gives the same lengths and the same evidence as taken whole."""
    before, seen = start("particles", **WIDE), image(THETA + 0.01)
    whole = step("particles", before, seen, sample_count=2000, **WIDE)
    monkeypatch.setattr(filtering, "LEAST_LEFT", 0.95)
    portions = step("particles", before, seen, sample_count=2000, **WIDE)
    assert (np.abs(portions.mean - whole.mean) < 0.2 * whole.spread).all()
    assert portions.spread == pytest.approx(whole.spread, rel=0.15)
    assert portions.log_evidence == pytest.approx(whole.log_evidence, abs=0.3)
    assert (portions.belief.ancestors == -1).all()


# Chains in space whose links are seen as lines.

SCENE: dict[str, Value] = {**LINKAGE.preset_named("3d").parameters, "links_seen_as": "lines-and-ends"}
TRUE_R = np.array([68.0, 58.0, 48.0])


def frame_of(index: int, **values: Value) -> Frame:
    parameters = revise(LINKAGE.simulate().parameters, {**SCENE, **values})
    return LinkageSource(5, parameters).frame(index, History(((0, parameters),)))


def run_of(tracker: str, frames: int, **values: Value) -> Run:
    return whole_run(LINKAGE, tracker=tracker, seed=0, frames=frames, values={**SCENE, **values})


def test_derivatives_are_those_of_differences() -> None:
    """Derivatives of points and lines agree with central differences, at a rotation that is not small."""
    rng, step = np.random.default_rng(1), 1e-5
    for _ in range(2):
        state, attitude = np.append(rng.normal(size=14), TRUE_R), quaternion(rng.normal(size=3))
        angles = rng.uniform(0, 2 * np.pi, 3).repeat(2)
        axes = np.vstack([np.tile(np.eye(2), (4, 1)), np.column_stack([np.cos(angles), np.sin(angles)])])
        seen = np.column_stack([rng.normal(size=14), axes])
        ends = [[project(state + way * axis, attitude, seen) for axis in np.eye(17)] for way in (step, -step)]
        differences = (np.array(ends[0]) - ends[1]).T / (2 * step)
        assert project_slopes(state, attitude, seen) == pytest.approx(differences, abs=1e-5)


def test_the_true_chain_is_on_its_lines() -> None:
    """Without errors it shows what was seen; distances do not depend on the direction of normals."""
    frame = frame_of(3, measurement_noise_px=0)
    target = frame.target
    seen = model.read_observation(frame, target.origin_px, in_space=True)
    state = np.concatenate([target.omega, target.t, target.theta[1:], np.zeros(7), target.r])
    rows = observed_rows(seen)
    assert rows.tolist() == [0, 1, *range(6, 14)]
    shown = project(state, quaternion(np.array([0.5, -0.4, 0.2])), seen)
    assert shown[rows] == pytest.approx(seen[rows, 0], abs=1e-9)


def test_the_density_of_a_line_does_not_depend_on_how_long_its_link_looks() -> None:
    """Over all directions and offsets it sums to 1, for a long link and for one that hardly shows its length."""
    deviation, attitude = 0.5, np.array([1.0, 0.0, 0.0, 0.0])
    for length in (20.0, 60.0):
        state = np.append(np.zeros(14), [length, 58.0, 48.0])
        wide = 8 * deviation
        angles, offsets = np.linspace(-1, 1, 401) * wide * 2 / length, np.linspace(-2, 2, 401) * wide
        seen, whole = np.full((14, 3), np.nan), 0.0
        for angle in angles:
            seen[8:10] = [0.0, -np.sin(angle), np.cos(angle)]
            off = project(state, attitude, seen)[8:10, None] - offsets
            logs = model.log_image_lengths(state, attitude, seen) - 0.5 * np.square(off / deviation).sum(axis=0)
            whole += np.exp(logs).sum()
        whole *= (angles[1] - angles[0]) * (offsets[1] - offsets[0]) / (2 * np.pi * deviation**2)
        assert whole == pytest.approx(1.0, abs=0.01)


START_LINES: dict[str, Value] = {"start_angle_variance_rad2": 1e-6, "start_rate_variance_rad2": 1e-8}
START_LINES |= {"start_length_variance_px2": 0.01, "start_root_variance_px2": 0.01}
NARROW_LINES: dict[str, Value] = {**START_LINES, "acceleration_rad": 5e-4, "mirror_tau": 0}


@pytest.mark.parametrize("tracker", ["ekf", "ekf-truncated", "ekf-mirrors", "ukf"])
def test_by_lines_all_are_the_kalman_filter_on_what_is_almost_linear(tracker: str) -> None:
    """With small variances every filter has the exact posterior of the distances from the lines."""
    parameters, frame = revise(LINKAGE.simulate().parameters, {**SCENE, **NARROW_LINES}), frame_of(1)
    chosen, rng = LINKAGE.trackers[tracker], Stream(0, 1, Purpose.TRACK)
    before = chosen.start(frame.target, frame, parameters, rng)
    chain = before.belief.members[0]
    prior = Gaussian(*predict(chain.mean, chain.covariance, noise(parameters, True)))
    seen = model.read_observation(frame, before.origin_px, in_space=True)
    rows = observed_rows(seen)
    jacobian = project_slopes(prior.mean, chain.attitude, seen)[rows]
    linear = seen[rows, 0] - project(prior.mean, chain.attitude, seen)[rows] + jacobian @ prior.mean
    variance = float(parameters.observation_variance_px2)
    wanted, _ = kalman.update(prior, linear, jacobian, variance * np.eye(len(rows)))
    after = chosen.step(before, frame, parameters, rng)
    deviations = np.sqrt(wanted.covariance.diagonal())
    assert after.mean[3:5] == pytest.approx(wanted.mean[3:5], abs=0.02 * deviations[3])
    for found, exact in ((slice(-3, None), slice(-3, None)), (slice(6, 8), slice(5, 7))):
        assert (np.abs(after.mean[found] - wanted.mean[exact]) < 0.02 * deviations[exact]).all()
    assert after.spread[-3:] == pytest.approx(deviations[-3:], rel=0.02)


@pytest.mark.parametrize("tracker", ["ekf-truncated", "ukf"])
def test_a_chain_is_followed_by_its_lines(tracker: str) -> None:
    """With root and tip, lengths come within 2 px in 90 frames, and no frame is left out."""
    run = run_of(tracker, 90, start_length_1_px=6, start_length_2_px=-6, linearisations=3)
    assert np.abs(run.current.state.mean[-3:] - TRUE_R).max() < 2.0
    assert not any(row.number("outlier") for row in run.diagnostics)


def test_the_true_image_of_a_link_is_within_what_lines_say() -> None:
    """For any errors within the bound, of points and of ends; and a point is in its polygon."""
    for index in range(0, 200, 20):
        for shown in ("lines", "lines-and-ends"):
            frame = frame_of(index, links_seen_as=shown, measurement_noise_px=1)
            seen = model.read_observation(frame, frame.target.origin_px, in_space=True)
            points = frame.target.landmarks.points_px - frame.target.origin_px
            for image, one, other in zip(link_images(seen, 3.0), points[:-1], points[1:], strict=True):
                off = image.turn[:2, :2] @ (other - one) - image.middle
                assert np.all(np.abs(off) <= image.bound + 1e-5)
                assert image.bound[0] <= 6.0 + 1e-5
            for corners, point in zip(places_of(seen, 3.0), points, strict=True):
                around = np.roll(corners, -1, axis=0) - corners
                rest = point - corners
                assert np.all(around[:, 0] * rest[:, 1] - around[:, 1] * rest[:, 0] >= -1e-3 * np.hypot(*around.T))


def test_lines_that_contradict_each_other_are_left_out() -> None:
    """Where strips that should share a joint do not meet, the regions stay, and the frame counts as an outlier."""
    step, frame, rng = run_of("ellipsoids", 3).current, frame_of(3), Stream(0, 3, Purpose.TRACK)
    bad = replace(frame.measurements, offsets_px=frame.measurements.offsets_px + np.array([0.0, 300.0, 0.0]))
    shown = replace(frame, measurements=bad)
    assert LINKAGE.trackers["ellipsoids"].step(step.state, shown, step.parameters, rng).events.outlier


def test_lines_are_drawn_across_the_picture() -> None:
    """One for each link that shows one, within the picture; a caption says which links show none."""
    for width, lines in ((0, ["measured line 0", "measured line 1", "measured line 2"]), (640, [])):
        run = run_of("ekf", 2, occlusion_width_px=width)
        drawing = LINKAGE.draw(run.current, run.diagnostics)
        assert sorted(name for name in drawing.primitives if name.startswith("measured line")) == lines
        assert ("not seen: link 1, link 2, link 3" in drawing.caption) == ("not seen" in drawing.caption) == (not lines)
