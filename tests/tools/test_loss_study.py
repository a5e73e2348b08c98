"""Scores of loss probabilities agree with their definitions."""

import math

import numpy as np
import pytest

from tools.loss_study import BINS, Judgement, brier, delays, reliability, roc


def test_reliability_counts_the_frames_of_each_bin() -> None:
    """Ten frames of 0.2 with two losses are calibrated; ten of 0.9 without a loss are 0.9 off."""
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
    """Equal pairs count half, and without pairs the area is unknown."""
    probabilities, lost = np.array([0.1, 0.4, 0.4, 0.8, 0.3]), np.array([False, False, True, True, True])
    pairs = [(a > b) + 0.5 * (a == b) for a in probabilities[lost] for b in probabilities[~lost]]
    assert roc(probabilities, lost).area == pytest.approx(np.mean(pairs))
    assert math.isnan(roc(probabilities, np.ones(5, bool)).area)


def test_a_loss_is_detected_in_the_first_frame_above_a_half() -> None:
    """Losses of less than five frames do not count, and an undetected loss counts as infinitely late."""
    lost = np.array([0, 1, 1, 0, 1, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1], bool)
    told = np.zeros(16)
    told[6] = 0.5
    found = delays([(told, lost)])
    assert (found.losses, found.told, found.frames, found.median) == (2, 1, (2,), 2.0)
    assert math.isnan(delays([(told, np.zeros(16, bool))]).median)
