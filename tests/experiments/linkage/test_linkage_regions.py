"""Regions of a chain hold the truth within their bounds, whatever is seen of it."""

from dataclasses import replace
from itertools import cycle, islice

import numpy as np
import pytest

from pftrack.core.model.source import Measurements
from pftrack.experiments.linkage.model import directions
from pftrack.experiments.linkage.sets.regions import HIGH, LOW, SHAPE
from pftrack.experiments.linkage.sets.regions import contains as in_region
from pftrack.experiments.linkage.state import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers import ROOT, begin, box_of, known_bounds, union
from tests.experiments.linkage.chains import RUNS, blind, follow, frame_of, frames, lengths_of, outliers, tracked

PLANE = [name for name in RUNS if name != "3d"]
SETS = ["ellipsoids", "ellipsoids-literal", "box-guides"]
WRONG = {"predicted_ellipsoid": "printed", "first_ellipsoid": "inscribed"}


@pytest.mark.parametrize("tracker", SETS)
@pytest.mark.parametrize("name", PLANE)
def test_the_truth_is_held_in_every_frame(name: str, tracker: str) -> None:
    """Errors and motion within their bounds never exclude the truth, and the regions come down to one again."""
    states, held = tracked(name, 0, tracker)
    assert all(held)
    assert not any(outliers(states))
    assert tracker == "ellipsoids-literal" or len(states[-1].belief) == 1


@pytest.mark.slow
@pytest.mark.parametrize("tracker", SETS)
@pytest.mark.parametrize("name", RUNS)
def test_the_truth_is_held_with_five_seeds(name: str, tracker: str) -> None:
    """The same for other seeds, and for 200 frames in space."""
    assert all(all(tracked(name, seed, tracker)[1]) for seed in range(5))


def test_lengths_are_found_by_the_full_method_alone() -> None:
    """Guides shrunk by intervals bound the lengths of both objects, with ellipsoids or not; ellipsoids alone do not."""
    wanted = {"two-1": [[63.8, 71.7], [51.4, 59.3], [41.4, 56.1]], "two-2": [[73.7, 80.0], [61.3, 69.3], [51.4, 60.0]]}
    for name, intervals in wanted.items():
        full = [lengths_of(tracked(name, seed)[0][-1]) for seed in range(2)]
        alone, literal = (lengths_of(tracked(name, 0, way)[0][-1]) for way in ("box-guides", "ellipsoids-literal"))
        assert np.allclose(np.mean(full, axis=0), intervals, atol=2.0)
        assert np.allclose(alone, full[0], atol=0.1)
        assert literal[1:] == pytest.approx(np.array([[50, 70], [40, 60]]), abs=1.5)


@pytest.mark.parametrize("name", ["mirror3", "mirror2", "two-1"])
def test_the_printed_prediction_loses_the_truth(name: str) -> None:
    """P + du I holds it in the first frames alone, and then takes observations for wrong."""
    states, held = tracked(name, 0, "ellipsoids-literal", **WRONG)
    assert 0.05 < np.mean(held) < 0.17
    assert sum(outliers(states)) > 5


@pytest.mark.parametrize("tracker", SETS)
@pytest.mark.parametrize(("angle_rad", "length_px"), [(0, 0), (0.1, 5)])
def test_nothing_moves_and_nothing_errs(tracker: str, angle_rad: float, length_px: float) -> None:
    """With du = 0, dy = 0, exact observations and a start at the truth, a region shrinks to a point and stays there."""
    start = {"start_angle_bound_rad": angle_rad, "start_length_bound_px": length_px}
    parameters = LinkageTrackerParameters(motion_bound_rad=0, error_bound_px=0, **start)
    states, held = follow(tracker, frames("static", 0, 150, spread=0.0), parameters)
    assert all(held)
    assert not any(outliers(states))


@pytest.mark.parametrize("tracker", SETS)
def test_points_that_were_not_seen_are_left_out(tracker: str) -> None:
    """Without a point, some or all, the truth is held; without any the lengths stay as they were."""
    gone = [slice(3) if 30 <= index < 40 else slice(index % 5, index % 5 + 1) for index in range(60)]
    shown = [(target, blind(frame, gone[frame.index])) for target, frame in frames("mirror3", 2, 60)]
    states, held = follow(tracker, shown)
    assert all(held)
    assert np.allclose(lengths_of(states[29]), lengths_of(states[39]), atol=1e-6)
    assert np.ptp(states[39].low[:3] - states[29].low[:3]) >= 0


def test_the_root_in_space_is_bounded_by_what_is_seen() -> None:
    """A hidden root is as far from the first joint that is seen as links reach; with nothing to see it may move on."""
    parameters = LinkageTrackerParameters(**RUNS["3d"][2])
    shown = [(target, blind(frame, slice((0, 0, 1, 2, 4)[frame.index]))) for target, frame in frames("3d", 0, 5)]
    states, held = follow("ellipsoids", shown, parameters)
    assert all(held[:4])
    widths = [float(np.ptp([state.low[ROOT], state.high[ROOT]], axis=0).max()) for state in states]
    assert widths[1] == pytest.approx(1.0)
    assert 100 < widths[2] < 165 < widths[3] < 305
    assert widths[4] == pytest.approx(widths[3] + 2.0 * parameters.root_motion_bound_px)


@pytest.mark.parametrize("tracker", SETS)
def test_an_observation_outside_every_bound_is_left_out(tracker: str) -> None:
    """One point 60 px off is counted as an outlier, the prediction stands, and the truth is held before and after."""
    shown = list(frames("static", 0, 14))
    shown[8] = shown[8][0], frame_of(shown[8][0], 8, np.array([[0.0, 0.0], [60.0, 0.0], [0.0, 0.0]]))
    states, held = follow(tracker, shown)
    assert all(held)
    assert outliers(states) == [index == 8 for index in range(14)]
    assert np.all(states[8].high - states[8].low >= states[7].high - states[7].low - 1e-9)


def test_lengths_in_the_wrong_order_are_said_and_survived() -> None:
    """A chain with links of 50, 60 and 70 px contradicts the bounds: observations are outliers, and nothing breaks."""
    shown = []
    for target, frame in frames("static", 0, 40):
        other, points = replace(target, r=target.r[::-1].copy()), frame.measurements.points_px.copy()
        points[:, 0] = np.cumsum(other.r * np.cos(directions(other.theta))) + target.origin_px[0]
        shown.append((other, replace(frame, measurements=Measurements(points, frame.measurements.sd_px))))
    states, _ = follow("ellipsoids", shown)
    assert sum(outliers(states)) > 5
    assert all(np.isfinite(state.mean).all() and (state.low <= state.high).all() for state in states)


@pytest.mark.parametrize("tracker", ["ellipsoids", "ellipsoids-literal"])
@pytest.mark.parametrize("count", [500, pytest.param(5000, marks=pytest.mark.slow)])
def test_thousands_of_frames_leave_ellipsoids_positive(tracker: str, count: int) -> None:
    """With a motion bound of 0 and of more, however long a pose is held, every shape has a root."""
    shown = list(islice(cycle(list(frames("static", 0, 60))), count))
    for motion in (0.0, 0.05):
        states, held = follow(tracker, shown, LinkageTrackerParameters(motion_bound_rad=motion))
        assert all(held[99::100])
        for member in (member for state in states[99::100] for member in state.belief.members):
            np.linalg.cholesky(member.array[SHAPE:])


def test_the_box_of_the_start_is_its_region() -> None:
    """Points of the box are in the region, in the plane and in space; an inscribed ellipsoid leaves out corners."""
    rng = np.random.default_rng(0)
    for size in (6, 11):
        low = rng.normal(size=size)
        low[-3:] += 50
        high = low + rng.uniform(0, 0.5, size)
        if size == 11:
            low[5] = high[5] = 0.0
        region, inner = (begin((low, high), 55.0, inscribed=inscribed) for inscribed in (False, True))
        kept = []
        for _ in range(200):
            point = low + rng.choice([0.0, 1.0, *[0.5] * 8], size) * (high - low)
            theta = np.cumsum(point[-6:-3])
            place = np.concatenate([point[:3], theta[1:], point[-3:]] if size == 11 else [theta, point[-3:]])
            place[:-3] *= 55.0
            assert in_region(region.array, place)
            kept.append(in_region(inner.array, place))
        assert 0 < np.mean(kept) < 1


def test_bounds_are_the_same_in_the_coordinates_of_regions() -> None:
    """Rows of joints and lengths have the same values for poses as for regions' points, in the plane and in space."""
    rng = np.random.default_rng(0)
    bounds = LinkageTrackerParameters(first_joint_low_deg=-90, first_joint_high_deg=90).bounds
    for in_space in (False, True):
        theta, r = rng.normal(size=3), rng.uniform(40, 80, 3)
        theta[0] *= not in_space
        place = np.concatenate([rng.normal(size=3), np.cumsum(theta)[1:]] if in_space else [np.cumsum(theta)])
        told_by = known_bounds(bounds, 55.0, 0.1, in_space=in_space)
        constraints = bounds.constraints(in_space=in_space)
        assert np.allclose(told_by.rows @ np.append(place * 55.0, r), constraints.rows @ np.append(theta, r))
        assert (told_by.moved, told_by.radius) == (len(place), pytest.approx(5.5))


def test_a_region_is_told_in_radians_and_pixels() -> None:
    """Pose, guides and shape are those of its coordinates over the scale, also after a change of scale."""
    states, _ = tracked("mirror3", 0, count=10)
    region = states[-1].belief.members[0]
    other = region.rescale(150.0)
    for name in ("pose", "low", "high", "shape"):
        assert np.allclose(getattr(region, name), getattr(other, name))
    assert np.allclose(region.low[:3] * 55.0, region.array[LOW, :3])
    assert region.shape[0, 3] == pytest.approx(region.array[SHAPE, 3] / 55.0)
    assert np.allclose(other.array[HIGH, :3], region.array[HIGH, :3] * 150 / 55)
    least, most = union([region])
    low, high = box_of([region], LinkageTrackerParameters().bounds, None)
    assert np.all(low[3:] == least[3:])
    assert high[1] == pytest.approx(min(most[1] - least[0], np.pi / 2))
    boxes = tracked("mirror3", 0, "box-guides", 5)[0][-1].belief.members[0]
    assert not boxes.shape.any()
    assert np.allclose(boxes.pose, 0.5 * (boxes.low + boxes.high))
