"""Readings in words: numbers with their units, and a dash where nothing is known."""

import math
from dataclasses import replace

import pytest

from pftrack.core.model.series import Hypotheses, Interval, Reading, ReadingKind
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import EXPERIMENTS
from pftrack.output.displays import MISSING, format_reading, quantity, readings_of

ROW = Diagnostics(
    frame=1,
    time_s=0.1,
    estimate=(152.34, 119.8),
    sigma=(2.0, math.nan),
    log_evidence=-math.inf,
    truth=None,
    extent=None,
    observation=None,
    error=None,
    lost=None,
    hidden=None,
    searching=None,
    step_ms=1.234,
    series={
        "depth": 3.25,
        "sd": 0.5,
        "range": Interval(1.0, 2.5),
        "seen": (1.0, 0.0, 1.0),
        "paths": Hypotheses(((4.0,), (5.5,)), (0.25, 0.75)),
    },
)


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (Reading("estimate", "estimate"), "152.3, 119.8 px"),
        (Reading("sigma", "sigma"), f"2.0, {MISSING} px"),
        (Reading("error", "error"), MISSING),
        (Reading("evidence", "evidence"), MISSING),
        (Reading("step", "time"), "1.23 ms"),
        (Reading("depth", "value", "m", "depth", "sd"), "3.2 ± 0.5 m"),
        (Reading("other", "value", "m", "other"), MISSING),
        (Reading("range", "interval", "m", "range"), "1.0 to 2.5 m"),
        (Reading("seen", "count", "", "seen"), "2 of 3"),
        (Reading("path", "hypotheses", "px", "paths"), "5.5 px, 75 %, one of 2"),
    ],
)
def test_a_reading_is_a_number_with_its_unit(reading: Reading, words: str) -> None:
    """Each kind of reading says what the frame has, and a dash where it has nothing."""
    assert format_reading(EXPERIMENTS["ball"], reading, ROW) == words


def test_particles_and_samplers_are_found_by_their_role() -> None:
    """Their series are those that the trackers declare for it; one that is in use is said, one at rest is not."""
    experiment = EXPERIMENTS["ball"]
    names = {series.role: series for series in experiment.all_series() if series.role}
    share = names["share"]
    counts = tuple(float(30 * (place == 1)) for place in range(len(share.components)))
    row = replace(ROW, series={names["particles"].name: 30.0, names["ess"].name: 12.4, share.name: counts})
    assert format_reading(experiment, Reading("particles", "particles"), row) == "30, ESS 12"
    assert format_reading(experiment, Reading("proposal", "samplers"), row) == f"{share.components[1]} 30"
    assert {reading.kind for reading in readings_of(experiment, [row])} >= {"particles", "samplers"}
    bare = {reading.kind for reading in readings_of(experiment, [ROW])}
    assert not bare & {"particles", "samplers", "error"}


def test_every_kind_of_reading_can_be_said() -> None:
    """No kind is forgotten, and none fails on a frame that has nothing of it."""
    kinds: tuple[ReadingKind, ...] = ReadingKind.__args__
    for kind in kinds:
        assert format_reading(EXPERIMENTS["ball"], Reading("x", kind, "", "nothing"), ROW)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (3.0, "", "3"),
        (-0.01, "px", "0.0"),
        (0.25, "", "0.250"),
        (7.6, "frames", "8"),
        (math.inf, "px", MISSING),
        (None, "px", MISSING),
    ],
)
def test_quantities_have_the_decimals_of_their_unit(value: float | None, unit: str, words: str) -> None:
    """Counts are whole, shares have three decimals, lengths one."""
    assert quantity(value, unit) == words
