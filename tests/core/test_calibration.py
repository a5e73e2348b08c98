"""Bands, what is declared of them, and what is said of a target that separates badly or is lost."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from pftrack.core.model.band import (
    ALL,
    DIRECTIONS,
    HALF,
    MOST,
    Band,
    Calibration,
    DeviationBand,
    Direction,
    EstimateBand,
    FlagBand,
    IntervalBand,
    Miscalibration,
)
from pftrack.core.model.measures import Witness, judge_loss
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import Interval
from pftrack.core.model.setup import SETTLED, describe_course
from pftrack.core.model.tracker import Diagnostics
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


# Each kind of band tells from a frame's numbers whether it held the truth.


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


# What is said while tracking of how a target separates from its surroundings.


def test_it_says_since_when() -> None:
    """From the frame on in which most of the newest values are of that grade; a single frame changes nothing."""
    course = [0.05] * 20 + [11.0] * 20
    since = 20 + SETTLED // 2
    assert describe_course(course) == (
        f"Separates not at all since frame {since}: the estimate is 9 % as likely as what is beside it"
    )
    course[10] = 11.0
    assert describe_course(course[:20]) == (
        "Separates well from the start: what is beside the estimate is 5 % as likely as it"
    )


def test_of_what_is_not_known_nothing_is_said() -> None:
    """Before the first frame, and where nothing was measured."""
    assert describe_course([]) == ""
    assert describe_course([0.5, math.nan]) == ""


# Who says that a target is lost.


@pytest.mark.parametrize(
    ("lost", "searching", "expected", "witness"),
    [
        (True, False, True, "truth"),
        (True, True, True, "truth"),
        (False, True, False, "truth"),
        (False, False, False, "truth"),
        (False, None, False, "truth"),
        (None, True, True, "tracker"),
        (None, False, False, "tracker"),
        (None, None, None, ""),
    ],
)
def test_the_first_who_knows_has_the_word(
    lost: bool | None, searching: bool | None, expected: bool | None, witness: Witness
) -> None:
    """The truth has the word where it is known, elsewhere the tracker's own account."""
    assert judge_loss(lost, searching) == (expected, witness)
