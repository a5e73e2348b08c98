"""Series: values of every shape in Python, JSON and columns, and what is kept of them over a run."""

import math
from typing import Any

import numpy as np
import pytest

from pftrack.core.model import series as of
from pftrack.core.model.series import Hypotheses, Interval, Reduction, Series, columns, to_json

NUMBER = Series("speed", "speed", "px")
VECTOR = Series("samples", "proposals", shape="vector", role="share", components=("prediction", "observation"))
INTERVAL = Series("range", "range", "px", "interval")
BANK = Series("bank", "bank", "°", "hypotheses", components=("angle", "rate"))


@pytest.mark.parametrize(
    ("series", "value"),
    [
        (NUMBER, (1.0,)),
        (VECTOR, (1.0, 2.0, 3.0)),
        (VECTOR, Interval(1.0, 2.0)),
        (INTERVAL, Interval(2.0, 1.0)),
        (BANK, (1.0, 2.0)),
        (BANK, Hypotheses(((1.0, 2.0),), (0.5, 0.5))),
        (BANK, Hypotheses(((1.0, 2.0), (3.0, 4.0)), (0.5, 0.6))),
        (BANK, Hypotheses(((1.0, 2.0),), (1.0,), (0, 0))),
        (BANK, Hypotheses(((1.0, 2.0),), (1.0,), (-2,))),
    ],
)
def test_values_of_another_shape_are_refused(series: Series, value: Any) -> None:
    """The refusal names the series, what it is declared as, and what it got."""
    with pytest.raises(ValueError, match=f"{series.name} is declared as {series.shape}.* got"):
        of.check_value(series, value)


ONE, TWO = Hypotheses(((1.0, 2.0),), (1.0,)), Hypotheses(((3.0, 4.0), (5.0, 6.0)), (0.25, 0.75), (0, -1))


def test_columns_are_as_wide_as_the_widest() -> None:
    """Where a frame has fewer hypotheses than another, or none, the rest is NaN.

    Parents are written where they are known; what is not finite becomes null in JSON.
    """
    assert (to_json((1.0, math.nan)), to_json(math.inf)) == ([1.0, None], None)
    assert to_json(Hypotheses(((math.nan, 2.0),), (1.0,))) == {"values": [[None, 2.0]], "weights": [1.0]}
    assert to_json(TWO)["parents"] == [0, -1]
    for series, value in ((NUMBER, 1.5), (VECTOR, (1.0, 2.0)), (INTERVAL, Interval(1.0, 2.0)), (BANK, TWO)):
        of.check_value(series, value)
    assert (to_json(1.5), to_json(Interval(1.0, 2.0))) == (1.5, [1.0, 2.0])
    assert "bank_parents" not in columns(BANK, [ONE])
    found, none = columns(BANK, [ONE, None, TWO]), [np.nan, np.nan]
    np.testing.assert_array_equal(found["bank"], [[[1.0, 2.0], none], [none, none], [[3.0, 4.0], [5.0, 6.0]]])
    np.testing.assert_array_equal(found["bank_parents"][1:], [none, [0, -1]])
    assert found["bank_weights"].tolist()[2] == [0.25, 0.75]
    assert columns(NUMBER, [1.0, None])["speed"].tolist()[0] == 1.0
    assert columns(INTERVAL, [None, Interval(1.0, 2.0)])["range"].tolist()[1] == [1.0, 2.0]
    assert columns(Series("exact", "exact", shape="vector"), [(1.0,), (1.0, 2.0)])["exact"].shape == (2, 2)


def test_reductions_are_means_shares_and_counts_of_what_is_known() -> None:
    """Frames without a value do not count; where no frame has one, nothing is kept."""
    mean = Series("a", "a", reductions=(Reduction("mean_a", "mean", "mean"),))
    flag = Series("b", "b", role="flag", reductions=(Reduction("times_b", "times", "count"),))
    kept = (Reduction("share_y", "share", "share", "y"),)
    share = Series("c", "c", shape="vector", components=("x", "y"), reductions=kept)
    assert of.reduce(mean, np.array([1.0, np.nan, 2.0])) == {"mean_a": 1.5}
    assert of.reduce(flag, np.array([1.0, 0.0, 1.0])) == {"times_b": 2}
    assert of.reduce(share, np.array([[3.0, 1.0], [1.0, 1.0]])) == {"share_y": 0.375}
    assert [*of.reduce(mean, np.array([np.nan])).values()] == [None]
    assert all(set(of.reduce(series, np.zeros(0)).values()) == {None} for series in (mean, flag, share))


def test_one_name_is_one_series() -> None:
    """Trackers may declare the same series; two different ones of a name are refused, and so are reductions."""
    assert of.join((NUMBER, VECTOR), (NUMBER,)) == (NUMBER, VECTOR)
    with pytest.raises(ValueError, match="two different series are called 'speed'"):
        of.join((NUMBER,), (Series("speed", "speed", "mm"),))
    kept = (Reduction("kept", "kept", "mean"),)
    with pytest.raises(ValueError, match="two reductions are called 'kept'"):
        of.join((Series("a", "a", reductions=kept), Series("b", "b", reductions=kept)))
