"""On a recording marks and the tracker's own account say where the target is lost."""

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
from pftrack.runs.loss import Loss
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


def on_clip(marked: tuple[int, ...] = (), tracker: str = "h-spf", frames: int = FRAMES) -> Run:
    """Return a finished run on that clip, whose truth is known of some pictures."""
    pictures, targets = film()
    boxes = [(*(target.position - 5), 11.0, 11.0) for target in targets]
    truth = TruthTable({frame: boxes[frame] for frame in marked}) if marked else None
    run = Run(
        BALL, BALL.video.on_video(Pictures(pictures), Box.of(*boxes[0]), truth=truth), tracker=tracker, frames=frames
    )
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
    run = on_clip(marked=tuple(range(0, FRAMES, 3)))
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
    pictures, targets = film()
    found = find(experiment)
    truth = TruthTable({frame: (*(target.position - 5), 11.0, 11.0) for frame, target in enumerate(targets)})
    setup = found.video.on_video(Pictures(pictures), Box.of(*truth.boxes[0]), truth=truth)
    run = Run(found, setup, tracker="condensation", frames=FRAMES)
    run.finish()
    inside = [np.abs(np.subtract(row.estimate, row.truth or ())).max() <= 5.5 for row in run.diagnostics]
    assert [not row.is_lost for row in run.diagnostics] == inside
    assert not all(inside)
    summary = run.summary()
    assert summary.hit_rate == summary.measures["inside_share"] == pytest.approx(np.mean(inside))
    ((row,),) = outcomes(found, setup, values={}, trackers=["condensation"], seeds=[0], frames=FRAMES)
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
