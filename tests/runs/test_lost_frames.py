"""Where a target is lost: by the truth, by marks and the tracker's own account, and where to look."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pftrack.analysis.counterfactuals import find_loss, what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.analysis.other_seeds import ensemble
from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Target
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find
from pftrack.runs.loss import Loss, approach, loss_start, loss_words
from pftrack.runs.loss_probability import columns_of, loss_probabilities, measure_loss_probability
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthTable
from tests.experiments.head.heads import Pictures

BALL = find("ball")

FRAMES = 40


@cache
def film() -> tuple[list[np.ndarray], list[Target]]:
    """Return the pictures of a ball that disappears behind a wide pillar, and where it truly is."""
    timeline = (Change(0, {"occlusion_width_px": 100, "period_s": 2}),)
    steps = list(Run(BALL, BALL.simulate(), frames=FRAMES, timeline=timeline))
    shown = [(step.frame.image_rgb, step.frame.target) for step in steps]
    return [image for image, _ in shown if image is not None], [target for _, target in shown if target is not None]


def on_clip(marked: Iterable[int] = (), tracker: str = "h-spf") -> Run:
    """Return a finished run on that clip, whose truth is known of some pictures."""
    pictures, targets = film()
    boxes = [(*(target.position - 5), 11.0, 11.0) for target in targets]
    truth = TruthTable({frame: boxes[frame] for frame in marked}) if marked else None
    setup = BALL.video.on_video(Pictures(pictures), Box.of(*boxes[0]), truth=truth)
    run = Run(BALL, setup, tracker=tracker, frames=FRAMES)
    run.finish()
    return run


def test_a_recording_has_no_loss_probability() -> None:
    """A tracker that has one in scenes has none where it is not calibrated: no number, no column, no verdict."""
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
    """Where a person has marked the target the truth decides whether it is lost, elsewhere nobody does."""
    found = Loss.of(on_clip(marked=(0, 5, 30)).diagnostics)
    assert [frame for frame, witness in enumerate(found.witnesses) if witness] == [0, 5, 30]
    assert np.flatnonzero(found.lost).tolist() == [30]


def test_on_a_recording_held_means_inside_the_true_box() -> None:
    """Loss, hit rate and the share that decides on success have one threshold, in single runs and in batches."""
    run = on_clip(range(FRAMES), "condensation")
    inside = [np.abs(np.subtract(row.estimate, row.truth or ())).max() <= 5.5 for row in run.diagnostics]
    assert [not row.is_lost for row in run.diagnostics] == inside
    assert not all(inside)
    summary = run.summary()
    assert summary.hit_rate == summary.measures["inside_share"] == pytest.approx(np.mean(inside))
    ((row,),) = outcomes(run.experiment, run.setup, values={}, trackers=["condensation"], seeds=[0], frames=FRAMES)
    assert (row.lost_frames, row.first_lost_frame) == (inside.count(False), inside.index(False))


def test_other_seeds_and_changes_are_judged_by_the_marks() -> None:
    """Runs of an ensemble and of what-if have the verdicts of the branches with their settings.

    A loss is tried again from the last mark that held, since nobody knows when it began after that.
    """
    run = on_clip(marked=(0, 9, 36))
    run.diagnostics = [replace(row, lost=row.frame == 36) if row.lost is not None else row for row in run.diagnostics]
    *_, report = what_if(run, 36, rounds=(1,))
    assert report.begin <= 9
    branch = run.branch(report.begin, {"seed": report.baseline.seed})
    branch.seek(report.end)
    assert [row.frame for row in branch.diagnostics if row.lost is not None] == [0, 9, 36]
    assert report.baseline.holding == (not branch.diagnostics[36].lost)
    together = ensemble(run, runs=2, frames=20)
    twin = run.branch(0, {"seed": together.seeds[0]})
    twin.seek(19)
    assert np.array_equal(together.lost[0] == 1.0, Loss.of(twin.diagnostics).lost)


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
        ([END, (80, 99)], [], 80, 73),
        ([(4, 9)], [], 50, 2),
        ([(0, 9)], [], 50, 0),
        ([END], [(40, 55)], 99, 30),
        ([END], [(10, 15)], 99, 50),
        ([END], [(50, 50), (54, 90)], 99, 44),
        ([END], [(0, 55)], 99, 58),
        ([END, (75, 99)], [], 99, 73),
        ([(20, 40), END], [(45, 55)], 99, 43),
    ],
)
def test_the_approach_to_a_loss(lost: Spans, hidden: Spans, frame: int, expected: int | None) -> None:
    """It leads to a frame with the target held for three: ten before the last loss, or before what hid it, or later."""
    assert said(flags(*lost)).approach(flags(*hidden), frame) == expected


def test_a_loss_is_watched_from_ten_frames_before_it() -> None:
    """Early in a run it is from the third frame, and never from the frame itself, unless it is the first.

    A mark shows that the target is lost by then, at any frame after the mark before it.
    """
    frames = {0: 0, 1: 0, 2: 1, 3: 2, 12: 2, 13: 3, 40: 30}
    assert {loss: approach(loss) for loss in frames} == frames
    lost = flags((60, 60), frames=61)
    marks = Loss(np.array(lost, np.bool_), tuple("truth" if frame % 30 == 0 else "" for frame in range(61)))
    assert marks.approach(61 * [False], 60) == 30
    assert said(lost).approach(61 * [False], 60) == 50


@pytest.mark.parametrize(
    ("lost", "first", "lasting"),
    [
        (8 * [False] + 2 * [True] + [False] + 5 * [True] + [False], 8, 11),
        ([False, True, False, False, True], 1, 4),
        ([False, True, False, True, False], 1, 1),
        ([], None, None),
    ],
)
def test_the_loss_to_ask_about_is_the_first_that_lasts(lost: list[bool], first: object, lasting: object) -> None:
    """Five frames or to the end is lasting; failing that it is the first, and without a loss none."""
    assert (said(lost).first_lost_frame, said(lost).lasting) == (first, lasting)


def test_a_loss_has_spans_and_one_sentence() -> None:
    """A loss begins with the first frame that is lost; a frame without a verdict ends it.

    The target is held at the end if it is lost in none of the last ten frames with a verdict.
    """
    two = said([True, False, True, True])
    assert (two.spans, said([]).spans) == ([(0, 0), (2, 3)], [])
    assert [two.begin(frame) for frame in range(4)] == [0, 1, 2, 2]
    assert loss_words(60, 0, None) == "Never lost in 60 frames"
    assert loss_words(60, 12, 7) == "Lost in 12 of 60 frames, first in frame 7"
    since: list[int | None] = [None]
    for frame, lost in enumerate([False, True, True, None, False, True]):
        since.append(loss_start(frame, since[-1], lost=lost))
    assert since[1:] == [None, 1, 1, None, None, 5]
    ends = [said(flags((80, 89))), said(flags((80, 90))), said(flags((50, 55)), judged=60), said(flags(), judged=0)]
    assert [end.held_at_end for end in ends] == [True, False, False, None]
    assert (ends[3].lost_frames, ends[3].witness) == (None, "")
