"""The experiment of a chain of links: its presets, report and findings, bad values, drawings and recordings."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import FrameSequence
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.linkage.experiment import LinkagePoints, direction_error, guess
from pftrack.experiments.linkage.scene import NAMES, places
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.tracks import write
from tests.arm import FRAMES, film, joints
from tests.making import whole_run

LINKAGE = find("linkage")


@cache
def rows(preset: str) -> tuple[Diagnostics, ...]:
    chosen = LINKAGE.preset_named(preset)
    return tuple(whole_run(LINKAGE, values=chosen.parameters, tracker=chosen.tracker, seed=chosen.seed).diagnostics)


def errors(preset: str) -> list[float]:
    return [row.error or 0.0 for row in rows(preset)]


def refuted(preset: str) -> list[int]:
    return [row.frame for row in rows(preset) if row.number("refuted")]


@pytest.mark.parametrize(("preset", "split", "end"), [("mirror3", 63, 75), ("mirror2", 50, 54)])
def test_regions_split_and_one_is_refuted_in_the_named_frames(preset: str, split: int, end: int) -> None:
    """There are two regions between these frames, one after them, and they always contain the truth."""
    found = rows(preset)
    assert ([row.frame for row in found if row.number("split")], refuted(preset)) == ([split], [end])
    assert {row.number("hypothesis_count") for row in found[split:end]} == {2.0}
    assert {row.number("hypothesis_count") for row in found[end:]} == {1.0}
    assert {row.number("contained") for row in found} == {1.0}


def test_a_filter_follows_both_sides_until_bounds_refute_one() -> None:
    """The wrong side is ahead up to frame 35; from frame 36 on the estimate is within 5 degrees."""
    found = errors("cross")
    assert min(found[27:36]) > 30.0
    assert max(found[36:]) < 5.0
    assert refuted("cross") == [38, 39]


def test_a_filter_is_sure_of_a_wrong_length_and_a_region_is_not() -> None:
    """From the same frames the filter gives half a pixel about 48 px, the region 14 px that contain the true 50."""
    (low, high), (least, most) = (rows(preset)[-1].vector("length_3") for preset in ("static", "static-regions"))
    assert round(low) == round(high) == 48
    assert 0.3 < high - low < 0.6
    assert 13.0 < most - least < 15.0
    assert least < 50.0 < most


def test_lengths_in_space_are_found_within_a_pixel() -> None:
    """All three lengths, at the end of the preset."""
    found = np.array([rows("3d")[-1].vector(f"length_{link}") for link in (1, 2, 3)])
    assert np.abs(found - [[68.0], [58.0], [48.0]]).max() < 1.0


def test_a_region_is_lost_when_it_excludes_the_truth_and_a_filter_by_its_error() -> None:
    """The middle of a region may be far off without a loss; the report has containment of regions only."""
    assert max(errors("mirror3")) > 11.5
    assert not any(row.lost for row in rows("mirror3"))
    assert [row.lost for row in rows("cross")] == [error > 11.5 for error in errors("cross")]
    found = LINKAGE.measured.report(rows("mirror3"))
    assert found["contained_share"] == 1.0
    assert np.shape(found["intervals_px"]) == (3, 2)
    assert found["max_angle_error_rad"] == pytest.approx(np.deg2rad(max(errors("mirror3"))))
    assert "contained_share" not in LINKAGE.measured.report(rows("cross"))


def test_bands_of_lengths_are_right_in_the_default_scene_alone() -> None:
    """Those of particles are uncalibrated with known noise and on other paths."""
    default = LINKAGE.simulate().parameters
    settings = (default, *(revise(default, it) for it in ({"noise_unknown": False}, {"chain_path": "3d"})))
    found = [LINKAGE.findings("particles", it)["lengths"] for it in settings]
    assert found == ["right", "uncalibrated", "uncalibrated"]


def test_errors_of_directions_are_those_of_vectors() -> None:
    """A turn of one joint turns all that follow; in space a rotation turns all alike, and a full turn none."""
    straight = np.array([10.0, 20.0, 30.0, 70.0, 60.0, 50.0])
    for change, error in (([0, 5, 10, 0, 0, 0], 15.0), ([360, 0, 0, 0, 0, 0], 0.0)):
        assert direction_error(straight + np.array(change), straight) == pytest.approx(error, abs=1e-9)
    space = np.concatenate([np.zeros(5), straight - np.array([10.0, 0, 0, 0, 0, 0])])
    turned = space + np.array([0.0, 0.0, 25.0, *np.zeros(8)])
    np.testing.assert_allclose(direction_error(np.stack([turned, space]), space), [25.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("preset", ["cross", "3d"])
def test_particles_are_drawn_around_the_estimate(preset: str) -> None:
    """Both worlds show a cloud, of joints in depth and of lengths, where the estimate is."""
    values = {**LINKAGE.preset_named(preset).parameters, "sample_count": 60}
    run = whole_run(LINKAGE, values=values, tracker="particles", seed=1, frames=2)
    worlds = LINKAGE.draw(run.current, run.diagnostics).worlds
    for world, name, size in zip(worlds, ("joints", "estimate"), (0.4, 2.0), strict=True):
        cloud, estimate = world.primitives["particles"], world.primitives[name]
        assert 20 < len(cloud.positions) <= 300
        apart = np.linalg.norm(cloud.positions[:, None] - estimate.positions[None], axis=2).min(axis=1)
        assert np.median(apart) < size


# Recordings: marked points are followed, a table's tracks are taken, and bad marks are refused.

on_video = LINKAGE.video.on_video
Numbers = NDArray[np.float64]
COURSE = np.array([joints(index) for index in range(FRAMES)])


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The film of an arm."""
    path = tmp_path_factory.mktemp("arm") / "arm.mp4"
    film(path)
    return path


def marked(points: Numbers) -> LinkagePoints:
    return LinkagePoints.read({"points": dict(zip(NAMES, points.tolist(), strict=False))})


def wired(path: Path, mark: LinkagePoints | None = None, **options: Any) -> Run:
    """A run on a recording, whose mark is where the arm's points are."""
    return Run(LINKAGE, on_video(open_sequence(path), mark or marked(joints(0))), seed=0, **options)


def test_marked_points_are_followed_until_they_leave(arm: Path) -> None:
    """Each is found within a pixel of where it is; the root leaves the picture, is not seen, and the rest continues.

    A later picture that is looked at first has the same points.
    """
    run = wired(arm)
    for step in run:
        index, measured = step.diagnostics.frame, step.frame.measurements
        known = np.asarray(np.isfinite(measured.points_px).all(axis=1))
        assert known[1:].all()
        assert known[0] == (joints(index)[0, 0] > 8.5) or abs(joints(index)[0, 0] - 8.5) < 2.0
        assert np.abs(measured.points_px - joints(index))[known].max() < 1.0, index
        assert np.isinf(measured.sd_px[~known]).all()
    assert "not seen: root" in LINKAGE.draw(run.current, run.diagnostics).caption
    assert [len(run.diagnostics[-1].vector(f"length_{link}") or ()) for link in (1, 2, 3)] == [2, 2, 2]
    late, history = wired(arm).source, run.timeline.history
    late.frame(15, history)
    one, other = (source.frame(9, history).measurements.points_px for source in (run.source, late))
    np.testing.assert_array_equal(one, other)
    # A link is at least about as long as it looks, and at most twice as long.
    bounds = run.parameters_at(0).model_dump()
    assert [bounds[f"length_{link}_{end}_px"] for link in (1, 3) for end in ("low", "high")] == [27, 64] * 2


def test_an_occluder_hides_points_of_a_recording(arm: Path) -> None:
    """What is behind the strip is not measured, and found again where it comes out."""
    for step in wired(arm, timeline=(Change(0, {"occlusion_width_px": 60}),)):
        measured, true = step.frame.measurements, joints(step.diagnostics.frame)
        hidden = np.asarray(np.isnan(measured.points_px).any(axis=1))
        np.testing.assert_array_equal(hidden[1:], ((true[:, 0] >= 90.0) & (true[:, 0] < 150.0))[1:])


def table(folder: Path, points: Numbers, names: list[str]) -> FrameSequence:
    path = folder / "tracks.csv"
    path.write_text(write(names, points, np.ones_like(points)), encoding="utf-8")
    return open_sequence(path)


def test_tracks_of_four_points_need_no_mark(tmp_path: Path) -> None:
    """Their order is that of the table; a gap in it is a point that was not seen."""
    points = 2.0 * COURSE + np.array([80.0, 20.0])
    points[5, 2] = np.nan
    run = Run(LINKAGE, on_video(table(tmp_path, points, list(NAMES)), None), seed=0)
    for step in run:
        np.testing.assert_allclose(step.frame.measurements.points_px, points[step.diagnostics.frame], atol=1e-3)
        caption = LINKAGE.draw(step, run.diagnostics).caption
        assert ("not seen: third joint" in caption) == (step.diagnostics.frame == 5)


def test_tracks_among_others_are_told_by_the_mark(tmp_path: Path) -> None:
    """The track nearest to each mark is taken, and a mark without one is refused; without a mark four are needed."""
    moved = 2.0 * COURSE + np.array([80.0, 20.0])
    strangers = np.broadcast_to(np.array([[300.0, 30.0], [20.0, 250.0]]), (FRAMES, 2, 2))
    sequence = table(tmp_path, np.concatenate([strangers, moved[:, ::-1]], axis=1), list("abcdef"))
    run = Run(LINKAGE, on_video(sequence, marked(moved[0] + 3.0)), seed=0).finish()
    np.testing.assert_allclose(run.frame.measurements.points_px, moved[-1], atol=1e-3)
    for mark, said in (
        (marked(moved[0] - [0.0, 40.0]), "within 12 px of a track"),
        (marked(moved[0][:3]), "marked: root, both joints and the tip are needed"),
        (None, "tracks of 4 points"),
    ):
        with pytest.raises(ParameterError, match=said):
            on_video(sequence, mark)


def test_a_mark_in_px_of_a_scaled_table_is_refused_with_where_its_track_is(tmp_path: Path) -> None:
    """A table of a large picture is scaled to a smaller one, and so must its marks be."""
    moved = 8.0 * COURSE + np.array([500.0, 100.0])
    sequence = table(tmp_path, moved, list("abcd"))
    where = rf"within 12 px .* 'd', is at \(.*\) in px of the picture of {sequence.size[0]} x {sequence.size[1]} px"
    with pytest.raises(ParameterError, match=where):
        on_video(sequence, marked(moved[0]))
    (warning,) = sequence.index.warnings
    assert warning.endswith("Marks and lengths are in px of that picture.")


def test_a_link_without_length_is_refused(arm: Path) -> None:
    """Two marks in one place give no information on a link."""
    with pytest.raises(ParameterError, match="at least 4 px"):
        wired(arm, marked(joints(0)[[0, 0, 2, 3]]))


def test_the_guess_is_seen_at_the_marks() -> None:
    """Whatever the points, the chain that is guessed has just these as its image, and is longer than it looks."""
    for seed in range(20):
        points = 100.0 * Stream(seed, 0, Purpose.SCENE).random((4, 2))
        chain = guess(points)
        np.testing.assert_allclose(places(chain)[:, :2] + chain.origin_px, points, atol=1e-9)
        assert (chain.r >= np.linalg.norm(np.diff(points, axis=0), axis=1) - 1e-9).all()
        np.testing.assert_allclose(chain.reference.T @ chain.reference, np.eye(3), atol=1e-12)
        assert np.linalg.det(chain.reference) > 0.0


def test_particles_do_not_become_sure_of_a_wrong_length(arm: Path) -> None:
    """In space little memory keeps them apart: all links are 32 px long, within a pixel of what is held possible."""
    row = wired(arm, tracker="particles", timeline=(Change(0, {"sample_count": 100}),)).finish().diagnostics
    for low, high in (row.vector(f"length_{link}") for link in (1, 2, 3)):
        assert low - 1.0 < 32.0 < high + 1.0
