"""Comparisons: which frames belong together, what differs, where runs part, and what one gains on another."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find
from pftrack.output.exports.comparisons import export_comparison
from pftrack.runs.comparison import Comparison, align
from pftrack.runs.run import Run
from tests.experiments.head.heads import Pictures

SINE, BALL, PRISM = find("sine"), find("ball"), find("prism")


def sine(frames: int = 40, seed: int = 4, tracker: str = "condensation", changes: tuple[Change, ...] = ()) -> Run:
    return Run(SINE, SINE.simulate(), tracker=tracker, seed=seed, frames=frames, timeline=changes)


def on_clip(start: int, frames: int) -> Run:
    """Return a run on a clip of 20 pictures of noise."""
    noise = np.random.default_rng(1).integers(0, 255, (20, 60, 80, 3), np.uint8)
    setup = BALL.video.on_video(Pictures(list(noise)), Box.of(30, 20, 21, 21), start=start)
    return Run(BALL, setup, frames=frames)


# ---------------------------------------------------------------- which frames


def test_runs_on_simulated_scenes_are_compared_frame_by_frame() -> None:
    """They have the frames of the shortest in common; one has nothing beside it, and five are too many to look at."""
    found = align([sine(30), sine(20), sine(25)])
    assert (found.frames, found.firsts) == (20, (0, 0, 0))
    # A change behind the frames that are compared, or to the value before, is not a difference.
    default = {"sample_count": SINE.simulate().parameters.sample_count}  # type: ignore[attr-defined]
    same = sine(changes=(Change(0, default), Change(5, default)))
    later = sine(60, changes=(Change(45, {"sample_count": 50}),))
    assert Comparison.of(sine(), same, later).settings == ()
    for count in (0, 1, 5):
        with pytest.raises(RefusedError, match=f"expected two to four runs to compare, got {count}"):
            align([sine()] * count)


def test_runs_on_one_recording_are_compared_picture_by_picture() -> None:
    """A run from picture 3 on is beside frame 3 of one from picture 0; without a common picture they are refused."""
    early, late = on_clip(0, 12), on_clip(3, 17)
    found = align([early, late])
    assert (found.frames, found.firsts) == (9, (3, 0))
    compared = Comparison.of(early, late).finish()
    assert (early.computed, late.computed) == (11, 8)
    assert [len(rows) for rows in compared.rows] == [9, 9]
    assert [rows[0].frame for rows in compared.rows] == [3, 0]
    assert [(it.name, it.values) for it in compared.settings] == [("start", ("0", "3"))]
    with pytest.raises(RefusedError, match=r"no picture of the recording in common.* 0 to 4, 10 to 19; compare"):
        align([on_clip(0, 5), on_clip(10, 10)])


# ---------------------------------------------------------------- what differs


def test_only_what_differs_is_listed_in_words() -> None:
    """Tracker, seed and parameters with their units, a change in mid-run with its frame, and nothing that is equal.

    Runs are called by their trackers, or by a parameter with its title, or by a number where nothing is special.
    """
    one = sine(changes=(Change(0, {"sample_count": 100}),))
    other = sine(seed=5, changes=(Change(0, {"sample_count": 50}), Change(7, {"tracker": "kalman"})))
    found = {it.name: it.values for it in Comparison.of(one, other).settings}
    tracker = TITLES[0], f"{TITLES[0]}, {TITLES[1]} from frame 7 on"
    assert found == {"tracker": tracker, "seed": ("4", "5"), "sample_count": ("100", "50")}
    for run, names in ((sine(tracker="kalman"), TITLES), (sine(seed=9), ("Seed 4", "Seed 9"))):
        assert Comparison.of(sine(), run).names == names
    assert Comparison.of(sine(), sine()).names == ("Run (1)", "Run (2)")
    assert len(set(Comparison.of(*[sine(seed=seed) for seed in range(4)]).colours)) == 4


TITLES = tuple(SINE.trackers[name].title for name in ("condensation", "kalman"))


def test_parameters_of_other_experiments_are_listed_where_somebody_has_set_them() -> None:
    """What follows from the experiments alone says nothing; a value that was set does, also where one lacks it."""
    histogram = find("histogram")
    other = Run(histogram, histogram.simulate(), frames=3)
    plain = Comparison.of(Run(BALL, BALL.simulate(), frames=3), other).settings
    wide = Run(BALL, BALL.simulate(), frames=3, timeline=(Change(0, {"slot_offset_px": 60}),))
    assert [it.name for it in plain] == ["experiment", "tracker"]
    [added] = set(Comparison.of(wide, other).settings) - set(plain)
    assert (added.name, added.values) == ("slot_offset_px", ("60 px", None))


# ---------------------------------------------------------------- where they part, and what is gained


def test_the_paired_difference_is_that_of_the_errors() -> None:
    """The second run's error minus the first's, over the frames that both have; for equal runs it has no interval.

    A branch parts from its run in the frame after it left; two runs of one recipe never part.
    """
    one, other = sine(60), sine(60, tracker="kalman")
    error, *_ = Comparison.of(one, other).finish().paired
    gains = [b.error - a.error for a, b in zip(one.diagnostics, other.diagnostics, strict=True)]  # type: ignore[operator]
    assert (error.name, error.frames, error.better) == ("error", 60, "lower")
    assert error.mean == pytest.approx(np.mean(gains))
    assert error.low < error.mean < error.high
    branch = one.branch(12, {"sample_count": 60})
    compared = Comparison.of(one, branch, sine(60)).finish()
    assert [(it.first, it.second, it.frame) for it in compared.partings] == [(0, 1, 13), (0, 2, None), (1, 2, 13)]
    assert compared.first_difference == 13
    equal = Comparison.of(one, sine(60)).finish()
    same, *_ = equal.paired
    assert (same.mean, equal.first_difference) == (0.0, None)
    assert np.isnan([same.low, same.high]).all()


def test_what_is_not_known_is_left_out() -> None:
    """Frames without truth and errors that are not finite are left out; JSON has no such numbers either.

    Steps are counted over all runs; those computed before are not repeated.
    """
    one, other = sine(), sine(tracker="kalman")
    one.finish()
    assert list(Comparison.of(one, other).computing()) == [(done, 80) for done in range(42, 81)]
    for run, frame, error in ((one, 3, None), (other, 4, np.inf)):
        run.diagnostics[frame] = dataclasses.replace(run.diagnostics[frame], error=error)
    compared = Comparison.of(one, other)
    assert compared.paired[0].frames == 38
    told = json.loads(json.dumps(compared.as_dict(), allow_nan=False))
    assert told["outcomes"][1]["mean_error"] is None
    assert told["frames"] == 40


def test_success_and_loss_are_compared() -> None:
    """A tracker that is lost for some frames keeps fewer of them; the first loss is shown from before it was hidden.

    Both trackers lose the ball behind a wide pillar, the first 5 frames after frame 16, and the second finds it again.
    """
    values = (Change(0, {"sample_count": 100, "occlusion_width_px": 150, "period_s": 4}),)
    trackers = "h-spf", "kalman"
    runs = [Run(BALL, BALL.simulate(), tracker=name, seed=7, frames=50, timeline=values) for name in trackers]
    poor = Comparison.of(*runs).finish()
    assert [it.first_lost_frame for it in poor.outcomes] == [21, 22]
    assert poor.before_loss == 6
    kept = [1 - run.summary().verdict.lost_frames / run.frames for run in poor.runs]  # type: ignore[operator]
    assert [it.success_share for it in poor.outcomes] == pytest.approx(kept)
    [share] = [it for it in poor.paired if it.name == "hit_rate"]
    assert share.mean == pytest.approx(kept[1] - kept[0]) == pytest.approx(0.12)


# ---------------------------------------------------------------- files


def test_files_of_a_comparison_on_a_clip_count_both_frames(tmp_path: Path) -> None:
    """Frames as they are compared and as each run counts; without truth there is no error, and nothing to draw."""
    compared = Comparison.of(on_clip(0, 12), on_clip(3, 17)).finish()
    export_comparison(compared, tmp_path / "both.csv")
    lines = (tmp_path / "both.csv").read_text().splitlines()
    assert lines[0] == "run,name,frame,frame_of_run,error,lost"
    assert lines[1] == "1,Begins at picture 0,0,3,,0"
    assert lines[-1].startswith("2,Begins at picture 3,8,8,,")
    export_comparison(compared, tmp_path / "both.json")
    told = json.loads((tmp_path / "both.json").read_text())
    assert [run["recipe"]["frames"] for run in told["runs"]] == [12, 17]
    assert told["settings"] == compared.as_dict()["settings"]
    with pytest.raises(ConflictError, match="no error can be drawn"):
        export_comparison(compared, tmp_path / "both.png")
    with pytest.raises(ConflictError, match=r"can be exported as \.csv, \.png, \.svg, \.json; got 'both.docx'"):
        export_comparison(compared, tmp_path / "both.docx")
