"""Series: values of every shape in Python, JSON and columns, and what is kept of them over a run."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.series import (
    Hypotheses,
    Interval,
    Reduction,
    Series,
    SeriesValue,
    check_value,
    columns,
    join,
    reduce,
    to_json,
)

NUMBER = Series("speed", "speed", "px")
VECTOR = Series("samples", "proposals", shape="vector", role="share", components=("prediction", "observation"))
INTERVAL = Series("range", "range", "px", "interval")
BANK = Series("bank", "bank", "°", "hypotheses", components=("angle", "rate"))

finite = st.floats(-1e6, 1e6)
vectors = st.tuples(finite, finite)


@st.composite
def hypotheses(draw: st.DrawFn) -> Hypotheses:
    """Between one and five possibilities whose weights sum to 1."""
    values = draw(st.lists(vectors, min_size=1, max_size=5))
    raw = np.array(draw(st.lists(st.floats(0.01, 1.0), min_size=len(values), max_size=len(values))))
    parents = draw(st.lists(st.integers(-1, 9), min_size=len(values), max_size=len(values)) | st.just([]))
    return Hypotheses(tuple(values), tuple((raw / raw.sum()).tolist()), tuple(parents))


VALUES = {
    NUMBER.name: (NUMBER, finite),
    VECTOR.name: (VECTOR, vectors),
    INTERVAL.name: (INTERVAL, vectors.map(lambda ends: Interval(min(ends), max(ends)))),
    BANK.name: (BANK, hypotheses()),
}


@pytest.mark.parametrize("name", VALUES)
@given(data=st.data())
def test_values_become_json(name: str, data: st.DataObject) -> None:
    """Whatever the shape, a value is written with all its numbers."""
    series, strategy = VALUES[name]
    value = data.draw(strategy)  # type: ignore[arg-type] # of one shape or another
    check_value(series, value)
    found = json.loads(json.dumps(to_json(value), allow_nan=False))
    if isinstance(value, Hypotheses):
        value = value.values, value.weights, value.parents
        found = found["values"], found["weights"], found.get("parents", [])
    assert json.dumps(found) == json.dumps(value)


@pytest.mark.parametrize(
    ("series", "value"),
    [
        (NUMBER, (1.0,)),
        (VECTOR, 1.0),
        (VECTOR, (1.0, 2.0, 3.0)),
        (VECTOR, Interval(1.0, 2.0)),
        (INTERVAL, (1.0, 2.0)),
        (INTERVAL, Interval(2.0, 1.0)),
        (BANK, (1.0, 2.0)),
        (BANK, Hypotheses(((1.0, 2.0),), (0.5, 0.5))),
        (BANK, Hypotheses(((1.0,),), (1.0,))),
        (BANK, Hypotheses(((1.0, 2.0), (3.0, 4.0)), (0.5, 0.6))),
        (BANK, Hypotheses(((1.0, 2.0),), (1.0,), (0, 0))),
        (BANK, Hypotheses(((1.0, 2.0),), (1.0,), (-2,))),
    ],
)
def test_values_of_another_shape_are_refused(series: Series, value: SeriesValue) -> None:
    """The refusal names the series, what it is declared as, and what it got."""
    with pytest.raises(ValueError, match=f"{series.name} is declared as {series.shape}.* got"):
        check_value(series, value)


def test_what_is_not_known_is_null_in_json() -> None:
    """NaN becomes null, wherever it stands."""
    assert (to_json((1.0, math.nan)), to_json(math.inf)) == ([1.0, None], None)
    assert to_json(Hypotheses(((math.nan, 2.0),), (1.0,))) == {"values": [[None, 2.0]], "weights": [1.0]}


ONE, TWO = Hypotheses(((1.0, 2.0),), (1.0,)), Hypotheses(((3.0, 4.0), (5.0, 6.0)), (0.25, 0.75), (0, -1))


def test_parents_are_written_where_they_are_known() -> None:
    """Hypotheses without parents have none in JSON, and no column of them."""
    assert to_json(ONE) == {"values": [[1.0, 2.0]], "weights": [1.0]}
    assert to_json(TWO)["parents"] == [0, -1]
    assert "bank_parents" not in columns(BANK, [ONE])
    np.testing.assert_array_equal(columns(BANK, [ONE, TWO])["bank_parents"], [[np.nan, np.nan], [0, -1]])


def test_columns_are_as_wide_as_the_widest() -> None:
    """Where a frame has fewer hypotheses than another, or none, the rest is NaN."""
    found, none = columns(BANK, [ONE, None, TWO]), [np.nan, np.nan]
    np.testing.assert_array_equal(found["bank"], [[[1.0, 2.0], none], [none, none], [[3.0, 4.0], [5.0, 6.0]]])
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
    assert reduce(mean, np.array([1.0, np.nan, 2.0])) == {"mean_a": 1.5}
    assert reduce(flag, np.array([1.0, 0.0, 1.0])) == {"times_b": 2}
    assert reduce(share, np.array([[3.0, 1.0], [1.0, 1.0]])) == {"share_y": 0.375}
    assert [*reduce(mean, np.array([np.nan])).values()] == [None]
    assert all(set(reduce(series, np.zeros(0)).values()) == {None} for series in (mean, flag, share))


def test_one_name_is_one_series() -> None:
    """Trackers may declare the same series; two different ones of a name are refused, and so are reductions."""
    assert join((NUMBER, VECTOR), (NUMBER,)) == (NUMBER, VECTOR)
    with pytest.raises(ValueError, match="two different series are called 'speed'"):
        join((NUMBER,), (Series("speed", "speed", "mm"),))
    kept = (Reduction("kept", "kept", "mean"),)
    with pytest.raises(ValueError, match="two reductions are called 'kept'"):
        join((Series("a", "a", reductions=kept), Series("b", "b", reductions=kept)))
