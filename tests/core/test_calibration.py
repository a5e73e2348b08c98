"""Bands that are not to be believed are declared once, and said wherever a run is summarised."""

import math
from dataclasses import replace
from typing import Any

import pytest

from pftrack.core.model.band import DIRECTIONS, Calibration, Direction, Miscalibration
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.output.displays import summary_lines
from pftrack.runs.manifest import manifest_of
from pftrack.runs.run import Run

BALL = find("ball")
FIRST, SECOND = list(BALL.trackers)[:2]


def declaring(*faults: Miscalibration) -> Experiment:
    return replace(BALL, quality=Quality(Calibration(faults=faults)))


def doubtful(direction: Direction, **values: tuple[Any, ...]) -> Run:
    """Return a run of a tracker that is declared with some values of parameters."""
    experiment = declaring(Miscalibration((FIRST,), values, direction=direction))
    return Run(experiment, experiment.simulate(), tracker=FIRST, frames=4)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_band_that_is_off_is_said_in_summary_notebook_and_manifest(direction: Direction) -> None:
    """In the direction in which it is off; without a declaration all of them say nothing."""
    run = doubtful(direction)
    run.finish()
    assert run.summary().miscalibration == (direction,)
    for said in (run.summary().as_dict(), manifest_of(run)):
        assert [name for name in DIRECTIONS if said[name]] == [direction]
    assert summary_lines(run)["Error bands"] == DIRECTIONS[direction]
    plain = Run(declaring(), BALL.simulate(), tracker=FIRST, frames=4)
    plain.finish()
    assert plain.miscalibration == ()
    assert plain.summary().as_dict()[direction] is manifest_of(plain)[direction] is False
    assert "Error bands" not in summary_lines(plain)


def test_it_holds_by_tracker_and_values_in_any_frame_so_far() -> None:
    """A run that has come to the setting says so, and one that has only planned to does not."""
    experiment = declaring(Miscalibration((SECOND,)))
    timeline = (Change(2, {"tracker": SECOND}),)
    run = Run(experiment, experiment.simulate(), tracker=FIRST, frames=4, timeline=timeline)
    run.seek(1)
    assert not run.miscalibration
    run.finish()
    assert run.miscalibration == ("overconfident",)
    parameters = experiment.simulate().parameters
    name, value = next(iter(parameters.model_dump().items()))
    assert Miscalibration((FIRST,), {name: (value,)}).holds(FIRST, parameters)
    assert not Miscalibration((FIRST,), {name: ("another",)}).holds(FIRST, parameters)
    assert not Miscalibration((FIRST,), {"unknown": (1,)}).holds(FIRST, parameters)


def test_it_holds_between_bounds() -> None:
    """Both ends are included, an end may be open, and a parameter that is not there lies within none."""
    parameters = BALL.simulate().parameters
    count = parameters.sample_count
    for bounds, wanted in (((0, count), True), ((count, math.inf), True), ((-math.inf, count - 1), False)):
        assert Miscalibration((FIRST,), ranges={"sample_count": bounds}).holds(FIRST, parameters) is wanted
    assert not Miscalibration((FIRST,), ranges={"unknown": (0, 9)}).holds(FIRST, parameters)


@pytest.mark.parametrize(
    ("calibration", "sentence"),
    [
        (Calibration(faults=(Miscalibration(("none",)),)), "no tracker 'none'"),
        (Calibration(faults=(Miscalibration((FIRST,), bands=("mood",)),)), "no band 'mood'"),
        (Calibration(presets=("none",)), "no preset 'none'"),
    ],
)
def test_what_is_not_there_is_refused(calibration: Calibration, sentence: str) -> None:
    """A declaration names trackers, bands and presets of its own experiment."""
    with pytest.raises(ValueError, match=sentence):
        replace(BALL, quality=Quality(calibration))
