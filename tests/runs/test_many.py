from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.band import Calibration
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import Measure
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.shared.loss_probability import NOTHING_DECLARED
from pftrack.runs import many, scoring
from pftrack.runs.loss_probability import loss_probabilities
from pftrack.runs.run import Run
from tests.experiments.head.heads import Pictures, pictures
from tests.making import whole_run

CONDITION: dict[str, Value] = {"occlusion_width_px": 55, "distracter_radius_px": 11, "layout": 3, "sample_count": 120}
BALL = find("ball")
Row = list[many.Outcome]


def live(tracker: str, seed: int, values: Mapping[str, Value], frames: int = 60) -> Run:
    return whole_run(BALL, tracker=tracker, seed=seed, frames=frames, values=values)


def batch(trackers: list[str], seeds: list[int], frames: int, ball: Experiment = BALL, **more: Any) -> list[Row]:
    """Return the outcomes of runs of the ball, without the times that their steps took."""
    given = {"values": CONDITION, "trackers": trackers, "seeds": seeds, "frames": frames, **more}
    rows = many.outcomes(ball, ball.simulate(), **given)
    return [[replace(outcome, step_ms=0.0) for outcome in row] for row in rows]


@pytest.mark.parametrize(
    "extra",
    [
        {"image_noise_sd": 6, "learn_dynamics": True},
        {"apf_weights": "corrected", "resampling": "stratified", "resampling_threshold": 0.5},
        {"apf_weights": "balanced", "resampling": "residual"},
        {"resampling": "multinomial", "background_level": 0},
        {"colour_model": "chromaticity", "smoothing_lag_frames": 5},
        {"sample_count": 1},
        {"gamma_px": 0, "gamma_min_px": 0, "gamma_max_px": 0},
    ],
)
def test_a_batch_has_the_numbers_of_live_runs(extra: dict[str, Value]) -> None:
    """Every figure of every run is that of the live run with the same seed, the estimates to the bit."""
    values = {**CONDITION, **extra}
    trackers = [name for name, tracker in BALL.trackers.items() if tracker.fold]
    rows = many.outcomes(BALL, BALL.simulate(), values=values, trackers=trackers, seeds=[3, 4], frames=16)
    for seed, row in zip((3, 4), rows, strict=True):
        for tracker, outcome in zip(trackers, row, strict=True):
            run = live(tracker, seed, values, 16)
            summary = run.summary().as_dict()
            names = ("success", "mean_error", "lost_frames", "first_lost_frame", "labelled_frames", "estimates_sha256")
            assert {name: getattr(outcome, name) for name in names} == {name: summary[name] for name in names}
            assert outcome.reductions == scoring.reductions(BALL.all_series(tracker), run.diagnostics[1:])


def test_a_batch_has_the_measures_on_request() -> None:
    """The mean probability of a loss is that of the live run, of trackers that have one; nothing else changes for it.

    A measure of one study is of the frames that the study counts, whether a tracker takes many at once or not. An
    experiment with its own notion of a miss is judged by it, though a fold knows places alone.
    """
    runs = [live(name, 3, CONDITION, 40) for name in ("h-spf", "kalman")]
    told = [loss_probabilities(run) for run in runs]
    (silent,) = batch(["h-spf", "kalman"], [3], 40)
    (every,) = batch(["h-spf", "kalman"], [3], 40, loss_probability=True)
    for plain, asked, values in zip(silent, every, told, strict=True):
        assert asked.measures == {**plain.measures, "mean_loss_probability": pytest.approx(np.nanmean(values))}
        assert replace(asked, measures=plain.measures) == plain
    counted = np.arange(40) >= 20
    late = Measure("late_error", "Late", "Mean error.", "median", lambda run: np.where(counted, run.errors, np.nan))
    (row,) = batch(["h-spf", "kalman"], [3], 40, measures=[late])
    for run, outcome in zip(runs, row, strict=True):
        errors = [step.error or 0.0 for step in run.diagnostics[20:]]
        assert outcome.measures["late_error"] == pytest.approx(np.median(errors))
    unable = replace(BALL, quality=replace(BALL.quality, loss_probability=NOTHING_DECLARED))
    assert batch(["h-spf"], [3], 40, unable, loss_probability=True) == [silent[:1]]
    assert BALL.trackers["h-spf"].fold is not None
    missing = replace(BALL, judge=replace(BALL.judge, missed=lambda _state, _target: True))
    ((outcome,),) = batch(["h-spf"], [1], 4, missing, values={})
    assert (outcome.labelled_frames, outcome.lost_frames, outcome.first_lost_frame) == (4, 4, 0)


def test_blocks_of_pictures_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run too long for memory is taken in several blocks, to the same numbers."""
    whole = batch(["h-spf", "s-spf"], [1, 2], 20)
    for held in (1, 7):
        monkeypatch.setattr(many, "BLOCK_BYTES", held * 320 * 240 * 3)
        assert batch(["h-spf", "s-spf"], [1, 2], 20) == whole


def test_a_short_recording_ends_earlier_for_every_tracker() -> None:
    """Every tracker ends with the recording, also one that takes its frames one by one; one frame is enough."""
    [[outcome]] = batch(["h-spf"], [0], 1)
    assert (outcome.labelled_frames, outcome.success) == (1, True)
    setup = BALL.video.on_video(Pictures(pictures(5, width=160)), Box.of(40, 30, 30, 40))  # it takes them
    trackers = ["h-spf", "kalman"]
    assert BALL.trackers["kalman"].fold is None
    (row,) = many.outcomes(BALL, setup, values={}, trackers=trackers, seeds=[1], frames=60)
    for tracker, outcome in zip(trackers, row, strict=True):
        run = Run(BALL, setup, tracker=tracker, seed=1)
        run.finish()
        assert run.frames == 5
        assert outcome.estimates_sha256 == run.estimates_sha256


def test_an_estimate_that_is_none_is_no_success() -> None:
    """A tracker whose estimates are NaN beside a known truth has lost its target."""
    tracker = BALL.trackers["condensation"]

    def fold(*given: Any) -> Any:
        done = tracker.fold(*given)  # type: ignore[misc] # this one has it
        estimates = done.estimates.copy()
        estimates[3:] = np.nan
        return replace(done, estimates=estimates)

    ball = replace(BALL, trackers={"condensation": replace(tracker, fold=fold)}, quality=Quality(Calibration()))
    ((outcome,),) = batch(["condensation"], [1], 8, ball, values={})
    assert (outcome.labelled_frames, outcome.lost_frames, outcome.first_lost_frame) == (8, 4, 4)
    assert (outcome.success, outcome.mean_error, outcome.measures["frames_to_failure"]) == (False, None, 4)


def test_runs_side_by_side_are_live_runs_and_end_where_asked() -> None:
    """Whole runs on shared frames have the numbers of live runs; each is shown in every frame until it ends."""
    hand_made = BALL.simulate()
    setup = replace(hand_made, parameters=revise(hand_made.parameters, CONDITION))
    looked: dict[tuple[str, int], list[float | None]] = {}

    def watch(run: Run) -> bool:
        looked.setdefault((run.tracker, run.seed), []).append(run.current.diagnostics.error)
        return run.seed == 4 and run.position == 7

    for run in many.side_by_side(BALL, setup, [("h-spf", 3), ("kalman", 3), ("h-spf", 4)], frames=20, watch=watch):
        assert run.computed == (7 if run.seed == 4 else 19)
        alone = live(run.tracker, run.seed, CONDITION, run.computed + 1)
        assert run.estimates_sha256 == alone.estimates_sha256
        assert looked[run.tracker, run.seed] == [row.error for row in alone.diagnostics]
    assert len(looked) == 3


def test_pictures_of_a_block_are_kept_once() -> None:
    """They lie together, and frames share them. A single one stays the same array, since results are kept by it."""
    setup = BALL.simulate()
    source = setup.open_source(1, setup.parameters)
    history = History(((0, setup.parameters),))
    (block,) = many.read_blocks(source, history, 0, 4, shortest=5)
    for place, frame in enumerate(block.frames):
        assert np.shares_memory(frame.picture, block.pictures_rgb[place])
        assert np.array_equal(frame.picture, source.frame(place, history).picture)
        assert not frame.picture.flags.writeable
    one = source.frame(2, history)
    assert many.FrameBlock((one,), 1, 2).frames[0].picture is one.picture
