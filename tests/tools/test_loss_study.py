"""Scores of loss probabilities are those of their definitions; figures have a panel a tracker with what was found."""

import math

import numpy as np
import pytest

from pftrack.core.arrays import Bools, Floats
from pftrack.experiments import find
from tools.loss_probability import describe_clips
from tools.loss_study import (
    BINS,
    FIGURES,
    LAST_FRAME,
    Judgement,
    brier,
    delays,
    draw_scores,
    reliability,
    roc,
    scenes_of,
)


def test_each_tracker_has_a_panel_that_shows_its_numbers() -> None:
    """Bins lie where they are, a curve ends at all and all, and the losses that were told come to their share."""
    told, lost = np.array([0.1, 0.1, 0.3, 0.9, 0.9, 0.9, 0.9, 0.9]), np.arange(8) >= 2
    scores = Judgement(reliability(told, lost), 0.0, 0.0, roc(told, lost), delays([(told, lost)]))
    figures = draw_scores({("ball", "apf"): scores, ("ball", "upf"): scores, ("hand", "beam"): scores})
    assert tuple(figures) == FIGURES
    for figure in figures.values():
        shown = [panel for panel in figure.axes if panel.get_visible()]
        assert [panel.get_title() for panel in shown] == ["ball, apf", "ball, upf", "hand, beam"]
    bins, curve, waits = ([np.asarray(line.get_data()) for line in figure.axes[0].lines] for figure in figures.values())
    assert np.allclose(bins[1], [[0.1, 0.3, 0.9], [0.0, 1.0, 1.0]])
    assert curve[1][:, -1].tolist() == [1.0, 1.0]
    assert (waits[0][1, 0], waits[0][1, 1], waits[0][0, -1]) == (0.0, 1.0, LAST_FRAME)


def test_reliability_counts_the_frames_of_each_bin() -> None:
    """Ten frames of 0.2 of which two are lost are calibrated; ten of 0.9 of which none is are 0.9 off."""
    probabilities = np.repeat([0.2, 0.9], 10)
    lost = np.zeros(20, bool)
    lost[:2] = True
    low, high = reliability(probabilities, lost)
    assert (low.frames, low.lost, high.frames, high.lost) == (10, 0.2, 10, 0.0)
    assert Judgement((low, high), 0.0, 0.0, roc(probabilities, lost), delays([])).error == pytest.approx(0.45)
    assert brier(probabilities, lost) == pytest.approx((2 * 0.64 + 8 * 0.04 + 10 * 0.81) / 20)
    every = reliability(np.linspace(0.0, 1.0, 101), np.zeros(101, bool))
    assert (len(every), sum(one.frames for one in every)) == (BINS, 101), "a certain loss is in the last bin"


def test_the_area_under_the_roc_is_the_share_of_pairs_in_order() -> None:
    """Pairs that are equal count half, and where there are no pairs it is not known."""
    probabilities, lost = np.array([0.1, 0.4, 0.4, 0.8, 0.3]), np.array([False, False, True, True, True])
    pairs = [(a > b) + 0.5 * (a == b) for a in probabilities[lost] for b in probabilities[~lost]]
    assert roc(probabilities, lost).area == pytest.approx(np.mean(pairs))
    assert math.isnan(roc(probabilities, np.ones(5, bool)).area)


def test_a_loss_is_told_in_the_first_frame_with_more_than_a_half() -> None:
    """Losses of less than five frames do not count, and one that is never told counts as late as can be."""
    lost = np.array([0, 1, 1, 0, 1, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1], bool)
    told = np.zeros(16)
    told[6] = 0.5
    found = delays([(told, lost)])
    assert (found.losses, found.told, found.frames, found.median) == (2, 1, (2,), 2.0)
    assert math.isnan(delays([(told, np.zeros(16, bool))]).median)


def test_scenes_are_those_that_an_experiment_declares() -> None:
    """One without any is refused by its name."""
    assert scenes_of(find("ball")) is find("ball").quality.loss_probability.scenes
    with pytest.raises(ValueError, match="recorded has no scenes"):
        scenes_of(find("recorded"))


def test_clips_count_alike_however_long_they_are() -> None:
    """A clip that is always held has no share to beat; in one that is right there is no error, in one wrong 0.4."""
    lost = np.arange(10) >= 5

    def judged(probabilities: Floats, happened: Bools) -> Judgement:
        scores = brier(probabilities, happened), brier(np.full(len(happened), happened.mean()), happened)
        return Judgement(reliability(probabilities, happened), *scores, roc(probabilities, happened), delays([]))

    held = judged(np.zeros(1000), np.zeros(1000, bool))
    right, wrong = judged(lost.astype(float), lost), judged(np.full(10, 0.9), lost)
    told = describe_clips("apf", [held, right, wrong])
    assert told.startswith("apf: calibration error of a clip 0.133, mean of 3")
    assert told.endswith("in 1 of 2 that are lost and held")
