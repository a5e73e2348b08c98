"""The regression finds the weights of closed forms, and the scores are those of their definitions."""

import math

import numpy as np
import pytest

from pftrack.experiments.shared.loss_probability import (
    BINS,
    Logistic,
    brier,
    calibration_error,
    delays,
    fit,
    reliability,
    roc,
)


def test_a_single_feature_of_two_values_is_fitted_to_the_log_odds() -> None:
    """Without a prior the probabilities are the shares, whose log odds are the closed form."""
    features = np.repeat([[0.0], [1.0]], [40, 40], axis=0)
    lost = np.repeat([True, False, True, False], [10, 30, 30, 10])
    found = fit(features, lost, ridge=0.0).probabilities(np.array([[0.0], [1.0]]))
    assert found == pytest.approx([0.25, 0.75], abs=1e-9)


def test_a_feature_that_never_changes_counts_for_nothing() -> None:
    """Its deviation is infinite, so that a later value of it has no say."""
    features = np.column_stack([np.repeat([0.0, 1.0], 20), np.full(40, 3.0)])
    regression = fit(features, features[:, 0] > 0.0, ridge=1.0)
    told = regression.probabilities(np.array([[1.0, 3.0], [1.0, 1e6]]))
    assert told[0] == told[1] > 0.5


def test_probabilities_stay_between_nothing_and_certainty() -> None:
    """Far beyond what was fitted a feature counts as four deviations, and no probability is more than 1."""
    regression = Logistic((0.0,), (1.0,), (300.0,), 0.0)
    least, middle, most = regression.probabilities(np.array([[-1e9], [0.0], [1e9]]))
    assert (0.0 <= least < 1e-300, middle, most) == (True, 0.5, 1.0)
    assert Logistic((0.0,), (1.0,), (1.0,), 0.0).probabilities(np.array([[9.0]]))[0] == pytest.approx(
        1.0 / (1.0 + math.exp(-4.0))
    )


def test_reliability_counts_the_frames_of_each_bin() -> None:
    """Ten frames of 0.2 of which two are lost are calibrated; ten of 0.9 of which none is are 0.9 off."""
    probabilities = np.repeat([0.2, 0.9], 10)
    lost = np.zeros(20, bool)
    lost[:2] = True
    low, high = reliability(probabilities, lost)
    assert (low.frames, low.lost, high.frames, high.lost) == (10, 0.2, 10, 0.0)
    assert calibration_error((low, high)) == pytest.approx(0.45)
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
