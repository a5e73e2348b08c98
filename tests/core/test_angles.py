"""Angles on the circle."""

import numpy as np
import pytest

from pftrack.core.numerics.elementary import circular_mean, direction, less_turns, wrap


def test_whole_turns_do_not_count() -> None:
    """An angle less whole turns lies within half a turn of 0, and points the same way."""
    for angle in np.linspace(-20.0, 20.0, 401).tolist():
        within = less_turns(angle)
        assert -np.pi <= within <= np.pi
        assert np.exp(1j * within) == pytest.approx(np.exp(1j * angle))
        assert np.exp(1j * float(wrap(angle))) == pytest.approx(np.exp(1j * angle))


def test_the_mean_of_angles_is_taken_on_the_circle() -> None:
    """Angles to either side of half a turn have half a turn as their mean, not 0; weights count."""
    assert abs(circular_mean(np.array([3.0, -3.0]), np.array([0.5, 0.5]))) == pytest.approx(np.pi)
    assert circular_mean(np.array([0.0, 0.1, 7.0]), np.array([0.5, 0.5, 0.0])) == pytest.approx(0.05)


def test_half_a_turn_is_positive() -> None:
    """Of the two names of half a turn the positive one is used."""
    assert wrap([np.pi, -np.pi]).tolist() == [np.pi, np.pi]
    assert wrap(np.nextafter(np.pi, 4.0)) == np.pi  # which rounding would take a whole turn back


def test_a_direction_is_the_angle_of_a_vector() -> None:
    """In all four quadrants, and straight back."""
    for angle in (0.0, 0.3, 2.0, -0.4, -3.0):
        assert direction(2.0 * np.cos(angle), 2.0 * np.sin(angle)) == pytest.approx(angle)
    assert direction(-1.0, 0.0) == pytest.approx(np.pi)
