import numpy as np
import pytest

from pftrack.filters.dynamics import LinearDynamics, autoregression
from pftrack.filters.learning import online_em

ONE = np.eye(2)
INITIAL = autoregression(2 * ONE, -ONE, np.zeros(2), 3 * ONE)
SIZE = (320, 240)
SETTINGS = online_em.Settings(forgetting=0.99, warm_up=15, ridge=1e-7, largest_spectral_radius=1.05)


def swing(t: int) -> np.ndarray:
    return np.array([160 - 100 * np.cos(2 * np.pi * t / 30), 120.0])


def learned(frames: int, settings: online_em.Settings = SETTINGS) -> LinearDynamics:
    learner = online_em.begin(INITIAL, swing(0), 0.0, SIZE)
    for t in range(1, frames + 1):
        learner = online_em.learn(learner, INITIAL, swing(t), np.zeros(2), settings)
    return online_em.dynamics(learner, 3 * ONE)


def test_exact_positions_give_the_exact_model() -> None:
    """By frame 60 A1 and A0 are 2 cos(12 deg) and -1 within 0.001, and the model continues the path in px.

    A model that does not oscillate has no period.
    """
    model = learned(60)
    assert model.transition[0, [0, 2]] == pytest.approx([2 * np.cos(np.deg2rad(12)), -1.0], abs=1e-3)
    assert online_em.period_frames(model) == pytest.approx(30, abs=0.1)
    assert np.isnan(online_em.period_frames(INITIAL))
    for t in (61, 70, 83):
        state = np.concatenate([swing(t), swing(t - 1)])[None]
        assert np.allclose(model.predict(state)[0, :2], swing(t + 1), atol=0.3)


def test_guard_refuses_runaways() -> None:
    """A model whose spectral radius is beyond the guard is never accepted."""
    settings = online_em.Settings(0.99, 15, 1e-7, 1.02)
    learner = online_em.begin(INITIAL, np.array([161.0, 121.0]), 0.0, SIZE)
    for t in range(1, 30):
        position = np.array([160 + 1.2**t, 120 + 1.2**t])
        learner = online_em.learn(learner, INITIAL, position, np.zeros(2), settings)
        model = online_em.dynamics(learner, ONE)
        assert np.abs(np.linalg.eigvals(model.transition)).max() <= 1.02 + 1e-9


def test_runaway_estimates_teach_nothing() -> None:
    """An estimate far outside the picture, or one of NaN, leaves the statistics alone."""
    learner = online_em.begin(INITIAL, swing(0), 1.0, SIZE)
    for t in range(1, 20):
        learner = online_em.learn(learner, INITIAL, swing(t), np.ones(2), SETTINGS)
    far = online_em.learn(learner, INITIAL, np.array([9999.0, 0.0]), np.ones(2), SETTINGS)
    assert np.array_equal(far.regressors, learner.regressors)
    assert far.triples == learner.triples
    for estimate, sigma in ((np.array([np.nan, 0.0]), np.ones(2)), (swing(20), np.array([np.inf, 1.0]))):
        assert online_em.learn(learner, INITIAL, estimate, sigma, SETTINGS) is learner


def test_a_ridge_without_motion_keeps_the_model() -> None:
    """A target that never moves teaches nothing: the ridge holds the initial model where there is no evidence."""
    settings, middle = online_em.Settings(0.99, 15, 1e-4, 1.02), np.array([160.0, 120.0])
    learner = online_em.begin(INITIAL, middle, 0.0, SIZE)
    for _ in range(60):
        learner = online_em.learn(learner, INITIAL, middle, np.zeros(2), settings)
    assert np.allclose(online_em.dynamics(learner, ONE).transition, INITIAL.transition, atol=2e-3)


def test_the_first_model_comes_with_the_last_frame_of_the_warm_up() -> None:
    """Positions count when the oldest is LAG frames old; as many triples as the warm-up has make a model."""
    settings = online_em.Settings(0.99, 4, 1e-7, 1.05)
    first = online_em.LAG + 4 - 1
    for frames in (first - 1, first):
        kept = np.allclose(learned(frames, settings).transition, INITIAL.transition)
        assert kept == (frames < first)


def test_a_position_is_believed_as_far_as_the_tracker_is_sure() -> None:
    """The newest smoothed position lies between prediction and estimate by their variances, and so does its own."""
    sigma, noise = 4.0, 3.0
    learner = online_em.begin(INITIAL, np.array([150.0, 110.0]), sigma, SIZE)
    seen, unsure = np.array([170.0, 100.0]), np.array([5.0, 2.0])
    after = online_em.learn(learner, INITIAL, seen, unsure, SETTINGS).positions
    predicted = sigma**2 + noise**2
    gain = predicted / (predicted + unsure**2)
    expected = np.array([150.0, 110.0]) + gain * (seen - [150.0, 110.0])
    assert 100 * after.mean[:2] + np.array(SIZE) / 2 == pytest.approx(expected, abs=0.01)
    assert (100 * after.standard_deviations[:2]) ** 2 == pytest.approx(predicted * (1 - gain), rel=1e-3)


def test_what_is_counted_is_the_oldest_triple() -> None:
    """The statistics of exact positions are those of the three that were smoothed the longest."""
    learner = online_em.begin(INITIAL, swing(0), 0.0, SIZE)
    for t in range(1, online_em.LAG + 1):
        learner = online_em.learn(learner, INITIAL, swing(t), np.zeros(2), SETTINGS)
    oldest, middle, newest = ((swing(t) - np.array(SIZE) / 2) / 100 for t in (0, 1, 2))
    regressor = np.concatenate([middle, oldest, [1.0]])
    assert learner.triples == 1
    assert learner.regressors == pytest.approx(np.outer(regressor, regressor), abs=1e-4)
    assert learner.products == pytest.approx(np.outer(newest, regressor), abs=1e-4)
