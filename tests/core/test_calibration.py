"""Bands, what is declared of them, and what is said of a target that separates badly or is lost."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from pftrack.core.model.band import (
    ALL,
    DOUBTS,
    HALF,
    MOST,
    Band,
    BandTest,
    Calibration,
    DeviationBand,
    EstimateBand,
    Finding,
    FlagBand,
    IntervalBand,
)
from pftrack.core.model.measures import Witness, judge_loss
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import Interval
from pftrack.core.model.setup import SETTLED, describe_course
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.output.displays import summary_lines
from pftrack.runs.manifest import manifest_of
from pftrack.runs.run import Run

BALL = find("ball")
FIRST, SECOND = list(BALL.trackers)[:2]


def declaring(*tests: BandTest, **more: Any) -> Experiment:
    return replace(BALL, quality=Quality(Calibration(tested=tests, **more)))


def run_of(experiment: Experiment, **more: Any) -> Run:
    return Run(experiment, experiment.simulate(), tracker=FIRST, frames=4, **more)


@pytest.mark.parametrize("finding", ["right", *DOUBTS])
def test_what_was_found_is_said_in_summary_notebook_and_manifest(finding: Finding) -> None:
    """A doubt, or nothing where bands were found right."""
    run = run_of(declaring(BandTest((FIRST,), found=finding)))
    run.finish()
    doubts = [] if finding == "right" else [finding]
    assert list(run.summary().doubts) == list(run.doubts) == doubts
    for said in (run.summary().as_dict(), manifest_of(run)):
        assert [name for name in DOUBTS if said[name]] == doubts
    assert summary_lines(run).get("Error bands") == DOUBTS.get(finding)


def test_it_holds_by_tracker_in_any_frame_so_far() -> None:
    """A run that has come to another setting says so, and one that has only planned to does not."""
    experiment = declaring(BandTest((FIRST,)), BandTest((SECOND,), found="overconfident"))
    run = run_of(experiment, timeline=(Change(2, {"tracker": SECOND}),))
    run.seek(1)
    assert run.doubts == ()
    run.finish()
    assert run.doubts == ("overconfident",)


@pytest.mark.parametrize(
    ("values", "finding"),
    [
        ({}, "right"),
        ({"sample_count": 850}, "right"),
        ({"sample_count": 700, "resampling": "residual"}, "right"),
        ({"sample_count": 901}, "uncalibrated"),
        ({"sample_count": 700, "process_noise_px": 1.5}, "uncalibrated"),
        ({"resampling": "stratified"}, "uncalibrated"),
        ({"gamma_min_px": 9.0}, "right"),
        ({"lost_radii": 9.0}, "right"),
        ({"layout": 8}, "right"),
    ],
)
def test_what_is_not_declared_is_not_calibrated(values: dict[str, Any], finding: Finding) -> None:
    """Known is the default scene and what is named around it; scenes of its kind and what moves nothing are alike."""
    within = {"sample_count": (700, 900), "resampling": ("systematic", "residual")}
    experiment = declaring(BandTest((FIRST,), within), scene="layout")
    parameters = revise(BALL.simulate().parameters, values)
    assert experiment.findings(FIRST, parameters) == {"estimate": finding}
    assert experiment.findings(SECOND, parameters) == {"estimate": "uncalibrated"}


def test_what_is_named_must_be_within_though_it_is_the_default() -> None:
    """Bands may be right elsewhere, and not in the default scene."""
    experiment, parameters = declaring(BandTest((FIRST,), {"sample_count": (900, 1000)})), BALL.simulate().parameters
    assert experiment.findings(FIRST, parameters) == {"estimate": "uncalibrated"}
    assert experiment.findings(FIRST, revise(parameters, {"sample_count": 950})) == {"estimate": "right"}


@pytest.mark.parametrize("name", EXPERIMENTS.own)
def test_nothing_is_calibrated_on_recordings(name: str) -> None:
    """No scene there is the default one, whatever the values are."""
    experiment = EXPERIMENTS[name]
    for kind in experiment.video.footage if experiment.quality.calibration.bands else ():
        parameters = experiment.parameters_on(kind)
        assert {experiment.doubts((tracker, parameters)) for tracker in experiment.trackers} == {("uncalibrated",)}


def test_a_band_of_several_may_be_off_alone() -> None:
    """Then it is said how it is off, and not that others are unknown."""
    bands = (EstimateBand(), EstimateBand("other"))
    off = BandTest((FIRST,), bands=("other",), found="underconfident")
    parameters = BALL.simulate().parameters
    assert declaring(off, bands=bands).doubts((FIRST, parameters)) == ("underconfident",)
    right = BandTest((FIRST,), bands=("estimate",))
    assert declaring(right, bands=bands).doubts((FIRST, parameters)) == ("uncalibrated",)
    assert declaring(right, off, bands=bands).findings(FIRST, parameters) == {"estimate": "right", "other": off.found}


@pytest.mark.parametrize(
    ("calibration", "sentence"),
    [
        (Calibration(tested=(BandTest(("none",)),)), "no tracker 'none'"),
        (Calibration(tested=(BandTest((FIRST,), bands=("mood",)),)), "no band 'mood'"),
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
