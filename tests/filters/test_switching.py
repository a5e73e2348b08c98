import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.filters import auxiliary


@pytest.mark.parametrize(
    ("sigma", "expected"), [((4.0, 5.0), 0), ((5.1, 0.0), 800), ((0.0, 5.1), 800), ((9.0, 9.0), 800)]
)
def test_hard_switch(sigma: tuple[float, float], expected: int) -> None:
    """All particles come from the observation as soon as any axis is wider than gamma, none before."""
    assert auxiliary.hard(np.array(sigma), 5.0, 800) == expected


@pytest.mark.parametrize(("sigma", "expected"), [(3.0, 0), (4.0, 0), (12.0, 400), (20.0, 800), (99.0, 800), (4.01, 0)])
def test_soft_switch(sigma: float, expected: int) -> None:
    """The share rises linearly between the thresholds, rounded to the nearest (eqs. 3.6 and 3.7)."""
    assert auxiliary.soft(np.array([sigma, 1.0]), 4.0, 20.0, 800) == expected


@given(st.floats(0, 100), st.floats(0, 50), st.floats(0, 50), st.integers(1, 5000))
def test_soft_switch_stays_within_bounds_and_rises(sigma: float, low: float, width: float, count: int) -> None:
    """The number is between none and all, and does not fall as sigma rises."""
    narrow = auxiliary.soft(np.array([sigma]), low, low + width, count)
    wide = auxiliary.soft(np.array([sigma + 1]), low, low + width, count)
    assert 0 <= narrow <= wide <= count
