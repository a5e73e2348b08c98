import numpy as np

from pftrack.core.numerics.random import log_density
from pftrack.vision.likelihoods import points


def test_each_point_has_its_own_noise() -> None:
    """Up to a constant for each point, the score is the log density of its measurement."""
    rng = np.random.default_rng(0)
    positions, measured, noise = rng.normal(size=(3, 20, 2)), rng.normal(size=(3, 2)), np.array([0.5, 1.0, 100.0])
    scores = points.log_likelihood(positions, measured, noise)
    for n in range(3):
        exact = log_density(positions[n], measured[n], noise[n] ** 2 * np.eye(2))
        assert np.ptp(scores[n] - exact) < 1e-12


def test_far_points_do_not_underflow() -> None:
    """Forty standard deviations away, where the density itself would be zero, the scores still differ (eq. 4.7)."""
    scores = points.log_likelihood(np.array([[[40.0, 0.0], [41.0, 0.0]]]), np.zeros((1, 2)), np.ones(1))
    assert scores.tolist() == [[-800.0, -840.5]]
