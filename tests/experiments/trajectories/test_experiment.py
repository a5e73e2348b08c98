"""The experiment `trajectories`: its presets, errors, files, recordings, and what is seen when it is looked into."""

import csv
import io
import math
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.drawing import Links, Text
from pftrack.core.model.likelihood import Residual
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import Interval
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.model.tracker import Step
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.trajectories import draw
from pftrack.experiments.trajectories.model import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.scene import REFERENCE_PX, TRUE_PATH, TrajectoriesTarget
from pftrack.experiments.trajectories.trackers import TRACKERS
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from tests.experiments.trajectories.test_corners import rectangles
from tests.making import whole_run

EXPERIMENT = find("trajectories")
PRESETS = {preset.name: preset for preset in EXPERIMENT.presets}
PICTURES = 50
"""Length of a run on the lattice, whose pictures are dear: all that a preset speaks of has happened by then."""


@cache
def finished(name: str) -> Run:
    preset = PRESETS[name]
    length = None if "trajectories_scene" in preset.parameters else PICTURES
    return whole_run(EXPERIMENT, values=preset.parameters, tracker=preset.tracker, seed=preset.seed, frames=length)


def off(name: str, frame: int) -> float:
    return float(finished(name).diagnostics[frame].error)  # type: ignore[arg-type] # the truth is known


def of_table(lines: Iterable[str], tmp_path: Path, tracker: str = "lg", **values: float) -> Run:
    path = tmp_path / "path.csv"
    path.write_text("\n".join(["frame,track,x,y", *lines]))
    setup = EXPERIMENT.video.on_video(open_sequence(path), None)
    run = Run(EXPERIMENT, setup, tracker=tracker, timeline=(Change(0, values),) if values else ())
    run.finish()
    return run


def world_of(step: Step, name: str) -> dict[str, Any]:
    return dict(next(it for it in EXPERIMENT.draw(step, []).worlds if it.world.name == name).primitives)


def exported(run: Run) -> str:
    (export,) = EXPERIMENT.exports
    return export.make(run.current.state, run.diagnostics[: run.position + 1]).decode()


PROMISED = {"dragged": {45: 26, 48: 1}, "trusting": {45: 35}, "stiff": {50: 1, 55: 26}, "drifting": {55: 29}}


def test_presets_do_what_they_say() -> None:
    """What a sentence tells one to watch is there, in the frames that it names."""
    for name, errors in PROMISED.items():
        assert {frame: off(name, frame) for frame in errors} == pytest.approx(errors, abs=0.5), name
    assert off("few", 15) == pytest.approx(11, abs=0.6)
    assert max(off("known", 45), off("long", 30), off("long", 31)) < 1.0
    assert min(off("long", frame) for frame in range(33, 42)) > 30.0
    first, last = (finished("works").diagnostics[frame].series["noise_sd_px"] for frame in (0, 45))
    assert first == Interval(pytest.approx(0.7, abs=0.05), pytest.approx(3.1, abs=0.05))
    assert last.low == last.high


@pytest.mark.slow
def test_presets_of_the_lattice_do_what_they_say() -> None:
    """The light jumps in the frames that are named, and what that does to the ringed track is as it is told."""
    lattice, light = finished("lattice").diagnostics, finished("light").diagnostics
    assert all(0.5 < lattice[frame].series["mismatch_share"] < 0.7 for frame in (11, 27, 41, 45))
    for frame in (27, 41, 45):
        assert light[frame].series["mismatch_share"] == pytest.approx(1 / 8, abs=0.03)
    assert max(off("lattice", frame) for frame in range(PICTURES)) < 1.35
    for frame in (11, 27):
        assert off("look-alike", frame) == pytest.approx(10, abs=0.7)
        assert off("look-alike", frame + 1) == pytest.approx(5, abs=0.3)
    assert min(off("lost-cell", frame) for frame in range(44, PICTURES)) > 20.0
    assert off("slanted", 6) < 10.0
    assert min(off("slanted", frame) for frame in range(7, 47)) > 10.0


@pytest.mark.parametrize(
    "name", [name for name, it in PRESETS.items() if "trajectories_scene" in it.parameters or name == "lattice"]
)
def test_presets_that_work_succeed(name: str) -> None:
    """Those that break do not; on the lattice one is enough, as the figures of the others are asserted above."""
    title = PRESETS[name].title
    if not title.startswith("worse"):
        assert finished(name).summary().verdict.success == title.startswith("works")


def test_series_are_beside_the_truth() -> None:
    """Errors of all tracks by hand; the smoothed ones are of the frame a lag ago."""
    run = finished("dragged")
    state, row = run.current.state, run.diagnostics[-1]
    assert row.number("smoothed_frame") == 74
    first = np.array([[80.0 * number, 0.0] for number in range(6)])
    shown = {"raw": (state.raw[0], 99), "filtered": (state.filtered[0], 99), "smoothed": (state.smoothed[25], 74)}
    for name, (positions, frame) in shown.items():
        apart = positions - (first + TRUE_PATH[frame])
        assert row.number(f"{name}_rms_px") == pytest.approx(np.sqrt(np.square(apart).sum(axis=1).mean()))
    np.testing.assert_allclose(state.history[0][:, 0, 0], REFERENCE_PX, atol=1e-4)
    report = EXPERIMENT.measured.report(run.diagnostics)  # type: ignore[misc]
    assert report["tracks"] == 6
    assert set(report) == {"tracks", "false_motion_px", *(f"{name}_rms_px" for name in shown)}


def test_where_nothing_moves_motion_is_false(tmp_path: Path) -> None:
    """Points at rest with outliers: heavy tails leave less motion than the Gaussian, and no truth is needed."""
    rng, found = np.random.default_rng(0), {}
    places = np.array([[50.0, 60.0], [300.0, 80.0], [200.0, 200.0]]) + 0.3 * rng.standard_normal((40, 3, 2))
    places[[12, 20]] += 40.0
    lines = [f"{frame},{track},{x},{y}" for frame, shown in enumerate(places) for track, (x, y) in enumerate(shown)]
    for tracker in ("lg", "lng"):
        run = of_table(lines, tmp_path, tracker, noise_variance_px2=0.25, drive_variance_px2=0.05)
        found[tracker] = EXPERIMENT.measured.report(run.diagnostics)  # type: ignore[misc]
        assert set(found[tracker]) == {"tracks", "raw_motion_px", "false_motion_px"}
        assert run.diagnostics[12].number("outlier_share") == 1.0
    assert found["lng"]["false_motion_px"] < 1.0 < found["lg"]["false_motion_px"]


def test_gaps_are_bridged_and_files_are_in_the_units_that_came(tmp_path: Path) -> None:
    """A path in metres with a gap: the table that is written has the file's frames, names and unit, and empty cells."""
    lines = [f'{7 + frame},"a, b",{0.01 * frame},{0.02 * frame + 1}' for frame in range(110) if not 40 <= frame < 44]
    run = of_table(lines, tmp_path)
    rows = list(csv.DictReader(io.StringIO(exported(run))))
    assert [(int(row["frame"]), row["track"]) for row in rows] == [(frame, "a, b") for frame in range(7, 117)]
    assert (rows[41]["x"], rows[41]["outlier"]) == ("", "0")
    for frame, row in enumerate(rows):
        assert float(row["smoothed_x"]) == pytest.approx(0.01 * frame, abs=0.02)
        assert float(row["smoothed_y"]) == pytest.approx(0.02 * frame + 1, abs=0.03)
    # Where the run stands in the past, the table ends there.
    run.seek(20)
    assert len(exported(run).splitlines()) == 22


def test_a_spreadsheet_computes_no_name(tmp_path: Path) -> None:
    """A file may name a track by a formula, which is written as text; coordinates far off keep their digits."""
    run = of_table((f"{frame},=1+1,{frame},5" for frame in range(6)), tmp_path)
    assert {row.split(",")[1] for row in exported(run).split()[1:]} == {"'=1+1"}
    assert [draw._cell(np.float64(it)) for it in (654321.1234, 0.25, np.nan)] == ["654321.1234", "0.25", ""]


def test_a_selected_track_that_comes_late_has_no_estimate_before(tmp_path: Path) -> None:
    """Unknown is unknown, in rows and in drawings; the other tracks are drawn."""
    lines = [f"{frame},early,{100 + frame},50" for frame in range(12)]
    lines += [f"{frame},late,{frame},{20 + frame}" for frame in range(6, 12)]
    run = of_table(lines, tmp_path, "nlng", selected_track=1, sample_count=20)
    assert math.isnan(run.diagnostics[5].estimate[0])
    assert np.isfinite(run.diagnostics[6].estimate).all()
    assert [run.diagnostics[frame].number("tracks") for frame in (0, 6)] == [1.0, 2.0]
    for frame, there in ((3, False), (11, True)):
        primitives = EXPERIMENT.draw(run.seek(frame), run.diagnostics).primitives
        assert ("estimate" in primitives) == there
        assert len(primitives["raw points"].positions) == 1 + there
        assert isinstance(primitives["smoothed"], Links)
    # 2 modulo two tracks is the first one.
    assert of_table(lines, tmp_path, selected_track=2).current.state.selected == 0


def test_scales_are_seen_in_a_world_of_their_own() -> None:
    """The likelihood has its top where the grid has, given scales are a cross, and learned ones a shrinking cloud."""
    given, first, last = (
        world_of(finished(name).seek(frame), "scales") for name, frame in (("dragged", 99), ("works", 0), ("works", 99))
    )
    vertices = given["likelihood"].vertices
    # Of the last 64 frames, with three outliers: sigma above that of the noise without them, tau about 0.5 px.
    sigma, tau = 10.0 ** (vertices[vertices[:, 2].argmax(), :2] + np.array([0.25, -0.75]))
    assert 1.5 < sigma < 8.0
    assert 0.1 < tau < 2.0
    assert "given" in given
    few, many = (len(np.unique(it["particles of the scales"].positions, axis=0)) for it in (last, first))
    assert few == 1
    assert many > 500


@pytest.mark.parametrize("name", ["nlng", "lng"])
def test_particles_take_over_the_place_and_the_speed(name: str) -> None:
    """After the Kalman filter a track that is not measured goes on as fast as before, and the other way round."""
    target = TrajectoriesTarget(np.full(2, np.nan), hidden=None)
    parameters = TrajectoriesTrackerParameters(drive_variance_px2=0.5, noise_variance_px2=1)
    for before, after in (("lg", name), (name, "lg")):
        state = None
        for index in range(12):
            points = np.array([[100.0 + 2.0 * index, 80.0]]) if index < 10 else np.full((1, 2), np.nan)
            frame = Frame(index, index / 30.0, measurements=Measurements(points, np.ones((1, 2))))
            tracker, stream = TRACKERS[before if index < 10 else after], Stream(0, index, Purpose.TRACK)
            begin = tracker.step if state else tracker.start
            state = begin(state or target, frame, parameters, stream)  # type: ignore[operator]
        np.testing.assert_allclose(state.estimate, [122.0, 80.0], atol=5.0)


# Looking into trajectories: the particles of the selected track, its likelihood, and what the frame did to it.


def looked_into(tracker: str, frame: int = 6) -> Inspection:
    """The scene of corners at a frame, looked into."""
    return Inspection(whole_run(EXPERIMENT, tracker=tracker, seed=2, frames=frame + 1))


@pytest.mark.parametrize(("tracker", "coordinates"), [("lng", 2), ("nlng", 4)])
def test_particles_descend_from_those_of_the_frame_before(tracker: str, coordinates: int) -> None:
    """A particle's parent is where the tree of the track has it, and weights are how often each was drawn."""
    look = looked_into(tracker)
    cloud, state = look.cloud, look.run.current.state
    assert cloud.ancestors is not None
    assert cloud.states.shape[1] == coordinates
    first, last = state.belief.offsets[state.selected, :2]
    kept = state.belief.age(state.selected, 1)[0][state.belief.parents[first:last]]
    particle = int(cloud.log_weights.argmax())
    found = look.at_particle(particle).particle
    np.testing.assert_array_equal(found.path[1], kept[particle])
    assert found.rank == 1
    assert np.exp(cloud.log_weights).sum() == pytest.approx(1.0)
    assert (np.diff(look.genealogy().counts) > 0).all()


@pytest.mark.parametrize("tracker", ["lng", "nlng", "lg"])
def test_the_likelihood_is_greatest_where_the_track_is_measured(tracker: str) -> None:
    """A map covers the picture, template and place lie beside each other, and each axis is told by itself."""
    look = looked_into(tracker)
    state, found = look.run.current.state, look.map((640, 480))
    measured = state.raw[0, state.selected]
    row, column = np.unravel_index(found.log_likelihoods.argmax(), found.log_likelihoods.shape)
    assert np.abs(found.step_px * np.array([column, row]) + found.step_px // 2 - measured).max() <= found.step_px
    here, beside = look.at_place(measured), look.at_place(measured + 3.0)
    (patches, *compared) = here.parts
    assert patches.expected_rgb.shape == patches.found_rgb.shape
    assert all(isinstance(part, Residual) and part.found == part.expected for part in compared)
    assert (here.log_likelihood or 0.0) > (beside.log_likelihood or 0.0)


def test_the_kalman_filter_tells_its_innovation() -> None:
    """The density of a track's measurement is that of its normalised innovation squared and expected deviation."""
    look = looked_into("lg")
    *told, table = look.update_parts()
    row = look.run.current.diagnostics
    deviation = next(part.sd for part in told if isinstance(part, Residual))
    expected = -np.log(2.0 * np.pi * deviation**2) - 0.5 * row.number("nis")
    assert row.number("track_log_evidence") == pytest.approx(expected)
    assert (row.number("nis_freedom"), row.number("nis_limit")) == (2.0, 5.991465)
    distances = [numbers[2] for numbers in table.rows]
    assert distances == sorted(distances, reverse=True)
    assert len(table.arrows) == len(table.names) == 12


def test_another_track_has_other_particles() -> None:
    """Where the selection changes no particle has a parent, since those of the frame before are another track's."""
    run = Run(EXPERIMENT, EXPERIMENT.simulate(), tracker="lng", seed=2, frames=6)
    run.seek(3)
    run.change({"selected_track": 5})
    for frame, alone in ((4, True), (5, False)):
        run.seek(frame)
        assert (Inspection(run).cloud.ancestors is None) == alone  # type: ignore[union-attr] - there are particles


Picture = NDArray[np.uint8]


def texture(seed: int = 0, size: tuple[int, int] = (240, 180)) -> Picture:
    """A picture of rectangles in many greys."""
    return rectangles(np.random.default_rng(seed), size, size[0] * size[1] // 300)


BLANK = np.full((180, 240), 60, np.uint8)


def film(pictures: list[Picture], folder: Path) -> Path:
    for number, grey in enumerate(pictures):
        cv2.imwrite(str(folder / f"{number:03d}.png"), grey)
    return folder


def run_of(path: Path, tracker: str = "lg", *, start: int = 0, frames: int | None = None, **values: Any) -> Run:
    setup = EXPERIMENT.video.on_video(open_sequence(path), None, start=start)
    return Run(EXPERIMENT, setup, tracker=tracker, frames=frames, timeline=(Change(0, values),))


def report(path: Path, **options: Any) -> dict[str, Any]:
    run = run_of(path, **options)
    run.finish()
    return dict(EXPERIMENT.measured.report(run.diagnostics))  # type: ignore[misc]


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_a_moving_picture_is_followed_with_nothing_marked(tracker: str, tmp_path: Path) -> None:
    """From any picture on corners are found, and their smoothed positions move as the picture does."""
    wide = texture(size=(300, 180))
    run = run_of(film([wide[:, 2 * step : 2 * step + 240] for step in range(20)], tmp_path), tracker, start=4)
    state = run.finish().state
    moved = state.raw[0] - state.first
    assert state.raw.shape[1] == 100
    assert np.nanmedian(moved, axis=0).tolist() == [-30.0, 0.0]
    known = np.isfinite(moved[:, 0]) & (state.born == 0)
    assert np.abs(state.filtered[0] - state.raw[0])[known].max() < 2.0


def test_false_motion_is_that_of_what_rests(tmp_path: Path) -> None:
    """When something moves in a picture at rest, only what rests counts, though it is hidden for a while."""
    pictures = [texture() for _ in range(40)]
    for step, grey in enumerate(pictures):
        grey[60:100, 4 * step : 4 * step + 30] = texture(5)[:40, :30]
    found = report(film(pictures, tmp_path), corner_count=60)
    assert found["tracks"] <= 60
    assert found["false_motion_px"] < 1.0
    wrong = report(tmp_path, corner_count=60, largest_cost=255, new_corners=False)
    assert wrong["false_motion_px"] > 1.3 * found["false_motion_px"]


def test_nothing_is_claimed_of_motion_where_nothing_rests(tmp_path: Path) -> None:
    """A moving camera leaves no corner at rest, so no false motion is reported."""
    wide = texture(size=(300, 180))
    found = report(film([wide[:, 3 * step : 3 * step + 200] for step in range(24)], tmp_path))
    assert found["false_motion_px"] is None
    assert found["tracks"] > 20


@pytest.mark.parametrize("size", [(200, 150), (2, 300)])
def test_a_recording_without_corners_is_refused(size: tuple[int, int], tmp_path: Path) -> None:
    """A flat picture, one that is smaller than a template, and a margin that leaves no room are refused."""
    path = film([np.full(size[::-1], 90, np.uint8)] * 3, tmp_path)
    with pytest.raises(ValueError, match=rf"picture 0, {size[0]} x {size[1]} px, has no corner that can be followed"):
        run_of(path)
    with pytest.raises(ValueError, match="nearer to the edge than 150 px"):
        run_of(film([texture()] * 3, tmp_path), corner_margin_px=150).finish()


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_all_matches_may_be_wrong(tracker: str, tmp_path: Path) -> None:
    """From a cut on nothing is found: tracks end, are drawn as far as they are known, and new corners take over."""
    pictures = [texture()] * 3 + [BLANK] * 12 + [texture(9)] * 18
    run, seen = run_of(film(pictures, tmp_path), tracker, corner_count=20, sample_count=50), []
    for step in run:
        EXPERIMENT.draw(step, run.diagnostics)
        seen.append(np.isfinite(step.state.filtered[0]).all(axis=1).sum())
    assert [seen[frame] for frame in (2, 14, -1)] == [20, 0, 20]
    assert (run.current.state.born >= 20).any()
    assert run.diagnostics[14].number("seen_share") == 0.0


def test_the_search_is_shown_beside_the_picture(tmp_path: Path) -> None:
    """The world has the costs as a surface, the template and what was found; without pictures it says so."""
    run = run_of(film([texture()] * 3, tmp_path), search_reach_px=30)
    run.finish()
    world = world_of(run.current, "search")
    vertices = world["costs"].vertices
    assert len(vertices) == 41**2  # up to 20 px to all sides
    assert vertices[vertices[:, 2].argmax()] == pytest.approx([0.0, 0.0, 7.0])
    assert len(world["looked for"].vertices) == 4 * 11**2
    assert {"window", "template", "look-alikes"} <= EXPERIMENT.draw(run.current, run.diagnostics).primitives.keys()
    table = tmp_path / "path.csv"
    table.write_text("x,y\n1,2\n3,4\n5,6\n")
    assert [type(item) for item in world_of(run_of(table).current, "search").values()] == [Text]


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_a_corner_that_takes_a_place_at_once_begins_anew(tracker: str, tmp_path: Path) -> None:
    """In the very frame in which a corner is gone another may take over: of the old one nothing is left, in any row."""
    pictures = [texture()] * 101 + [BLANK] * 9 + [texture(9)]
    state = run_of(film(pictures, tmp_path), tracker, corner_count=20, sample_count=50).finish().state
    again = state.born == 110
    assert again.any()
    assert np.abs(state.filtered[0] - state.raw[0])[again].max() < 8.0
    assert np.isnan(state.history[0][:110, again]).all()
