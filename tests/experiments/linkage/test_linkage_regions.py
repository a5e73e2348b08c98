"""Regions of a chain contain the truth within their bounds, whatever is known, seen or changed."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.linkage.sets.regions import HIGH, LOW, SHAPE
from pftrack.experiments.linkage.sets.regions import contains as in_region
from pftrack.experiments.linkage.state import LinkageState, LinkageTrackerParameters
from pftrack.experiments.linkage.trackers import ROOT, begin, box_of, contains, known_bounds, union
from pftrack.runs.run import Run
from tests.making import whole_run

LINKAGE = find("linkage")
SETS = pytest.mark.parametrize("tracker", ["ellipsoids", "ellipsoids-literal", "box-guides"])
PRESETS = {preset.name: preset.parameters for preset in LINKAGE.presets}


def run_of(tracker: str, values: Mapping[str, Value], *timeline: Change, frames: int | None = 16) -> Run:
    return whole_run(LINKAGE, values=values, tracker=tracker, seed=3, frames=frames, timeline=timeline)


SCALES = ({"angle_scale_px": 55}, {"angle_scale_px": 1, "split_regions": False}, {"angle_scale_px": 200})
EXACT = {"chain_path": "static", "motion_bound_rad": 0, "start_angle_bound_rad": 0, "start_length_bound_px": 0}
SPACE = PRESETS["3d"]
HIDDEN, SEEN = Change(4, {"occlusion_width_px": 640}), Change(14, {"occlusion_width_px": 0})
CASES: dict[str, tuple[Mapping[str, Value], tuple[Change, ...], int | None]] = {
    "crossing": (PRESETS["cross"], (), None),
    "an object": (PRESETS["two-1"], (), 110),
    "change of scale": (
        {"angle_scale_px": 1},
        tuple(Change(frame, values) for frame, values in zip((6, 9, 12), SCALES, strict=True)),
        16,
    ),
    "lengths": (
        {f"length_{i}_{end}_px": length for i, length in ((1, 70), (2, 60), (3, 50)) for end in ("low", "high")},
        (),
        16,
    ),
    "difference": ({"true_length_2_px": 70, "length_difference_12_px": 0, "length_difference_23_px": 20}, (), 16),
    "beginning": ({"start_angle_bound_rad": 0, "start_length_bound_px": 0}, (), 16),
    "nothing moves": ({**EXACT, "start_length_bound_px": 5, "angle_scale_px": 1}, (), 16),
    "nothing errs": ({**EXACT, "measurement_noise_px": 0, "error_bound_px": 0}, (), 60),
    "observed exactly": ({"measurement_noise_px": 0, "error_bound_px": 0}, (), 16),
    "root that nobody sees": (SPACE, (HIDDEN, SEEN), 18),
    "lines": ({**SPACE, "links_seen_as": "lines", "occlusion_width_px": 60}, (), 16),
    "lines and ends": ({**SPACE, "links_seen_as": "lines-and-ends"}, (), 30),
}


@SETS
@pytest.mark.parametrize("case", CASES)
def test_the_truth_is_contained(case: str, tracker: str) -> None:
    """Known lengths and beginnings, exact points, changes of scale, hidden roots and lines never exclude it."""
    values, timeline, frames = CASES[case]
    rows = run_of(tracker, values, *timeline, frames=frames).diagnostics
    assert {row.number("contained") for row in rows} == {1.0}
    assert not any(row.number("outlier") for row in rows)


@SETS
def test_a_beginning_outside_the_bounds_is_cut_to_them(tracker: str) -> None:
    """The bounds stay as wide as they were, and the picture reports that the truth is excluded."""
    run = run_of(tracker, {"true_length_1_px": 110, "start_length_bound_px": 8}, frames=2)
    first = run.diagnostics[0]
    assert first.vector("length_1") == pytest.approx((64.0, 80.0))
    assert first.number("contained") == 0.0
    assert "truth excluded" in LINKAGE.draw(run.current, run.diagnostics).caption


def next_frame(run: Run, index: int, off_px: np.ndarray) -> Frame:
    """Return a later frame of a run's scene with other points, NaN for one that is not seen."""
    frame = run.source.frame(index, run.timeline.history)
    measured = frame.measurements
    return replace(frame, measurements=Measurements(measured.points_px + off_px, measured.sd_px))


def stepped(run: Run, state: LinkageState, frame: Frame) -> LinkageState:
    rng = Stream(0, frame.index, Purpose.TRACK)
    return LINKAGE.trackers[run.tracker].step(state, frame, run.parameters_at(0), rng)  # type: ignore[return-value]


def holds(state: LinkageState, frame: Frame) -> bool:
    target = frame.target
    parts = [part for part in (target.omega, target.t, target.theta, target.r) if part is not None]
    return contains(state, np.concatenate(parts))


@SETS
def test_points_that_are_not_seen_or_far_off_leave_the_prediction(tracker: str) -> None:
    """One point 60 px off is an outlier, hidden points are not; either way regions grow and contain the truth."""
    run = run_of(tracker, PRESETS["static"], frames=8)
    before: LinkageState = run.current.state
    far, gone = (np.array([[0.0, 0.0], [off, 0.0], [0.0, 0.0]]) for off in (60.0, np.nan))
    for off_px, outlier in ((far, True), (gone, False), (np.full((3, 2), np.nan), False)):
        frame = next_frame(run, 8, off_px)
        after = stepped(run, before, frame)
        assert after.events.outlier == outlier
        assert holds(after, frame)
    assert np.all(after.high - after.low >= before.high - before.low - 1e-9)
    assert np.allclose(after.high[3:] - after.low[3:], before.high[3:] - before.low[3:], atol=1e-6)


def test_the_root_in_space_is_bounded_by_what_is_seen() -> None:
    """A hidden root is as far from the first joint that is seen as links reach; with nothing to see it may move on."""
    run = run_of("ellipsoids", {**SPACE, "error_bound_px": 0.5, "measurement_noise_px": 0}, frames=1)
    state, widths = run.current.state, []
    for index, hidden in enumerate((0, 1, 2, 4), 1):
        off_px = np.zeros((4, 2))
        off_px[:hidden] = np.nan
        frame = next_frame(run, index, off_px)
        state = stepped(run, state, frame)
        assert holds(state, frame)
        widths.append(float(np.ptp([state.low[ROOT], state.high[ROOT]], axis=0).max()))
    assert widths[0] == pytest.approx(1.0)
    assert 100 < widths[1] < 165 < widths[2] < 305
    assert widths[3] == pytest.approx(widths[2] + 2.0 * run.parameters_at(0).root_motion_bound_px)


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
        known = known_bounds(bounds, 55.0, 0.1, in_space=in_space)
        constraints = bounds.constraints(in_space=in_space)
        assert np.allclose(known.rows @ np.append(place * 55.0, r), constraints.rows @ np.append(theta, r))
        assert (known.moved, known.radius) == (len(place), pytest.approx(5.5))


def test_a_region_is_reported_in_radians_and_pixels() -> None:
    """Pose, guides and shape are those of its coordinates over the scale, also after a change of scale."""
    region = run_of("ellipsoids", {"chain_path": "mirror3"}, frames=10).current.state.belief.members[0]
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
    boxes = run_of("box-guides", {"chain_path": "mirror3"}, frames=5).current.state.belief.members[0]
    assert not boxes.shape.any()
    assert np.allclose(boxes.pose, 0.5 * (boxes.low + boxes.high))
