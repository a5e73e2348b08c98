"""Runs of a solid: the calibrated band of its pose, bounds of all parameters, and names of series."""

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Declaration, Value, declarations, revise
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.prism.scene import VERTICES_MM
from pftrack.experiments.shared.pose import calibrated, layered
from pftrack.experiments.shared.pose.calibrated import PoseTrackerParameters, pose_and_band
from pftrack.experiments.shared.pose.state import GAUSSIAN, STUDENT_4, STUDENT_8, Belief, Solid
from pftrack.filters.affine import AffineLayer
from pftrack.runs.run import Run

SMALL: dict[str, Value] = {"image_width_px": 160, "feature_noise_px": 1.5, "slack_px": 2.0, "initial_speed_px": 2.0}
"""A small picture, and what is assumed in px of it."""
SLOPES = np.array([[4.0, 0.3, 0.2], [-0.1, 5.0, 0.4]])


def test_a_point_is_pinned_to_where_it_was_seen() -> None:
    """The camera sees it there, and it moved across the line of sight only."""
    seen = VERTICES_MM @ SLOPES.T + np.arange(16.0).reshape(8, 2)
    moved = calibrated.pin(VERTICES_MM, seen, VERTICES_MM @ SLOPES.T, np.tile(SLOPES, (8, 1, 1)))
    assert moved @ SLOPES.T == pytest.approx(seen)
    assert (moved - VERTICES_MM) @ np.cross(*SLOPES) == pytest.approx(0.0, abs=1e-9)


def test_nearness_makes_an_affine_camera_a_pinhole() -> None:
    """Scaled about the principal point, the pixels of the affine camera are those of the pinhole."""
    theta, slopes = np.array([0.2, -0.5, 0.1]), np.ascontiguousarray(5.0 * np.eye(2, 3))
    turned = VERTICES_MM @ rotation(theta).T
    nearer = calibrated.nearness(VERTICES_MM, theta, slopes, 80.0)
    assert nearer[:, None] * (turned @ slopes.T) == pytest.approx(pinhole(turned + np.array([0.0, 0.0, 80.0]), 400.0))


def test_a_wrong_depth_shows_only_when_the_solid_turns() -> None:
    """At theta = 0 nothing moves, whatever the depth is."""
    assert calibrated.depth_slopes(VERTICES_MM, np.zeros(3), SLOPES) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(calibrated.depth_slopes(VERTICES_MM, np.array([0.0, 0.5, 0.0]), SLOPES)).max() > 1.0


WANTED = revise(PoseTrackerParameters(), {"pose_band": "calibrated", "upper_layer": "affine"})


def believe(hidden: NDArray[np.float64], points: int = 8) -> tuple[Solid, Belief]:
    """A belief in a prism whose points, where they are seen, are told by the same particles, however surely hidden."""
    random = np.random.default_rng(3)
    theta, count = np.array([0.1, -0.2, 0.05]), 50
    camera = np.column_stack([SLOPES, [160.0, 120.0]])
    solid = Solid(VERTICES_MM[:points], camera, 400.0, camera[:, 3], np.array([0.0, 0.0, 80.0]), depth_doubt=0.0)
    seen = VERTICES_MM @ (SLOPES @ rotation(theta)).T + camera[:, 3] + random.normal(scale=2.0, size=(8, 2))
    positions = seen[:, None] + random.normal(scale=3.0, size=(8, count, 2))
    weights = random.random((8, count))
    weights = (1.0 - hidden[:, None]) * weights / weights.sum(axis=1)[:, None] + hidden[:, None] / count
    layer = AffineLayer(solid.points_mm, camera)
    begun = layered.begin(layer, layer.begin(), seen[:points], layered.Settings(), Stream(0, 0, Purpose.START))
    coordinates = np.concatenate([positions, positions], axis=2).transpose(0, 2, 1)[:points]
    features = replace(begun.features, coordinates=coordinates, log_weights=np.log(weights[:points]))
    pose = Gaussian(theta, np.eye(3))
    return solid, Belief.of_layers(replace(begun, features=features, hidden=hidden[:points], pose=pose))


def test_the_moments_of_a_hidden_point_are_those_of_it_seen() -> None:
    """What all its particles have in common is taken off their weights."""
    shown, doubted = (calibrated.seen_moments(believe(np.full(8, hidden))[1]) for hidden in (0.0, 0.9))
    for one, other in zip(shown, doubted, strict=True):
        assert one == pytest.approx(other)


def test_a_point_that_is_hidden_tells_nothing_of_the_pose() -> None:
    """The more surely a point is hidden the wider the band, up to that of the other points alone."""
    hidden = [np.where(np.arange(8) == 7, how, 0.0) for how in (0.0, 0.8, 0.9999)]
    sides = []
    for known, belief in (*map(believe, hidden), believe(np.zeros(8), points=7)):
        solid = replace(known, pinned_mm=known.points_mm)  # it is not known any more, so that no camera is mended
        band, _ = pose_and_band(None, solid, belief, WANTED)
        sides.append(np.linalg.det(band.covariance))
    assert sides[0] < sides[1] < sides[2]
    assert sides[2] == pytest.approx(sides[3], rel=0.05)
    assert sides[0] < 0.8 * sides[3]


def test_where_too_few_points_are_seen_the_excess_stays_as_it_was() -> None:
    """Six of eight points are hidden: how badly the others fit is not told, and the last excess still counts."""
    solid, belief = believe(np.where(np.arange(8) < 2, 0.0, 0.9999))
    solid = replace(solid, pinned_mm=solid.points_mm)
    narrow, kept = pose_and_band(0.0, solid, belief, WANTED)
    wide, _ = pose_and_band(50.0, solid, belief, WANTED)
    assert kept == 0.0
    assert np.linalg.det(wide.covariance) > np.linalg.det(narrow.covariance)
    assert pose_and_band(None, solid, belief, WANTED) == (belief.pose, None)


@pytest.mark.parametrize(("name", "tracker"), [("prism", "pf-asd"), ("head", "pf-asd"), ("head", "rb-pf")])
def test_it_may_be_turned_on_and_off(name: str, tracker: str) -> None:
    """After a change of the band in mid-run the tracking underneath is the same, and so is a head's estimate."""
    found = find(name)
    small: dict[str, Value] = {**SMALL, "joint_sample_count": 100} if name == "head" else {}
    first = Change(0, {"pose_band": "document", **small})
    changes = (first, Change(4, {"pose_band": "calibrated"}), Change(8, {"pose_band": "document"}))
    changing, document = (
        Run(found, found.simulate(), tracker=tracker, seed=1, frames=12, timeline=given)
        for given in (changes, (first,))
    )
    rows = [(one, other) for one, other in zip(changing, document, strict=True)]
    same = [one.diagnostics.sigma == other.diagnostics.sigma for one, other in rows]
    assert same == [True] * 4 + [False] * 4 + [True] * 4
    assert name == "prism" or all(one.state.estimate.tolist() == other.state.estimate.tolist() for one, other in rows)


def test_the_tails_of_a_head_are_those_of_a_student() -> None:
    """Where the band is calibrated a head's errors follow Student's t; a prism's, and Bando's, a Gaussian."""
    for widths, law in ((GAUSSIAN, stats.norm()), (STUDENT_4, stats.t(4)), (STUDENT_8, stats.t(8))):
        assert widths == pytest.approx((law.ppf(0.75) / law.std(), law.ppf(0.975) / law.std()), abs=1e-6)
    for experiment, band, widths, more in (
        ("head", "document", GAUSSIAN, {}),
        ("head", "calibrated", STUDENT_8, {}),
        ("head", "calibrated", STUDENT_4, {"templates": "flat"}),
        ("prism", "calibrated", GAUSSIAN, {}),
    ):
        made = begun(experiment, 3, pose_band=band, **more)
        made.finish()
        state = made.current.state
        assert state.widths == widths
        known = made.current.frame.target
        off = np.abs(state.estimate - known.position) / state.sigma
        assert made.diagnostics[-1].series["within_50"] == tuple((off <= widths.half).astype(float))
        assert made.diagnostics[-1].series["within_95"] == tuple((off <= widths.most).astype(float))


# Runs at the bounds of all parameters, and the names of series.


def begun(name: str, frames: int, **values: Value) -> Run:
    experiment = find(name)
    changes = (Change(0, {**(SMALL if name == "head" else {}), **values}),)
    return Run(experiment, experiment.simulate(), tracker="pf-asd", seed=4, frames=frames, timeline=changes)


def extremes(declared: Declaration) -> Iterator[Value]:
    if declared.kind == "boolean":
        yield True
    yield from declared.choices
    if declared.kind in {"integer", "number"} and declared.name != "person":
        kind = int if declared.kind == "integer" else float
        yield from (kind(declared.minimum or 0), kind(min(declared.maximum or 0, 1280)))


@pytest.mark.parametrize("name", ["prism", "head"])
def test_extreme_parameters_give_finite_estimates(name: str) -> None:
    """At the bounds of every parameter the estimate is finite, and its row is JSON."""
    trunk = begun(name, 4)
    trunk.seek(2)
    for declared in declarations(type(trunk.parameters_at(0))):
        if "pf-asd" not in (declared.trackers or ("pf-asd",)):
            continue
        for value in extremes(declared):
            values = {declared.name: value}
            run = trunk.branch(2, values) if declared.live else begun(name, 2, **values)
            row = run.finish().diagnostics
            assert np.isfinite([*row.estimate, *row.sigma]).all(), values
            json.dumps(row.as_dict(), allow_nan=False)


def test_series_have_their_names() -> None:
    """Yaw is minus theta_y, each angle has its own deviation, and every feature has a number."""
    row = begun("head", 6).finish().diagnostics
    found = [row.series[name] for name in ("pitch_deg", "yaw_deg", "yaw_deg_true")]
    assert found == pytest.approx([-row.estimate[0], -row.estimate[1], -row.truth[1]])
    assert row.error == pytest.approx(np.abs(np.subtract(row.estimate, row.truth)).mean())
    assert [row.series[f"{name}_deg_sd"] for name in ("pitch", "yaw", "roll")] == pytest.approx(row.sigma)
    assert len({round(value, 6) for value in row.sigma}) == 3
    for name in ("alpha", "correlation", "feature_recognised", "feature_error_px", "feature_sd_px", "feature_visible"):
        assert len(row.series[name]) == 11
