"""Where a target is lost: by the truth, by marks and the tracker's own account, and where to look."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.analysis.counterfactuals import find_loss, what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.analysis.other_seeds import ensemble
from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Target
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import Loss, approach, loss_start, loss_words
from pftrack.runs.loss_probability import columns_of, loss_probabilities, measure_loss_probability
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthTable
from tests.experiments.head.heads import Pictures

BALL = find("ball")

FRAMES = 40


@cache
def film() -> tuple[list[NDArray[np.uint8]], list[Target]]:
    """Return the pictures of a ball that disappears behind a wide pillar, and where it truly is."""
    timeline = (Change(0, {"occlusion_width_px": 100, "period_s": 2}),)
    steps = list(Run(BALL, BALL.simulate(), frames=FRAMES, timeline=timeline))
    shown = [(step.frame.image_rgb, step.frame.target) for step in steps]
    return [image for image, _ in shown if image is not None], [target for _, target in shown if target is not None]


def on_clip(marked: Iterable[int] = (), tracker: str = "h-spf", experiment: Experiment = BALL) -> Run:
    """Return a finished run on that clip, whose truth is known of some pictures."""
    pictures, targets = film()
    boxes = [(*(target.position - 5), 11.0, 11.0) for target in targets]
    truth = TruthTable({frame: boxes[frame] for frame in marked}) if marked else None
    setup = experiment.video.on_video(Pictures(pictures), Box.of(*boxes[0]), truth=truth)
    run = Run(experiment, setup, tracker=tracker, frames=FRAMES)
    run.finish()
    return run


def test_no_probability_is_told_of_a_recording() -> None:
    """A tracker that has one in scenes tells none where it is not calibrated: no number, no column, no verdict."""
    run = on_clip()
    assert run.tracker in BALL.quality.loss_probability.models
    assert np.isnan(loss_probabilities(run)).all()
    assert not measure_loss_probability(run)
    assert "series_loss_probability" not in columns_of(run)
    assert set(Loss.of(run.diagnostics).witnesses) == {""}
    with pytest.raises(RefusedError):
        find_loss(run)
    assert "P(lost) is not calibrated on recordings" in diagnose(run).sentence


def test_marks_have_the_word_in_their_frames_alone() -> None:
    """Where a person has marked the target the truth says whether it is lost, elsewhere nobody does."""
    found = Loss.of(on_clip(marked=(0, 5, 30)).diagnostics)
    assert [frame for frame, witness in enumerate(found.witnesses) if witness] == [0, 5, 30]
    assert np.flatnonzero(found.lost).tolist() == [30]


def test_other_seeds_and_changes_are_judged_as_runs_that_are_opened() -> None:
    """What the runs of an ensemble and of what-if come to is what a branch with their settings says of itself."""
    run = on_clip(range(0, FRAMES, 3))
    *_, report = what_if(run, rounds=(1, 2))
    assert report.loss == find_loss(run)[0]
    known = [finding for finding in report.findings if finding.held]
    for finding in (known[0], known[1], known[-1]):
        for seed, held in finding.held.items():
            branch = run.branch(report.begin, {**finding.alternative.values, "seed": seed})
            branch.seek(report.end)
            settled = Loss.of(branch.diagnostics).lost[report.end - report.judged + 1 : report.end + 1]
            assert held == (not settled.any()), finding.alternative.title
    together = ensemble(run, runs=2, frames=20)
    twin = run.branch(0, {"seed": together.seeds[0]})
    twin.seek(19)
    assert np.array_equal(together.lost[0] == 1.0, Loss.of(twin.diagnostics).lost)


@pytest.mark.parametrize("experiment", ["ball", "histogram"])
def test_on_a_recording_held_means_inside_the_true_box(experiment: str) -> None:
    """Loss, hit rate and the share that decides on success have one threshold, in single runs and in batches."""
    run = on_clip(range(FRAMES), "condensation", find(experiment))
    inside = [np.abs(np.subtract(row.estimate, row.truth or ())).max() <= 5.5 for row in run.diagnostics]
    assert [not row.is_lost for row in run.diagnostics] == inside
    assert not all(inside)
    summary = run.summary()
    assert summary.hit_rate == summary.measures["inside_share"] == pytest.approx(np.mean(inside))
    ((row,),) = outcomes(run.experiment, run.setup, values={}, trackers=["condensation"], seeds=[0], frames=FRAMES)
    assert (row.lost_frames, row.first_lost_frame) == (inside.count(False), inside.index(False))


def test_a_loss_that_marks_tell_is_gone_back_from_to_the_last_that_held() -> None:
    """Nobody knows when it began after that mark; runs are judged by the marks."""
    run = on_clip(marked=(0, 9, 36))
    run.diagnostics = [replace(row, lost=row.frame == 36) if row.lost is not None else row for row in run.diagnostics]
    *_, report = what_if(run, 36, rounds=(1,))
    assert report.begin <= 9
    branch = run.branch(report.begin, {"seed": report.baseline.seed})
    branch.seek(report.end)
    assert [row.frame for row in branch.diagnostics if row.lost is not None] == [0, 9, 36]
    assert report.baseline.holding == (not branch.diagnostics[36].lost)


# Where to look when a target was lost.


def said(lost: list[bool], judged: int | None = None) -> Loss:
    """Return what the truth says of frames, of the first so many if not of all."""
    known = len(lost) if judged is None else judged
    return Loss(np.array(lost, np.bool_), tuple("truth" if frame < known else "" for frame in range(len(lost))))


Spans = list[tuple[int, int]]


def flags(*spans: tuple[int, int], frames: int = 100) -> list[bool]:
    return [any(first <= frame <= last for first, last in spans) for frame in range(frames)]


END = (60, 70)


@pytest.mark.parametrize(
    ("lost", "hidden", "frame", "expected"),
    [
        ([], [], 50, None),
        ([END], [], 99, 50),
        ([END], [], 0, 50),
        ([END, (80, 99)], [], 79, 50),
        ([END, (80, 99)], [], 80, 73),
        ([(4, 9)], [], 50, 2),
        ([(8, 9)], [], 50, 2),
        ([(13, 20)], [], 50, 3),
        ([(2, 9)], [], 50, 1),
        ([(0, 9)], [], 50, 0),
        ([END], [(40, 55)], 99, 30),
        ([END], [(10, 15)], 99, 50),
        ([END], [(10, 15), (58, 90)], 99, 48),
        ([END], [(61, 65)], 99, 50),
        ([END], [(5, 25)], 99, 2),
        ([END], [(50, 50), (54, 90)], 99, 44),
        ([END], [(0, 55)], 99, 58),
        ([END, (75, 99)], [], 99, 73),
        ([END, (73, 99)], [], 99, 50),
        ([(60, 62), (64, 66), (68, 99)], [], 99, 50),
        ([(20, 40), END], [(45, 55)], 99, 43),
    ],
)
def test_the_approach_to_a_loss(lost: Spans, hidden: Spans, frame: int, expected: int | None) -> None:
    """It leads to a frame with the target held for three: ten before the last loss, or before what hid it, or later."""
    assert said(flags(*lost)).approach(flags(*hidden), frame) == expected


def test_a_loss_is_watched_from_before_the_last_mark_that_held() -> None:
    """A mark tells that the target is lost by then; when that happened after the mark before it, nobody knows."""
    lost = flags((60, 60), frames=61)
    marks = Loss(np.array(lost, np.bool_), tuple("truth" if frame % 30 == 0 else "" for frame in range(61)))
    assert marks.approach(61 * [False], 60) == 30
    assert said(lost).approach(61 * [False], 60) == 50


@pytest.mark.parametrize(("loss", "frame"), [(0, 0), (1, 0), (2, 1), (3, 2), (12, 2), (13, 3), (40, 30)])
def test_a_frame_is_watched_from_ten_before_it(loss: int, frame: int) -> None:
    """Early in a run from the third frame, and never from the frame itself, unless it is the first."""
    assert approach(loss) == frame


def test_a_loss_goes_on_until_the_target_is_not_lost() -> None:
    """It begins with the first frame that is lost; one of which nobody says anything ends it."""
    lost = [False, True, True, None, False, False, True]
    found: list[int | None] = []
    for frame, one in enumerate(lost):
        found.append(loss_start(frame, found[-1] if found else None, lost=one))
    assert found == [None, 1, 1, None, None, None, 6]


@pytest.mark.parametrize(
    ("lost", "first", "lasting"),
    [
        (8 * [False] + 2 * [True] + [False] + 5 * [True] + [False], 8, 11),
        ([False, True, False, False, True], 1, 4),
        ([False, True, False, True, False], 1, 1),
        ([False], None, None),
        ([], None, None),
    ],
)
def test_the_loss_to_ask_about_is_the_first_that_lasts(lost: list[bool], first: object, lasting: object) -> None:
    """Five frames or to the end is lasting; failing that it is the first, and without a loss none."""
    assert (said(lost).first_lost_frame, said(lost).lasting) == (first, lasting)


def test_losses_are_spans_of_frames() -> None:
    """Each has its first and its last frame; of a frame in one the loss begins with the first."""
    two = said([True, False, True, True])
    assert (two.spans, said([]).spans) == ([(0, 0), (2, 3)], [])
    assert [two.begin(frame) for frame in range(4)] == [0, 1, 2, 2]


def test_a_target_is_held_at_the_end_if_it_is_lost_in_none_of_the_last_judged_frames() -> None:
    """Ten frames that somebody judges decide; where nobody judges any, nothing is known of the run."""
    for span, judged, held in (((80, 89), None, True), ((80, 90), None, False), ((50, 55), 60, False)):
        assert said(flags(span), judged).held_at_end is held
    nobody = said(flags(), judged=0)
    assert (nobody.held_at_end, nobody.lost_frames, nobody.witness) == (None, None, "")


def test_a_loss_has_one_sentence() -> None:
    """It names how many frames are lost and the first of them."""
    assert loss_words(60, 0, None) == "Never lost in 60 frames"
    assert loss_words(60, 12, 7) == "Lost in 12 of 60 frames, first in frame 7"
