"""Outlines beside edges: the best place, the cap, what is outside, and what is refused."""

import cv2
import numpy as np
import pytest

from pftrack.vision.likelihoods.edges import log_likelihood

ANGLES = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
CIRCLE = 12.0 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
IMAGE = np.zeros((80, 100, 3), np.uint8)
cv2.circle(IMAGE, (40, 30), 12, (255, 255, 255), -1)


def test_the_outline_is_most_likely_where_the_disc_is() -> None:
    """Of all places on a lattice the middle of the disc is the best, and it is within a pixel of its edges."""
    across, down = np.meshgrid(np.arange(15.0, 80.0), np.arange(15.0, 65.0))
    states = np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)])
    found = log_likelihood(IMAGE, states, CIRCLE)
    assert np.abs(states[found.argmax(), :2] - (40.0, 30.0)).max() <= 1.0
    assert found.max() > -0.5 * (1.0 / 3.0) ** 2 - 1e-6


def test_no_point_costs_more_than_the_cap() -> None:
    """Far from all edges, outside the picture and at NaN every point has the cap; so has a picture without edges."""
    worst = -0.5 * (10.0 / 3.0) ** 2
    states = np.array([[-500.0, 20.0], [np.nan, 3.0], [np.inf, -np.inf]])
    assert log_likelihood(IMAGE, states, CIRCLE) == pytest.approx(worst)
    assert log_likelihood(IMAGE, np.array([[87.0, 65.0]]), CIRCLE) == pytest.approx(worst)
    beside = np.zeros_like(IMAGE)
    beside[:, :2] = 255  # the nearest pixels of the picture are edges, and the outline is not in it
    assert log_likelihood(beside, np.array([[-20.0, 40.0]]), CIRCLE) == pytest.approx(worst)
    assert log_likelihood(np.zeros_like(IMAGE), np.array([[40.0, 30.0]]), CIRCLE) == pytest.approx(worst)


def test_what_is_no_outline_is_refused() -> None:
    """Shapes and a spread of nothing are named."""
    with pytest.raises(ValueError, match="outline_px must"):
        log_likelihood(IMAGE, np.zeros((3, 2)), np.zeros(4))
    with pytest.raises(ValueError, match="spread must be above 0 px, got 0"):
        log_likelihood(IMAGE, np.zeros((3, 2)), CIRCLE, spread_px=0.0)
