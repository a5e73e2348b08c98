"""Signals are read by roles, features depend on frames up to their own, and a regression on them is the closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.series import Hypotheses, Series
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments.shared.loss_probability import KINDS, Logistic, Memory, feature_names, read_signals, remember
from tools.loss_probability import fit, signal_names

SERIES = {
    Series("size", "ESS", role="ess"): 50.0,
    Series("count", "particles", role="particles"): 200.0,
    Series("from", "samplers", shape="vector", role="share"): (30.0, 10.0),
    Series("seen", "features that are seen", shape="vector", role="flag"): (1.0, 0.0, 1.0, 1.0),
    Series("outlier", "outliers", role="event"): 3.0,
    Series("box", "box", shape="vector", role="extent"): (4.0, 5.0),
    Series("poses", "poses", shape="hypotheses"): Hypotheses(((0.0,), (1.0,)), (0.5, 0.5)),
    Series("likeness", "likeness"): 0.9,
}
"""What is declared, with its value in a frame."""
ROW = Diagnostics(0, 0.0, (0.0, 0.0), (3.0, 4.0), -2.0, None, None, None, None, None, None, True, 0.0)
MEASURED = replace(ROW, series={one.name: value for one, value in SERIES.items()})


def _read(*rows: Diagnostics) -> dict[str, list[float]]:
    names = signal_names(tuple(SERIES), searches=True, more=("poses",))
    values = read_signals(names, {one.name: one for one in SERIES}, rows)
    return dict(zip(names, values.T.tolist(), strict=True))


def test_signals_are_read_by_role() -> None:
    """Each role has its number, and a series without one is read where it is asked for."""
    found = _read(MEASURED)
    assert "likeness" not in found
    assert found["evidence"] == [-2.0]
    assert found["spread"] == pytest.approx([math.log(math.sqrt(12.5))])
    assert found["searching"] == [1.0]
    assert found["ess"] == pytest.approx([math.log(0.25)])
    assert (found["from"], found["seen"], found["outlier"], found["poses"]) == ([0.75], [0.75], [1.0], [0.5])
    assert found["box"] == pytest.approx([math.log(20.0)])


def test_steps_and_jumps_are_in_deviations() -> None:
    """A target that goes on evenly steps and does not jump; one that turns back jumps twice as far."""
    deviation = math.sqrt(12.5)
    rows = [replace(ROW, estimate=(x, 0.0)) for x in (0.0, 5.0, 10.0, 5.0)]
    found = _read(*rows)
    assert found["step"] == pytest.approx([0.0, *[math.log1p(5.0 / deviation)] * 3])
    assert found["jump"] == pytest.approx([0.0, 0.0, 0.0, math.log1p(10.0 / deviation)])


def test_what_a_frame_does_not_have_is_not_known() -> None:
    """Evidence of minus infinity counts as far down as a number goes, and a deviation that is not known is none."""
    found = _read(replace(ROW, log_evidence=-math.inf, sigma=(math.nan, math.nan), searching=None))
    assert found["evidence"] == [-700.0]
    assert all(math.isnan(found[name][0]) for name in ("spread", "step", "searching", "ess", "box", "seen", "poses"))


def test_features_begin_with_plain_means() -> None:
    """In the first frames all means are that of what was known, and the change is from the mean of the first five."""
    _, found = remember(Memory.empty(1), np.array([1.0, 2.0, 3.0, 4.0, 5.0, 11.0])[:, None])
    assert found[4] == pytest.approx([5.0, 3.0, 3.0, 0.0, 0.0, 0.0])
    assert found[5] == pytest.approx([11.0, 3.0 + 8.0 / 5.0, 3.0 + 8.0 / 6.0, 8.0 / 5.0, 0.0, 8.0 / 5.0])
    assert len(feature_names(("a",))) == len(KINDS) == len(found[5])


def test_features_of_a_frame_do_not_depend_on_later_ones() -> None:
    """Frames at once or one by one give the same bits, and an unknown value changes no memory."""
    values = np.random.default_rng(3).normal(size=(40, 3))
    values[7:9, 1] = np.nan
    _, whole = remember(Memory.empty(3), values)
    memory, found = Memory.empty(3), []
    for row in values:
        memory, features = remember(memory, row[None])
        found.append(features[0])
    assert np.array_equal(whole, np.array(found))
    assert np.isfinite(whole).all()
    assert whole[7, 7:12].tolist() == whole[6, 7:12].tolist()


# The regression finds the weights of closed forms.


def test_a_single_feature_of_two_values_is_fitted_to_the_log_odds() -> None:
    """Without a prior the probabilities are the shares, whose log odds are the closed form."""
    features = np.repeat([[0.0], [1.0]], [40, 40], axis=0)
    lost = np.repeat([True, False, True, False], [10, 30, 30, 10])
    found = fit(features, lost, ridge=0.0).probabilities(np.array([[0.0], [1.0]]))
    assert found == pytest.approx([0.25, 0.75], abs=1e-9)


def test_probabilities_stay_between_nothing_and_certainty() -> None:
    """Far beyond what was fitted a feature counts as four deviations, and no probability is more than 1."""
    steep, flat = (Logistic((0.0,), (1.0,), (weight,), 0.0) for weight in (300.0, 1.0))
    least, middle, most = steep.probabilities(np.array([[-1e9], [0.0], [1e9]]))
    assert (0.0 <= least < 1e-300, middle, most) == (True, 0.5, 1.0)
    assert flat.probabilities(np.array([[9.0]]))[0] == pytest.approx(1.0 / (1.0 + math.exp(-4.0)))
