"""Trackers of a chain in space whose links are seen as lines."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.geometry import quaternion
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.linkage.gaussians import noise
from pftrack.experiments.linkage.linearised import predict
from pftrack.experiments.linkage.model import (
    log_image_lengths,
    observed_rows,
    project,
    project_slopes,
    read_observation,
)
from pftrack.experiments.linkage.scene import LinkageSource
from pftrack.experiments.linkage.sets.space import link_images, places_of
from pftrack.filters import kalman
from pftrack.runs.run import Run
from tests.making import whole_run

LINKAGE = find("linkage")
SCENE: dict[str, Value] = {**LINKAGE.preset_named("3d").parameters, "links_seen_as": "lines-and-ends"}
R = np.array([68.0, 58.0, 48.0])
SETS = ("ellipsoids", "ellipsoids-literal", "box-guides")


def frame_of(index: int, **values: Value) -> Frame:
    parameters = revise(LINKAGE.simulate().parameters, {**SCENE, **values})
    source = LinkageSource(5, parameters)
    target = source.target(index)
    true_px, ends = target.landmarks.points_px, parameters.links_seen_as == "lines-and-ends"
    measured = source._measure(index, true_px, np.ones(4, dtype=np.bool_), parameters, spatial=True)
    assert ends == bool(np.isfinite(measured.points_px).any())
    return Frame(index, 0.0, measurements=measured, target=target)


def random_state(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    state = rng.normal(size=17)
    state[-3:] = R
    return state, quaternion(rng.normal(size=3))


def observation(rng: np.random.Generator) -> np.ndarray:
    """Four measured points and three lines, of anything."""
    angles = rng.uniform(0, 2 * np.pi, 3).repeat(2)
    axes = np.vstack([np.tile(np.eye(2), (4, 1)), np.column_stack([np.cos(angles), np.sin(angles)])])
    return np.column_stack([rng.normal(size=14), axes])


def run_of(tracker: str, frames: int, seed: int = 0, **values: Value) -> Run:
    return whole_run(LINKAGE, tracker=tracker, seed=seed, frames=frames, values={**SCENE, **values})


def test_derivatives_are_those_of_differences() -> None:
    """Of points and lines alike, at a rotation that is not small."""
    rng, step = np.random.default_rng(1), 1e-5
    for _ in range(5):
        (state, attitude), seen = random_state(rng), observation(rng)
        ends = [[project(state + way * axis, attitude, seen) for axis in np.eye(17)] for way in (step, -step)]
        differences = (np.array(ends[0]) - ends[1]).T / (2 * step)
        assert project_slopes(state, attitude, seen) == pytest.approx(differences, abs=1e-5)


def test_the_true_chain_is_on_its_lines() -> None:
    """What it shows is what was seen, if nothing errs, and whichever way normals point the distances are the same."""
    frame = frame_of(3, measurement_noise_px=0)
    target = frame.target
    seen = read_observation(frame, target.origin_px, in_space=True)
    state = np.concatenate([target.omega, target.t, target.theta[1:], np.zeros(7), target.r])
    rows = observed_rows(seen)
    assert rows.tolist() == [0, 1, *range(6, 14)]
    shown = project(state, quaternion(np.array([0.5, -0.4, 0.2])), seen)
    assert shown[rows] == pytest.approx(seen[rows, 0], abs=1e-9)


def test_the_density_of_a_line_does_not_depend_on_how_long_its_link_looks() -> None:
    """Over all directions and offsets it comes to 1, for a long link and for one that hardly shows its length."""
    deviation, attitude = 0.5, np.array([1.0, 0.0, 0.0, 0.0])
    for length in (20.0, 60.0):
        state = np.append(np.zeros(14), [length, 58.0, 48.0])
        wide = 8 * deviation
        angles, offsets = np.linspace(-1, 1, 401) * wide * 2 / length, np.linspace(-2, 2, 401) * wide
        seen, whole = np.full((14, 3), np.nan), 0.0
        for angle in angles:
            seen[8:10] = [0.0, -np.sin(angle), np.cos(angle)]
            off = project(state, attitude, seen)[8:10, None] - offsets
            logs = log_image_lengths(state, attitude, seen) - 0.5 * np.square(off / deviation).sum(axis=0)
            whole += np.exp(logs).sum()
        whole *= (angles[1] - angles[0]) * (offsets[1] - offsets[0]) / (2 * np.pi * deviation**2)
        assert whole == pytest.approx(1.0, abs=0.01)


NARROW: dict[str, Value] = {
    "start_angle_variance_rad2": 1e-6,
    "start_rate_variance_rad2": 1e-8,
    "start_length_variance_px2": 0.01,
    "start_root_variance_px2": 0.01,
    "acceleration_rad": 5e-4,
    "mirror_tau": 0,
}


@pytest.mark.parametrize("tracker", ["ekf", "ekf-truncated", "ekf-mirrors", "ukf"])
def test_on_what_is_almost_linear_all_are_the_kalman_filter(tracker: str) -> None:
    """With small variances every filter has the exact posterior of the distances from the lines."""
    parameters, frame = revise(LINKAGE.simulate().parameters, {**SCENE, **NARROW}), frame_of(1)
    chosen, rng = LINKAGE.trackers[tracker], Stream(0, 1, Purpose.TRACK)
    before = chosen.start(frame.target, frame, parameters, rng)
    chain = before.belief.members[0]
    prior = Gaussian(*predict(chain.mean, chain.covariance, noise(parameters, True)))
    seen = read_observation(frame, before.origin_px, in_space=True)
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


def test_lines_that_cross_are_their_joints() -> None:
    """Where links meet at a right angle in the image, lines and ends say what four points do, to the joints' noise."""
    rng = np.random.default_rng(0)
    state, attitude = np.zeros(17), np.array([1.0, 0.0, 0.0, 0.0])
    state[5:7], state[-3:] = np.pi / 2, R
    points = np.column_stack([rng.normal(size=8), np.tile(np.eye(2), (4, 1))])
    normals = np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]).repeat(2, axis=0)
    lines = np.vstack([np.full((8, 3), np.nan), np.column_stack([rng.normal(size=6), normals])])
    lines[[0, 1, 6, 7]] = points[[0, 1, 6, 7]]
    told = [project_slopes(state, attitude, seen)[observed_rows(seen)] for seen in (points, lines)]
    by_points, by_lines = (one.T @ one for one in told)
    # Root and tip are seen across their lines as well, so that lines know no less.
    assert np.linalg.eigvalsh(by_lines - by_points).min() > -1e-9
    assert len(observed_rows(lines)) == 10


@pytest.mark.parametrize("tracker", ["ekf-truncated", "ukf", "particles"])
def test_a_chain_is_followed_by_its_lines(tracker: str) -> None:
    """With root and tip, lengths come within 2 px in 90 frames, and no frame is left out."""
    values: dict[str, Value] = {"sample_count": 60, "start_length_1_px": 6, "start_length_2_px": -6}
    if tracker == "ekf-truncated":
        values["linearisations"] = 3
    run = run_of(tracker, 90, **values)
    assert np.abs(run.current.state.mean[-3:] - R).max() < 2.0
    assert not any(row.number("outlier") for row in run.diagnostics)


def test_more_linearisations_keep_lengths_from_being_too_sure() -> None:
    """Of points in space: linearised thrice, final errors are those that the filter says; once, they are greater."""
    values: dict[str, Value] = {"links_seen_as": "points", "start_length_1_px": 6}
    ratios = []
    for rounds in (1, 3):
        runs = [run_of("ekf-truncated", 200, seed, linearisations=rounds, **values) for seed in range(2)]
        ends = [run.current.state for run in runs]
        ratios.append(np.mean([np.square((end.mean[-3:] - R) / end.spread[-3:]).mean() for end in ends]))
    assert ratios[1] < 0.6 * ratios[0]


@pytest.mark.parametrize("tracker", SETS)
@pytest.mark.parametrize("shown", ["lines", "lines-and-ends"])
def test_regions_hold_the_truth_by_lines(tracker: str, shown: str) -> None:
    """Over seeds, in every frame, part of which have links behind the occluder."""
    for seed in range(2):
        run = run_of(tracker, 40, seed, links_seen_as=shown, occlusion_width_px=60 * (seed == 1))
        assert {row.number("contained") for row in run.diagnostics} == {1.0}
        assert not any(row.number("outlier") for row in run.diagnostics)


def test_the_true_image_of_a_link_is_within_what_lines_say() -> None:
    """For any errors within the bound, of points and of ends; and a point is in its polygon."""
    for index in range(0, 200, 7):
        for shown in ("lines", "lines-and-ends"):
            frame = frame_of(index, links_seen_as=shown, measurement_noise_px=1)
            seen = read_observation(frame, frame.target.origin_px, in_space=True)
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
