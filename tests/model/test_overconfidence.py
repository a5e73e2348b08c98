"""Bands that are not to be believed are declared once, and said wherever a run is summarised."""

import json
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from pftrack.cli.app import app
from pftrack.displays.run import summary_lines
from pftrack.experiments import find
from pftrack.model.overconfidence import Overconfidence
from pftrack.runs.manifest import manifest_of
from pftrack.runs.run import Change, Run

BALL = find("ball")
FIRST, SECOND = list(BALL.trackers)[:2]


def doubtful(**values: tuple[object, ...]) -> Run:
    """Return a run of a tracker that is declared as overconfident with some values of parameters."""
    declared = Overconfidence((FIRST,), "It counts each frame twice.", values)
    experiment = replace(BALL, overconfident=(declared,))
    return Run(experiment, experiment.simulate(), tracker=FIRST, frames=4)


def test_a_reason_is_said_in_summary_notebook_and_manifest() -> None:
    """Where it holds; without it all of them say nothing."""
    run = doubtful()
    run.finish()
    assert run.summary().overconfident == "It counts each frame twice."
    assert (
        run.summary().as_dict()["overconfident"] == manifest_of(run)["overconfident"] == "It counts each frame twice."
    )
    assert "It counts each frame twice." in summary_lines(run)["Bands"]
    plain = Run(BALL, BALL.simulate(), tracker=FIRST, frames=4)
    plain.finish()
    assert plain.summary().as_dict()["overconfident"] is manifest_of(plain)["overconfident"] is None
    assert "Bands" not in summary_lines(plain)


def test_it_holds_by_tracker_and_values_in_any_frame_so_far() -> None:
    """A run that has come to the setting says so, and one that has only planned to does not."""
    declared = Overconfidence((SECOND,), "Reason.")
    experiment = replace(BALL, overconfident=(declared,))
    timeline = (Change(2, {"tracker": SECOND}),)
    run = Run(experiment, experiment.simulate(), tracker=FIRST, frames=4, timeline=timeline)
    run.seek(1)
    assert run.overconfidence == ""
    run.finish()
    assert run.overconfidence == "Reason."
    parameters = experiment.simulate().parameters
    name, value = next(iter(parameters.model_dump().items()))
    assert Overconfidence((FIRST,), "Reason.", {name: (value,)}).holds(FIRST, parameters)
    assert not Overconfidence((FIRST,), "Reason.", {name: ("another",)}).holds(FIRST, parameters)
    assert not Overconfidence((FIRST,), "Reason.", {"unknown": (1,)}).holds(FIRST, parameters)


def test_a_tracker_that_is_not_there_is_refused() -> None:
    """A declaration names trackers of its own experiment."""
    with pytest.raises(ValueError, match="has no tracker 'none'"):
        replace(BALL, overconfident=(Overconfidence(("none",), "Reason."),))


def test_the_command_line_says_it() -> None:
    """`show` lists the settings; `run --json` has the field in any case."""
    told = CliRunner().invoke(app, ["show", "linkage"]).output
    assert "Bands that are not to be believed" in told
    shown = json.loads(CliRunner().invoke(app, ["show", "linkage", "--json"]).stdout)
    assert {"trackers", "values", "reason"} == set(shown["overconfident"][0])
    made = CliRunner().invoke(app, ["run", "ball", "--frames", "2", "--json"]).stdout
    assert json.loads(made.splitlines()[-1])["overconfident"] is None
