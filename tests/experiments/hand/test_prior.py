"""The prior of a hand of which several predictions speak: eq. 2.13 against a direct sum."""

import numpy as np
import pytest

from pftrack.experiments.hand.model import (
    SPREAD_SD,
    TILT_SD,
    TURN_SD,
    HandTrackerParameters,
    Predictions,
    log_prior,
    log_shares,
    palm_log_shares,
    settings,
)
from pftrack.experiments.hand.shape import open_pose

SETTINGS = settings(HandTrackerParameters(), 52.0)
RNG = np.random.default_rng(3)
POSE = open_pose((100.0, 137.0))
POSES = POSE + 0.05 * RNG.standard_normal((6, 25))
WEIGHTS = np.log(RNG.dirichlet(np.ones(6)))
PREDICTIONS = Predictions(POSES, WEIGHTS)


def densities() -> np.ndarray:
    """Return exp(-d^2 / 2) of the pose from each prediction, a finger's flexions being one number, their mean."""
    away = POSE - POSES
    fingers = away[:, 5:].reshape(6, 5, 4)
    squares = np.square(away[:, :2] / SETTINGS.wrist_sd).sum(axis=1)
    squares += np.square(away[:, 2:5] / [TURN_SD, TILT_SD, TURN_SD]).sum(axis=1)
    squares += np.square(fingers[:, :, 0] / SPREAD_SD).sum(axis=1)
    squares += np.square(fingers[:, :, 1:].mean(axis=2) / SETTINGS.flexion_sd).sum(axis=1)
    return np.exp(-0.5 * squares)


def test_the_prior_is_the_sum_over_all_predictions() -> None:
    """Each with the probability of the hand that it comes from."""
    shares = log_shares(POSE, PREDICTIONS, SETTINGS)
    assert log_prior(shares, 2, False) == pytest.approx(np.log((np.exp(WEIGHTS) * densities()).sum()))
    assert shares == pytest.approx(WEIGHTS + np.log(densities()))


def test_a_prior_of_one_prediction_is_its_share_and_less_than_the_sum() -> None:
    """By no more than how many predictions there are; where there is one, both ways are the same."""
    shares = log_shares(POSE, PREDICTIONS, SETTINGS)
    own, whole = log_prior(shares, int(shares.argmax()), True), log_prior(shares, 0, False)
    assert own == shares.max()
    assert own < whole <= own + np.log(6.0)
    assert log_prior(shares[:1], 0, True) == pytest.approx(log_prior(shares[:1], 0, False))


def test_the_prior_of_a_palm_has_its_three_angles_alone() -> None:
    """Neither the wrist nor fingers count."""
    moved = POSE.copy()
    moved[:2] += 5.0
    moved[5:] += 0.3
    palm = palm_log_shares(POSE, PREDICTIONS)
    assert (palm_log_shares(moved, PREDICTIONS) == palm).all()
    same = POSES.copy()
    same[:, :2], same[:, 5:] = POSE[:2], POSE[5:]
    assert palm == pytest.approx(log_shares(POSE, Predictions(same, WEIGHTS), SETTINGS))
