"""Bands that are not to be believed are declared once, and said wherever a run is summarised."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from typer.testing import CliRunner

from pftrack.cli.app import app
from pftrack.core.model.band import TITLES, Calibration, Direction, Miscalibration
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.output.displays import summary_lines
from pftrack.runs.manifest import manifest_of
from pftrack.runs.run import Run

BALL = find("ball")
FIRST, SECOND = list(BALL.trackers)[:2]
REASON = "It counts each frame twice."


def declaring(*faults: Miscalibration) -> Experiment:
    return replace(BALL, calibration=Calibration(faults=faults))


def doubtful(direction: Direction, **values: tuple[Any, ...]) -> Run:
    """Return a run of a tracker that is declared with some values of parameters."""
    experiment = declaring(Miscalibration((FIRST,), REASON, values, direction=direction))
    return Run(experiment, experiment.simulate(), tracker=FIRST, frames=4)


@pytest.mark.parametrize("direction", TITLES)
def test_a_reason_is_said_in_summary_notebook_and_manifest(direction: Direction) -> None:
    """Where it holds, and in the direction in which it holds; without it all of them say nothing."""
    run = doubtful(direction)
    run.finish()
    assert run.summary().miscalibration == {direction: REASON}
    for said in (run.summary().as_dict(), manifest_of(run)):
        assert {name: said[name] for name in TITLES} == {name: REASON if name == direction else None for name in TITLES}
    assert summary_lines(run)[TITLES[direction]] == REASON
    plain = Run(declaring(), BALL.simulate(), tracker=FIRST, frames=4)
    plain.finish()
    assert not plain.miscalibration
    assert plain.summary().as_dict()[direction] is manifest_of(plain)[direction] is None
    assert not set(TITLES.values()) & set(summary_lines(plain))


def test_it_holds_by_tracker_and_values_in_any_frame_so_far() -> None:
    """A run that has come to the setting says so, and one that has only planned to does not."""
    experiment = declaring(Miscalibration((SECOND,), "Reason."))
    timeline = (Change(2, {"tracker": SECOND}),)
    run = Run(experiment, experiment.simulate(), tracker=FIRST, frames=4, timeline=timeline)
    run.seek(1)
    assert not run.miscalibration
    run.finish()
    assert run.miscalibration == {"overconfident": "Reason."}
    parameters = experiment.simulate().parameters
    name, value = next(iter(parameters.model_dump().items()))
    assert Miscalibration((FIRST,), "Reason.", {name: (value,)}).holds(FIRST, parameters)
    assert not Miscalibration((FIRST,), "Reason.", {name: ("another",)}).holds(FIRST, parameters)
    assert not Miscalibration((FIRST,), "Reason.", {"unknown": (1,)}).holds(FIRST, parameters)


def test_it_holds_between_bounds() -> None:
    """Both ends are included, an end may be open, and a parameter that is not there lies within none."""
    parameters = BALL.simulate().parameters
    count = parameters.sample_count
    for bounds, wanted, words in (
        ((0, count), True, f"sample_count 0 to {count}"),
        ((count, math.inf), True, f"sample_count from {count}"),
        ((-math.inf, count - 1), False, f"sample_count up to {count - 1}"),
    ):
        one = Miscalibration((FIRST,), "Reason.", ranges={"sample_count": bounds})
        assert (one.holds(FIRST, parameters), one.setting) == (wanted, words)
        assert json.loads(json.dumps(one.as_dict(), allow_nan=False))["ranges"]["sample_count"]
    assert not Miscalibration((FIRST,), "Reason.", ranges={"unknown": (0, 9)}).holds(FIRST, parameters)


@pytest.mark.parametrize(
    ("calibration", "sentence"),
    [
        (Calibration(faults=(Miscalibration(("none",), "Reason."),)), "no tracker 'none'"),
        (Calibration(faults=(Miscalibration((FIRST,), "Reason.", bands=("mood",)),)), "no band 'mood'"),
        (Calibration(presets=("none",)), "no preset 'none'"),
    ],
)
def test_what_is_not_there_is_refused(calibration: Calibration, sentence: str) -> None:
    """A declaration names trackers, bands and presets of its own experiment."""
    with pytest.raises(ValueError, match=sentence):
        replace(BALL, calibration=calibration)


def test_the_command_line_says_it() -> None:
    """`show` lists the settings of either direction; `run --json` has the fields in any case."""
    told = CliRunner().invoke(app, ["show", "linkage"]).output
    assert all(title in told for title in TITLES.values())
    shown = json.loads(CliRunner().invoke(app, ["show", "linkage", "--json"]).stdout)
    assert {"direction", "trackers", "bands", "values", "ranges", "reason"} == set(shown["miscalibrated"][0])
    made = CliRunner().invoke(app, ["run", "prism", "--frames", "2", "--json"]).stdout
    assert {name: json.loads(made.splitlines()[-1])[name] for name in TITLES} == dict.fromkeys(TITLES)
