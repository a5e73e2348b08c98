"""The regression finds the weights of closed forms."""

import math

import numpy as np
import pytest

from pftrack.experiments.shared.loss_probability import Logistic
from tools.loss_probability import fit


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
