"""Each kind of band tells from a frame's numbers whether it held the truth."""

import math
from collections.abc import Mapping
from typing import Any

import pytest

from pftrack.core.model.band import ALL, HALF, MOST, Band, DeviationBand, EstimateBand, FlagBand, IntervalBand
from pftrack.core.model.series import Interval
from pftrack.core.model.tracker import Diagnostics


def row(truth: tuple[float, ...] | None = None, **series: Any) -> Diagnostics:
    return Diagnostics(1, 0.0, (0.0, 0.0), (1.0, 1.0), 0.0, truth, None, None, None, None, None, None, 0.0, series)


ANGLE = DeviationBand("angle", ("a",), ("a_sd",), ("a_true",), turn=360.0)
LENGTH = IntervalBand("length", ("l",), ("l_true",))


@pytest.mark.parametrize(
    ("band", "frame", "held"),
    [
        (EstimateBand(), row((0.6, 1.9)), {HALF: [True, False], MOST: [True, True]}),
        (EstimateBand(), row((0.7, 2.0)), {HALF: [False, False], MOST: [True, False]}),
        (EstimateBand(), row(None), {}),
        (EstimateBand(), row((0.0,)), {}),
        (ANGLE, row(a=359.0, a_sd=1.0, a_true=0.5), {HALF: [False], MOST: [True]}),
        (ANGLE, row(a=math.nan, a_sd=1.0, a_true=0.5), {HALF: [False], MOST: [False]}),
        (ANGLE, row(a=1.0, a_sd=1.0), {HALF: [], MOST: []}),
        (LENGTH, row(l=Interval(1.0, 2.0), l_true=2.0), {MOST: [True]}),
        (LENGTH, row(l=Interval(1.0, 2.0), l_true=2.1), {MOST: [False]}),
        (LENGTH, row(l_true=2.1), {MOST: []}),
        (FlagBand("region", {ALL: "in"}), row(**{"in": 0.0}), {ALL: [False]}),
        (FlagBand("region", {ALL: "in"}), row(), {ALL: []}),
        (FlagBand("points", {HALF: "in"}), row(**{"in": (1.0, 0.0, math.nan)}), {HALF: [True, False]}),
    ],
)
def test_what_is_held(band: Band, frame: Diagnostics, held: Mapping[float, list[bool]]) -> None:
    """Ends count as within, angles go round, what is not finite holds nothing, and what is not known does not count."""
    assert {share: values.tolist() for share, values in band.held(frame).items()} == held
