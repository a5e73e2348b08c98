"""The experiment on recordings: what a box sets, what is refused, and real clips where they are at hand."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.histogram.experiment import look_beside
from pftrack.experiments.histogram.look import first_cells
from pftrack.experiments.histogram.model import judge
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
    assert ours > 0.36


def textured(grey: bool) -> Pictures:
    """A square of upright stripes that walks over lying ones; in colour it is red besides."""
    rows, columns = np.mgrid[:120, :200]
    shown = []
    for index in range(20):
        left = 30 + 5 * index
        inside = (abs(columns - left - 12) <= 12) & (abs(rows - 60) <= 12)
        bright = 70 + 100 * np.where(inside, (columns - left) // 4 % 2, rows // 4 % 2)
        picture = np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)
        picture[inside & (not grey), 1:] = 30
        shown.append(picture)
    return Pictures(shown)


@pytest.mark.parametrize("place", [(-500.0, 100.0), (2000.0, 100.0), (100.0, -900.0)])
def test_nothing_is_beside_an_estimate_that_has_left_the_picture(place: tuple[float, float]) -> None:
    """Otherwise a log would be full of a measurement that fails."""
    experiment = find("histogram")
    step = Run(experiment, experiment.simulate(), tracker="condensation", seed=0, frames=2).advance()
    model = experiment.trackers["condensation"].model
    assert look_beside(step.frame, step.state, step.parameters) < 0.1
    assert np.isnan(look_beside(step.frame, model.moved(step.state, None, np.array(place)), step.parameters))


def test_a_grey_target_is_followed_by_its_edges() -> None:
    """Where all places have the same histogram, a recording is followed by its cells, and worse without them."""
    grey, mark = textured(grey=True), Box.of(30, 48, 25, 25)
    truth = TruthTable({index: (30.0 + 5 * index, 48.0, 25.0, 25.0) for index in range(20)})
    setup = HISTOGRAM.video.on_video(grey, mark, truth=truth)
    coloured = HISTOGRAM.video.on_video(textured(grey=False), mark).parameters.cells_share
    assert setup.parameters.cells_share > 0.9
    assert 0.4 <= coloured <= 0.6, "colours that separate it as well count as much"
    overlaps = {}
    for values in ({}, {"cells_share": 0.0}):
        ((found,),) = outcomes(HISTOGRAM, setup, values=values, trackers=["condensation"], seeds=[1], frames=20)
        overlaps[bool(values)] = found.measures["mean_iou"]
    assert overlaps[False] > 0.8
    assert overlaps[True] < overlaps[False] - 0.1
    run = Run(HISTOGRAM, setup, tracker="condensation", seed=1, frames=20)
    run.finish()
    state, seen = run.current.state, (run.current.frame.picture, run.current.parameters)
    assert judge(state, *seen).missed == 0
    assert judge(replace(state, usual=2.5 * state.usual), *seen).missed == 1, "half of the usual score is too low"


def test_a_target_that_comes_back_elsewhere_is_found() -> None:
    """While the target is lost some or all particles look all over the picture; without them it stays lost."""
    shown, truth = [], {}
    for index in range(24):
        picture = np.full((120, 200, 3), 110, np.uint8)
        if not 8 <= index < 12:
            x, y = (20 + 2 * index, 30) if index < 8 else (160, 80)
            picture[y : y + 15, x : x + 15] = (200, 50, 50)
            truth[index] = (float(x), float(y), 15.0, 15.0)
        shown.append(picture)
    setup = HISTOGRAM.video.on_video(Pictures(shown), Box.of(20, 30, 15, 15), truth=TruthTable(truth))
    for share, found in ((0.1, 1.0), (0.7, 1.0), (1.0, 1.0), (0.0, 0.0)):
        run = Run(HISTOGRAM, setup, seed=1, frames=24, timeline=[Change(0, {"search_share": share})])
        run.finish()
        assert run.summary().measures["held_at_end"] == found
        said = [row.searching for row in run.diagnostics]
        assert said[9:11] == ([None] * 2 if share == 0.0 else [True] * 2)
        assert not said[-1]


def test_cells_begin_with_the_first_look_and_do_not_learn_what_hides_it() -> None:
    """Switched on in mid-run they are those of the first picture; where they score too little nothing is learned."""
    pictures = textured(grey=True)
    setup = HISTOGRAM.video.on_video(pictures, Box.of(30, 48, 25, 25))
    late = Run(HISTOGRAM, setup, frames=6, timeline=[Change(0, {"cells_share": 0.0}), Change(3, {"cells_share": 0.5})])
    assert late.seek(2).state.learned is None
    assert late.seek(3).state.learned is not None
    state = Run(HISTOGRAM, setup, frames=6).seek(5).state
    assert not np.array_equal(state.learned.weights, first_cells(state.look).weights)
    assert judge(state, np.full((120, 200, 3), 120, np.uint8), setup.parameters).learned is state.learned
    assert judge(state, pictures.picture(5), setup.parameters).learned is not state.learned
