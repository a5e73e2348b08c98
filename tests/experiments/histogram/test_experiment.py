"""The experiment on recordings: what a box sets, what is refused, and real clips where they are at hand."""

from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.experiments import find
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable, read_truth
from tests.experiments.head.heads import Pictures

HISTOGRAM = find("histogram")
CLIPS = Path(__file__).parents[3] / ".." / "shared" / "data"

CLIPS_ARE_HERE = pytest.mark.skipif(not CLIPS.is_dir(), reason="the real clips are not at hand")


def film(colour: tuple[int, int, int] = (200, 50, 50)) -> Pictures:
    """A square that walks to the right over grey."""
    shown = []
    for index in range(12):
        picture = np.full((60, 90, 3), 110, np.uint8)
        picture[20:35, 10 + 3 * index : 25 + 3 * index] = colour
        shown.append(picture)
    return Pictures(shown)


SQUARE = Box.of(10, 20, 15, 15)
TRUTH = TruthTable({index: (10.0 + 3 * index, 20.0, 15.0, 15.0) for index in range(12)})


def followed(pictures: Pictures, box: Box = SQUARE, tracker: str = "condensation") -> Mapping[str, float]:
    run = Run(HISTOGRAM, HISTOGRAM.video.on_video(pictures, box, truth=TRUTH), tracker=tracker, seed=1)
    run.finish()
    return run.summary().measures


@pytest.mark.parametrize("tracker", HISTOGRAM.trackers)
def test_a_film_is_followed(tracker: str) -> None:
    """Every tracker is on the square to the end, and its boxes overlap the true ones."""
    measures = followed(film(), tracker=tracker)
    assert measures["mean_iou"] > 0.7
    assert measures["held_at_end"] == 1.0


def test_a_box_without_colour_is_followed_by_brightness() -> None:
    """A white square on grey has no colour, and is followed all the same."""
    assert followed(film((240, 240, 240)))["mean_iou"] > 0.7


@pytest.mark.parametrize("box", [Box.of(17, 27, 1, 1), Box.of(0, 0, 90, 60), Box.of(88, 0, 2, 60)])
def test_tiny_and_huge_boxes_run(box: Box) -> None:
    """A box of one pixel, of the whole picture and at its edge give finite estimates."""
    run = Run(HISTOGRAM, HISTOGRAM.video.on_video(film(), box), seed=1)
    run.finish()
    assert all(np.isfinite(row.estimate).all() for row in run.diagnostics)


@CLIPS_ARE_HERE
@pytest.mark.slow
def test_real_clips() -> None:
    """The cup is told from its twins in most runs; the man in black is held better than by greedy search."""
    cup = Box.of(158, 144, 76, 120)
    truth = TruthTable({42: cup.corner_and_size, 280: (394.0, 142.0, 78.0, 118.0)})
    with closing(open_sequence(CLIPS / "cups_red" / "clip.mp4")) as sequence:
        setup = HISTOGRAM.video.on_video(sequence, cup, start=42, truth=truth)
        found = outcomes(HISTOGRAM, setup, values={}, trackers=["condensation"], seeds=[0, 1, 2], frames=240)
    assert sum(one[0].measures["mean_iou"] > 0.8 for one in found) >= 2
    man = Box.of(534.2, 200.0, 35.8, 69.2)
    truth = read_truth(CLIPS / "occlusion_person" / "gt.csv")
    with closing(open_sequence(CLIPS / "occlusion_person" / "clip.mp4")) as sequence:
        setup = HISTOGRAM.video.on_video(sequence, man, truth=truth)
        found = outcomes(HISTOGRAM, setup, values={}, trackers=["condensation", "greedy"], seeds=range(6), frames=69)
    ours, greedy = np.mean([[one.measures["mean_iou"] for one in row] for row in found], axis=0)
    assert ours > greedy
    assert ours > 0.42
