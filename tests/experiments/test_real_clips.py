"""Real clips by default: a ball that comes back, a window beside its twins, a lattice at rest."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable, read_truth

CLIPS = Path(__file__).parents[2] / ".." / "shared" / "data"

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not CLIPS.is_dir(), reason="the real clips are not at hand")]


def test_green_ball_comes_back() -> None:
    """Each tracker finds the green ball again after 33 frames out of the picture."""
    ball, clip = find("ball"), CLIPS / "ball_green_hand"
    truth = read_truth(clip / "gt.csv")
    setup = ball.video.on_video(open_sequence(clip / "clip.mp4"), Box.of(*truth.boxes[16]), start=16, truth=truth)
    (found,) = outcomes(ball, setup, values={}, trackers=list(ball.trackers), seeds=[0], frames=1000)
    assert {one.labelled_frames for one in found} == {213}
    assert min(one.measures["hit_rate"] for one in found) >= 0.9


def overlaps(name: str, box: Box, truth: TruthTable, start: int, seeds: int, trackers: Sequence[str]) -> list[float]:
    """Return the mean overlap with the true boxes of every seed, and within a seed of every tracker."""
    window = find("histogram")
    setup = window.video.on_video(open_sequence(CLIPS / name / "clip.mp4"), box, start=start, truth=truth)
    found = outcomes(window, setup, values={}, trackers=trackers, seeds=range(seeds), frames=240)
    return [one.measures["mean_iou"] for row in found for one in row]


def test_a_cup_is_told_from_its_twins_and_a_man_is_held() -> None:
    """The cup is held in most runs; the man in black is held better than by greedy search."""
    cup = Box.of(158, 144, 76, 120)
    truth = TruthTable({42: cup.corner_and_size, 280: (394.0, 142.0, 78.0, 118.0)})
    assert sum(share > 0.8 for share in overlaps("cups_red", cup, truth, 42, 3, ["condensation"])) >= 2
    truth = read_truth(CLIPS / "occlusion_person" / "gt.csv")
    man = Box.of(534.2, 200.0, 35.8, 69.2)
    found = overlaps("occlusion_person", man, truth, 0, 6, ["condensation", "greedy"])
    ours, greedy = sum(found[::2]) / 6, sum(found[1::2]) / 6
    assert ours > greedy
    assert ours > 0.36


def test_the_lattice_does_not_move() -> None:
    """On a printed lattice at rest that hands hide for a while, false motion is small where bad matches are refused."""
    corners = find("trajectories")
    setup = corners.video.on_video(open_sequence(CLIPS / "corners_lattice_static" / "clip.mp4"), None)
    found = []
    for values in ({}, {"largest_cost": 255, "new_corners": False}):
        run = Run(corners, setup, tracker="lg", frames=60, timeline=(Change(0, {"corner_count": 60, **values}),))
        run.finish()
        found.append(corners.measured.report(run.diagnostics))
    assert found[0]["tracks"] >= 50
    assert found[0]["false_motion_px"] < 3.0
    assert found[1]["false_motion_px"] > 1.3 * found[0]["false_motion_px"]
