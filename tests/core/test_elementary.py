import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.elementary import exponentials, logarithms

INF = float("inf")


@given(st.lists(st.floats(-708, 708), min_size=1, max_size=40))
def test_exponentials_are_exact_to_the_last_place(values: list[float]) -> None:
    """Every result is within one unit in the last place of the library's."""
    expected = np.exp(np.array(values))
    assert (np.abs(exponentials(np.array(values)) - expected) <= np.spacing(expected)).all()


@given(st.lists(st.floats(2.0**-1022, 1.7e308), min_size=1, max_size=40))
def test_logarithms_are_exact_to_the_last_place(values: list[float]) -> None:
    """Every result is within one unit in the last place of the library's."""
    expected = np.log(np.array(values))
    assert (np.abs(logarithms(np.array(values)) - expected) <= np.spacing(np.abs(expected))).all()


def test_the_impossible_weighs_nothing() -> None:
    """A log weight of -inf or NaN becomes a weight of zero, and what would overflow stays finite."""
    results = exponentials(np.array([-INF, np.nan, -746.0, 710.0, INF]))
    assert results[:3].tolist() == [0.0, 0.0, 0.0]
    assert np.isfinite(results).all()


def test_a_very_small_weight_is_not_lost() -> None:
    """Results too small for a normal number fade out gradually, as the library's do."""
    values = np.array([-744.0, -740.0, -720.0, -709.0])
    assert np.allclose(exponentials(values), np.exp(values), rtol=0, atol=5e-324)


def test_the_logarithm_of_nothing_is_finite() -> None:
    """Zero and numbers below the smallest normal one count as that."""
    assert logarithms(np.array([0.0, 5e-324])).tolist() == [np.log(2.0**-1022)] * 2


def test_one_and_zero_are_exact() -> None:
    """e^0 is 1 and ln 1 is 0, to the bit, so that equal weights stay equal."""
    assert exponentials(np.zeros(3)).tolist() == [1.0] * 3
    assert logarithms(np.ones(3)).tolist() == [0.0] * 3
