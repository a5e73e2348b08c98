"""The experiment of a body's shape: its trackers, presets and errors, and what is drawn."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import Ellipse
from pftrack.core.model.preset import Preset
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import find_export
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.structure.experiment import shape_errors, shape_world
from pftrack.experiments.structure.methods import StructureTrackerParameters
from pftrack.experiments.structure.scene import BodyTarget, body_of, normalise, unnamed_shape
from pftrack.experiments.structure.trackers import TRACKERS, StructureState
from pftrack.runs.run import Run
from pftrack.sources.tracks import read_tracks
from pftrack.vision.face import FEATURES
from pftrack.vision.structure.factorization import shape_error
from tests.making import whole_run

EXPERIMENT = find("structure")
FOCAL = 4e6
"""A camera so far away that it sees hardly any perspective."""


def views(points: NDArray[np.float64], count: int, sd: float = 1e-3) -> list[Measurements]:
    """A body without noise, which turns about all axes before a camera without perspective, 100 px large."""
    turns = [rotation(index * np.array([0.04, 0.02, 0.01])) for index in range(count)]
    return [Measurements(100.0 * (points @ turn.T)[:, :2], np.full(len(points), sd)) for turn in turns]


def followed(tracker: str, seen: Sequence[Measurements], **values: Any) -> list[StructureState]:
    """The states of a tracker over views of an otherwise unknown body."""
    count = len(seen[0].points_px)
    target = BodyTarget(np.zeros(3 * count), shape=unnamed_shape(count), focal_px=FOCAL)
    parameters, states = StructureTrackerParameters(**values), []
    for index, measured in enumerate(seen):
        frame, rng = Frame(index, index / 30.0, measurements=measured), Stream(0, index, Purpose.TRACK)
        begin = TRACKERS[tracker].step if states else TRACKERS[tracker].start
        states.append(begin(states[-1] if states else target, frame, parameters, rng))  # type: ignore[arg-type]
    return states  # type: ignore[return-value] # of shapes, all of them


@pytest.mark.parametrize(("tracker", "most"), [("svd", 1e-6), ("growing", 1e-2), ("informed", 1e-2), ("online", 1e-2)])
def test_a_shape_without_noise_is_recovered(tracker: str, most: float) -> None:
    """Singular values are exact to 1e-8 of the body's size; the others have priors, and one assumes a pinhole."""
    points = body_of("cloud", 3, 9).points
    found = followed(tracker, views(points, 40), window_frames=30, first_frames=5)[-1].estimate
    assert shape_errors(found, normalise(points).ravel()) < most
    np.testing.assert_allclose(np.square(found).sum(), 9, rtol=1e-12)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_what_is_missing_may_be_anything(tracker: str) -> None:
    """NaN and infinite deviations are points not seen, a point may never be seen, and a whole frame may be empty."""
    points = body_of("cloud", 3, 9).points
    seen, lost = views(points, 25, sd=1.0), np.zeros((25, 9), dtype=bool)
    lost[:, 8] = lost[7] = lost[3:12, 2] = True
    for index, measured in enumerate(seen):
        places = np.where(lost[index, :, None], np.nan, measured.points_px)
        sd = np.where(lost[index] & (np.arange(9) != 2), np.inf, measured.sd_px)
        seen[index] = Measurements(places, sd)
    states = followed(tracker, seen, window_frames=15, first_frames=6)
    assert all(np.isfinite([state.estimate, state.sigma]).all() for state in states)
    assert states[-1].seen.counts.tolist() == [24, 24, 16, *[24] * 5, 0]
    if tracker != "svd":
        found, sigma = states[-1].estimate.reshape(-1, 3), states[-1].sigma.reshape(-1, 3)
        assert shape_errors(found[:8].ravel(), points[:8].ravel()) < 1.0
        assert sigma[8].max() > 10 * sigma[0].max()


@pytest.mark.parametrize(
    ("seed", "frames", "values"),
    [
        (2, 216, {"tracked_body": "cloud", "body_seed": 14, "body_points": 6, "slip_share": 0.1, "wrong_odds": 0}),
        (3, 24, {"missing_share": 0.6, "unseen_missing": True, "burst_frames": 60}),
    ],
    ids=["slips", "missing"],
)
def test_a_recursion_that_diverges_is_given_up(seed: int, frames: int, values: dict[str, Any]) -> None:
    """Its covariances may be no numbers; they never reach what is believed."""
    run = whole_run(EXPERIMENT, seed=seed, frames=frames, values=values)
    assert all(np.isfinite([row.estimate, row.sigma]).all() for row in run.diagnostics)


@pytest.mark.parametrize(
    "values", [{"tracked_body": "prism", "sideways_deg": 0, "upwards_deg": 0}, {"tracked_body": "plate"}]
)
def test_what_no_view_shows_is_not_claimed(values: dict[str, Any]) -> None:
    """Without rotation, and of points of one plane, the growing shape has no depth, and says so."""
    run = whole_run(EXPERIMENT, frames=60, values=values)
    state = run.current.state
    assert not state.placed.known
    assert state.sigma.reshape(-1, 3)[:, 2].min() == 1.0
    assert run.diagnostics[-1].series["depth_strength"] < 3.5
    assert "depth not seen yet" in EXPERIMENT.draw(run.current, run.diagnostics).caption


def test_it_grows_from_the_mean_face_to_this_one() -> None:
    """The shape begins as the mean of others, and the own one takes over as it predicts better."""
    run = whole_run(EXPERIMENT, frames=70, values={"tracked_body": "face", "swing_deg": 30})
    first, last = run.diagnostics[0], run.diagnostics[-1]
    assert first.series["own_weight"] < 0.05
    assert last.series["own_weight"] > 0.9
    assert last.error < first.error / 3


def test_a_least_noise_is_taken_and_a_missing_point_stays_where_it_was() -> None:
    """No variance is below the one that is trusted; singular values need a place for what is not measured."""
    points = body_of("cloud", 3, 9).points
    seen = views(points, 2, sd=1.0)
    seen[1].points_px[4] = np.nan
    last = followed("svd", seen, trust_px=3.0)[-1].seen
    assert (np.delete(last.variances[-1], 4, axis=0) == 9.0).all()
    assert np.isinf(last.variances[-1, 4]).all()
    np.testing.assert_array_equal(last.filled[1, 4], seen[0].points_px[4])


@pytest.mark.parametrize("tracker", TRACKERS)
def test_the_same_numbers_beyond_the_window(tracker: str) -> None:
    """Seek, replay and take-over of another method come to the same numbers once windows are full, too."""
    other = next(name for name in TRACKERS if name != tracker)
    timeline = (Change(14, {"tracker": other}), Change(18, {"window_frames": 10}))
    values: dict[str, Any] = {"window_frames": 5, "first_frames": 5}
    once, again = (
        whole_run(EXPERIMENT, values=values, tracker=tracker, seed=4, frames=24, timeline=timeline) for _ in range(2)
    )
    again.seek(20)
    again.seek(9)
    again.finish()
    assert once.estimates_sha256 == again.estimates_sha256
    branch = once.branch(12, {})
    branch.finish()
    assert branch.diagnostics[12].estimate == once.diagnostics[12].estimate


def run_of(preset: Preset, frames: int | None = None) -> Run:
    return whole_run(EXPERIMENT, values=preset.parameters, tracker=preset.tracker, seed=preset.seed, frames=frames)


@pytest.mark.parametrize("preset", EXPERIMENT.presets, ids=lambda preset: preset.name)
def test_presets_do_what_they_say(preset: Preset) -> None:
    """What works ends in success, what is worse or breaks does not; only mirrored depth is an error as a solid."""
    lengths = {"works": None, "person": 140, "flat": 140}
    run = run_of(preset, lengths.get(preset.name, 80))
    if preset.name == "mirror":
        mirrored = [row.series["mirrored"] for row in run.diagnostics[30:]]
        assert np.mean(mirrored) > 0.5
        assert run.diagnostics[-1].series["metric_error"] > 10 * run.diagnostics[-1].error
    else:
        assert run.summary().verdict.success == preset.title.startswith("works")


def test_the_error_is_that_of_bando() -> None:
    """It is eq. 4.19 in percent for a solid shape, also of many at once, and is known of a flat one."""
    truths, estimates = np.random.default_rng(0).standard_normal((2, 5, 9, 3))
    found = shape_errors(estimates.reshape(5, 27), truths.reshape(5, 27))
    wanted = [100 * shape_error(one, other) for one, other in zip(estimates, truths, strict=True)]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    flat = (truths[0] * np.array([1.0, 1.0, 0.0])).ravel()
    centred = truths[0] - truths[0].mean(axis=0)
    across, depth = centred[:, :2], centred[:, 2]
    left = depth - across @ np.linalg.lstsq(across, depth, rcond=None)[0]
    known = 100 * np.linalg.norm(left) / np.linalg.norm(centred)
    assert shape_errors(flat, truths[0].ravel()) == pytest.approx(known)
    assert np.isnan(shape_errors(flat, np.zeros(27)))


def test_what_is_endlessly_unsure_has_no_ellipsoid() -> None:
    """Its covariance may be no number of 32 bits."""
    run = run_of(EXPERIMENT.presets[0], 22)
    state = run.current.state
    covariances = state.placed.covariances.copy()
    covariances[3] *= 1e60
    unsure = replace(state, placed=replace(state.placed, covariances=covariances))
    before, after = (shape_world(one, run.current.frame.target).primitives["uncertainty"] for one in (state, unsure))
    assert len(after.covariances) == len(before.covariances) - 1
    assert np.isfinite(after.covariances).all()


def test_hidden_points_are_rings() -> None:
    """A point that is hidden is drawn as a ring where the shape has it."""
    run = run_of(EXPERIMENT.presets[0], 22)
    drawing, names = EXPERIMENT.draw(run.current, run.diagnostics), run.current.state.body.names
    visible = run.current.frame.target.landmarks.visible
    rings = {name: item for name, item in drawing.primitives.items() if name.startswith("hidden ")}
    assert rings.keys() == {f"hidden {name}" for name, seen in zip(names, visible, strict=True) if not seen}
    assert {type(item) for item in rings.values()} == {Ellipse}


def test_the_table_of_a_head_s_tracks_says_what_the_rows_say() -> None:
    """Positions and variances are those of the series; what was not recognised, or not measured, has no line."""
    head = find("head")
    tracked = whole_run(head, seed=3, frames=3, values={"image_width_px": 320})
    first, second, third = tracked.diagnostics
    hidden = {**second.series, "track_sd_px": (np.nan, *second.series["track_sd_px"][1:])}
    past = [first, replace(second, series=hidden), replace(third, series={})]
    table = read_tracks(find_export(head.exports, "tracks").make(None, past), most_frames=10)
    assert table.names == FEATURES
    assert table.positions.shape == (2, 11, 2)
    for row, positions, variances in zip(past, table.positions, table.variances, strict=False):
        sd = np.array(row.series["track_sd_px"])
        seen = np.isfinite(sd)
        assert np.isfinite(positions).all(axis=1).tolist() == seen.tolist()
        wanted = np.stack([row.series["feature_x_px"], row.series["feature_y_px"]], axis=1)
        np.testing.assert_array_equal(positions[seen], wanted[seen])
        np.testing.assert_allclose(variances[seen, 0], np.square(sd)[seen])
    np.testing.assert_array_equal(third.series["feature_x_px"], tracked.current.state.feature_means[:, 0])
