"""Sines and cosines of whole arrays are those of the C library to the last place."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.elementary import sines_cosines


@given(st.floats(-1e6, 1e6))
def test_they_agree_with_the_library(angle: float) -> None:
    """Any angle up to a million radians has the sine and cosine that the library gives."""
    sines, cosines = sines_cosines(np.array([angle]))
    assert sines[0] == pytest.approx(np.sin(angle), abs=3e-10 if abs(angle) > 1e3 else 1e-15)
    assert cosines[0] == pytest.approx(np.cos(angle), abs=3e-10 if abs(angle) > 1e3 else 1e-15)


def test_the_axes_are_met() -> None:
    """All quarters of the circle have their own signs."""
    sines, cosines = sines_cosines(0.5 * np.pi * np.arange(-5.0, 6.0))
    assert np.allclose(sines, [-1, 0, 1, 0, -1, 0, 1, 0, -1, 0, 1], atol=1e-15)
    assert np.allclose(cosines, [0, 1, 0, -1, 0, 1, 0, -1, 0, 1, 0], atol=1e-15)
