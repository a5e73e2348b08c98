"""A chain on a recording: marked points are followed, a table's tracks are taken, and bad marks are refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.recipe import Change
from pftrack.core.model.source import FrameSequence
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
    """Each is found within a pixel of where it is; the root leaves the picture, is not seen, and the rest goes on."""
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
    # A link is at least about as long as it looks, and at most twice as long.
    bounds = run.parameters_at(0).model_dump()
    assert [bounds[f"length_{link}_{end}_px"] for link in (1, 3) for end in ("low", "high")] == [27, 64] * 2


def test_frames_of_a_recording_do_not_depend_on_the_order(arm: Path) -> None:
    """A later picture that is looked at first has the points that it has after all others."""
    straight, jumping = (wired(arm) for _ in range(2))
    straight.finish()
    jumping.seek(15)
    one, other = (run.seek(9).frame.measurements.points_px for run in (straight, jumping))
    np.testing.assert_array_equal(one, other)


def test_an_occluder_hides_points_of_a_recording(arm: Path) -> None:
    """What is behind the strip is not measured, and found again where it comes out."""
    for step in wired(arm, timeline=(Change(0, {"occlusion_width_px": 60}),)):
        measured, true = step.frame.measurements, joints(step.diagnostics.frame)
        hidden = np.asarray(np.isnan(measured.points_px).any(axis=1))
        np.testing.assert_array_equal(hidden[1:], ((true[:, 0] >= 90.0) & (true[:, 0] < 150.0))[1:])


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (joints(0) + np.array([300.0, 0.0]), "within the picture"),
        (joints(0)[[0, 0, 2, 3]], "at least 4 px"),
        (joints(0)[[0, 1, 3, 3]], "tip"),
        (joints(0)[:3], "tip"),
    ],
)
def test_bad_marks_are_refused(arm: Path, points: Numbers, said: str) -> None:
    """A point outside the picture, a link without length and a missing point are refused, and the point is named."""
    with pytest.raises(ParameterError, match=said):
        wired(arm, marked(points))


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
    for mark, said in ((marked(moved[0] - [0.0, 40.0]), "within 12 px of a track"), (None, "tracks of 4 points")):
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
    row = wired(arm, tracker="particles").finish().diagnostics
    for low, high in (row.vector(f"length_{link}") for link in (1, 2, 3)):
        assert low - 1.0 < 32.0 < high + 1.0
