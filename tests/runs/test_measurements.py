"""Measuring: a series or a measure that fails is left out, with one warning, and the run is what it was."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core import files
from pftrack.core.model.measures import Measure
from pftrack.core.model.series import Series
from pftrack.core.model.tracker import diagnose
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment, Measured
from pftrack.runs.run import Run
from tests.making import whole_run

SINE = find("sine")
BALL = find("ball")
OWN = (Series("own", "Own"), Series("sound", "Sound"))


def failing(*_: object) -> Any:
    raise KeyError("nothing there")


@pytest.fixture(autouse=True)
def _warned_of_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_warned", set())


def finished(experiment: Experiment, frames: int = 6) -> Run:
    return whole_run(experiment, seed=3, frames=frames)


@pytest.mark.parametrize(
    ("measure", "kept", "warnings"),
    [
        (failing, set(), 1),
        (lambda *_: None, set(), 1),
        (lambda *_: {"own": None, "sound": 2.0}, {"sound"}, 1),
        (lambda *_: {"own": np.zeros(3), "sound": 2.0}, {"sound"}, 1),
        (lambda *_: {"own": "many"}, set(), 1),
        (lambda *_: {"other": 1.0}, set(), 1),
        (lambda *_: {"own": math.nan}, {"own"}, 0),
    ],
    ids=["raises", "nothing", "none", "array", "text", "undeclared", "nan"],
)
def test_a_frame_that_cannot_be_measured(
    measure: Callable[..., Any], kept: set[str], warnings: int, caplog: pytest.LogCaptureFixture
) -> None:
    """What an experiment reports wrongly is missing from all frames, and the estimates are what they are without it."""
    run = finished(replace(SINE, measured=Measured(OWN, measure)))
    for row in run.diagnostics:
        assert row.series.keys() & {"own", "sound", "other"} == kept
        json.dumps(row.as_dict(), allow_nan=False)
    assert len(caplog.records) == warnings
    assert run.estimates_sha256 == finished(SINE).estimates_sha256


def test_a_tracker_that_cannot_be_measured(caplog: pytest.LogCaptureFixture) -> None:
    """The same for what a tracker reports; the experiment's own measurements stay."""
    name = SINE.default_tracker
    trackers = {**SINE.trackers, name: replace(SINE.trackers[name], measure=failing)}
    run = finished(replace(SINE, trackers=trackers, measured=Measured(OWN, lambda *_: {"own": 1.0})))
    assert all(row.series == {"own": 1.0} for row in run.diagnostics)
    (warning,) = caplog.records
    assert all(part in warning.getMessage() for part in (name, "frame 0"))


@pytest.mark.parametrize(
    "frames",
    [failing, lambda _: None, lambda _: np.zeros(2), lambda course: np.full(len(course.errors), np.inf)],
    ids=["raises", "none", "short", "infinite"],
)
@pytest.mark.filterwarnings("error")
def test_a_measure_that_fails_is_absent(frames: Callable[..., Any], caplog: pytest.LogCaptureFixture) -> None:
    """A run has its other measures and its verdict."""
    broken = Measure("broken", "Broken", "Fails.", "median", frames)
    run = finished(replace(BALL, measured=Measured(measures=(broken, *BALL.measured.measures))))
    expected = finished(BALL).summary()
    for _ in range(3):
        assert run.measures() == run.summary().measures == expected.measures
    assert run.summary().verdict == expected.verdict
    assert len(caplog.records) <= 1


def test_what_a_source_says_by_numpy_can_be_written() -> None:
    """Whether a target is hidden is often a comparison of NumPy's numbers; a row of it is JSON all the same."""
    step = finished(find("ball"), frames=1).current
    assert step.frame.target is not None
    target = replace(step.frame.target, hidden=np.bool_(1))
    row = diagnose(replace(step.frame, target=target), step.state, (0.0, False), 1.0)
    assert json.loads(json.dumps(row.as_dict()))["hidden"] is True
