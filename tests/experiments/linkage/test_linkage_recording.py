"""A chain on a recording: marked points are followed, a table's tracks are taken, and bad marks are refused."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.recipe import Change
from pftrack.core.model.source import FrameSequence, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.linkage.experiment import LinkagePoints, guess
from pftrack.experiments.linkage.scene import NAMES, places
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.tracks import write
from tests.arm import FRAMES, film, joints

LINKAGE = find("linkage")
on_video = LINKAGE.video.on_video


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The film of an arm."""
    path = tmp_path_factory.mktemp("arm") / "arm.mp4"
    film(path)
    return path


def opened(path: Path) -> FrameSequence:
    return open_sequence(path)


def marked(points: NDArray[np.float64]) -> LinkagePoints:
    return LinkagePoints.read({"points": dict(zip(NAMES, points.tolist(), strict=True))})


def seen(run: Run) -> Measurements:
    measured = run.current.frame.measurements
    assert measured is not None
    return measured


def test_marked_points_are_followed_until_they_leave(arm: Path) -> None:
    """Each is found within a pixel of where it is; the root leaves the picture, is not seen, and the rest goes on."""
    setup = on_video(opened(arm), marked(joints(0)))
    run = Run(LINKAGE, setup, seed=0)
    for step in run:
        index, measured = step.diagnostics.frame, step.frame.measurements
        known = np.asarray(np.isfinite(measured.points_px).all(axis=1))
        assert known[1:].all()
        assert known[0] == (joints(index)[0, 0] > 8.5) or abs(joints(index)[0, 0] - 8.5) < 2.0
        assert np.abs(measured.points_px - joints(index))[known].max() < 1.0, index
        assert np.isinf(measured.sd_px[~known]).all()
    assert "not seen: root" in LINKAGE.draw(run.current, run.diagnostics).caption
    assert [len(run.diagnostics[-1].vector(f"length_{link}") or ()) for link in (1, 2, 3)] == [2, 2, 2]


def test_frames_of_a_recording_do_not_depend_on_the_order(arm: Path) -> None:
    """A later picture that is looked at first has the points that it has after all others."""
    mark = marked(joints(0))
    straight, jumping = (Run(LINKAGE, on_video(opened(arm), mark), seed=0) for _ in range(2))
    straight.finish()
    jumping.seek(15)
    for run in (straight, jumping):
        run.seek(9)
    np.testing.assert_array_equal(seen(jumping).points_px, seen(straight).points_px)


def test_an_occluder_hides_points_of_a_recording(arm: Path) -> None:
    """What is behind the strip is not measured, and found again where it comes out."""
    strip = Change(0, {"occlusion_width_px": 60})
    run = Run(LINKAGE, on_video(opened(arm), marked(joints(0))), seed=0, timeline=(strip,))
    for step in run:
        measured, true = step.frame.measurements, joints(step.diagnostics.frame)
        hidden = np.asarray(np.isnan(measured.points_px).any(axis=1))
        np.testing.assert_array_equal(hidden[1:], ((true[:, 0] >= 90.0) & (true[:, 0] < 150.0))[1:])


def test_bounds_come_from_the_mark(arm: Path) -> None:
    """A link is at least about as long as it looks, and at most twice as long."""
    parameters = on_video(opened(arm), marked(joints(0))).parameters
    assert (parameters.length_1_low_px, parameters.length_1_high_px) == (27, 64)
    assert (parameters.length_3_low_px, parameters.length_3_high_px) == (27, 64)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (joints(0) + np.array([300.0, 0.0]), "within the picture"),
        (joints(0)[[0, 0, 2, 3]], "at least 4 px"),
        (joints(0)[[0, 1, 3, 3]], "tip"),
    ],
)
def test_bad_marks_are_refused(arm: Path, points: NDArray[np.float64], said: str) -> None:
    """A point outside the picture and a link without length are refused with a sentence that names the point."""
    with pytest.raises(ParameterError, match=said):
        on_video(opened(arm), marked(points))


def test_a_mark_needs_all_points(arm: Path) -> None:
    """A point that is left out is named."""
    few = LinkagePoints.read({"points": {name: [10.0 * place, 20.0] for place, name in enumerate(NAMES[:3], 1)}})
    with pytest.raises(ParameterError, match="tip"):
        on_video(opened(arm), few)


def table(folder: Path, points: NDArray[np.float64], names: list[str]) -> FrameSequence:
    path = folder / "tracks.csv"
    path.write_text(write(names, points, np.ones_like(points)), encoding="utf-8")
    return open_sequence(path)


def test_tracks_of_four_points_need_no_mark(tmp_path: Path) -> None:
    """Their order is that of the table; a gap in it is a point that was not seen."""
    points = 2.0 * np.array([joints(index) for index in range(FRAMES)]) + np.array([80.0, 20.0])
    points[5, 2] = np.nan
    run = Run(LINKAGE, on_video(table(tmp_path, points, list(NAMES)), None), seed=0)
    for step in run:
        measured = step.frame.measurements
        np.testing.assert_allclose(measured.points_px, points[step.diagnostics.frame], atol=1e-3)
        caption = LINKAGE.draw(step, run.diagnostics).caption
        assert ("not seen: third joint" in caption) == (step.diagnostics.frame == 5)


def test_tracks_among_others_are_told_by_the_mark(tmp_path: Path) -> None:
    """The track nearest to each mark is taken, and a mark without one is refused; without a mark four are needed."""
    moved = 2.0 * np.array([joints(index) for index in range(FRAMES)]) + np.array([80.0, 20.0])
    strangers = np.broadcast_to(np.array([[300.0, 30.0], [20.0, 250.0]]), (FRAMES, 2, 2))
    sequence = table(tmp_path, np.concatenate([strangers, moved[:, ::-1]], axis=1), list("abcdef"))
    run = Run(LINKAGE, on_video(sequence, marked(moved[0] + 3.0)), seed=0).finish()
    measured = run.frame.measurements
    np.testing.assert_allclose(measured.points_px, moved[-1], atol=1e-3)
    with pytest.raises(ParameterError, match="within 12 px of a track"):
        on_video(sequence, marked(moved[0] - np.array([0.0, 40.0])))
    with pytest.raises(ParameterError, match="tracks of 4 points"):
        on_video(sequence, None)


def test_a_mark_in_px_of_a_scaled_table_is_refused_with_where_its_track_is(tmp_path: Path) -> None:
    """A table of a large picture is scaled to a smaller one, and so must its marks be."""
    moved = 8.0 * np.array([joints(index) for index in range(FRAMES)]) + np.array([500.0, 100.0])
    sequence = table(tmp_path, moved, list("abcd"))
    where = rf"within 12 px .* 'd', is at \(.*\) in px of the picture of {sequence.size[0]} x {sequence.size[1]} px"
    with pytest.raises(ParameterError, match=where):
        on_video(sequence, marked(moved[0]))
    (warning,) = sequence.index.warnings
    assert warning.endswith("Marks and lengths are in px of that picture.")


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
    run = Run(LINKAGE, on_video(opened(arm), marked(joints(0))), tracker="particles", seed=0)
    run.finish()
    for link in (1, 2, 3):
        interval = run.diagnostics[-1].vector(f"length_{link}")
        assert interval[0] - 1.0 < 32.0 < interval[1] + 1.0
