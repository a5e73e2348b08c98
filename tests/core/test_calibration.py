"""Bands, what is declared of them, and what is said of a target that separates badly or is lost."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from pftrack.core.model import band
from pftrack.core.model.measures import judge_loss
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


def declaring(*tests: band.BandTest, **more: Any) -> Experiment:
    return replace(BALL, quality=Quality(band.Calibration(tested=tests, **more)))


@pytest.mark.parametrize("finding", ["right", *band.DOUBTS])
def test_what_was_found_is_said_in_summary_notebook_and_manifest(finding: band.Finding) -> None:
    """A doubt, or nothing where bands were found right, of the tracker in any frame so far."""
    other = band.BandTest((SECOND,), found=finding)
    experiment, change = declaring(band.BandTest((FIRST,)), other), Change(2, {"tracker": SECOND})
    run = Run(experiment, experiment.simulate(), tracker=FIRST, frames=4, timeline=(change,))
    run.seek(1)
    assert run.doubts == ()
    run.finish()
    doubts = [] if finding == "right" else [finding]
    assert list(run.summary().doubts) == list(run.doubts) == doubts
    for said in (run.summary().as_dict(), manifest_of(run)):
        assert [name for name in band.DOUBTS if said[name]] == doubts
    assert summary_lines(run).get("Error bands") == band.DOUBTS.get(finding)


@pytest.mark.parametrize(
    ("values", "finding"),
    [
        ({}, "right"),
        ({"sample_count": 700, "resampling": "residual"}, "right"),
        ({"sample_count": 700, "process_noise_px": 1.5}, "uncalibrated"),
        ({"resampling": "stratified"}, "uncalibrated"),
        ({"gamma_min_px": 9.0}, "right"),
        ({"layout": 8}, "right"),
    ],
)
def test_what_is_not_declared_is_not_calibrated(values: dict[str, Any], finding: band.Finding) -> None:
    """Known is the default scene and what is named around it; scenes of its kind and what moves nothing are alike.

    What is named must be within though it is the default.
    """
    elsewhere = declaring(band.BandTest((FIRST,), {"sample_count": (900, 1000)}))
    assert elsewhere.findings(FIRST, BALL.simulate().parameters) == {"estimate": "uncalibrated"}
    within = {"sample_count": (700, 900), "resampling": ("systematic", "residual")}
    experiment = declaring(band.BandTest((FIRST,), within), scene="layout")
    parameters = revise(BALL.simulate().parameters, values)
    assert experiment.findings(FIRST, parameters) == {"estimate": finding}
    assert experiment.findings(SECOND, parameters) == {"estimate": "uncalibrated"}


@pytest.mark.parametrize("name", EXPERIMENTS.own)
def test_nothing_is_calibrated_on_recordings(name: str) -> None:
    """No scene there is the default one, whatever the values are."""
    experiment = EXPERIMENTS[name]
    for kind in experiment.video.footage if experiment.quality.calibration.bands else ():
        parameters = experiment.parameters_on(kind)
        assert {experiment.doubts((tracker, parameters)) for tracker in experiment.trackers} == {("uncalibrated",)}


def test_a_band_of_several_may_be_off_alone() -> None:
    """Then it is said how it is off, and not that others are unknown."""
    bands = (band.EstimateBand(), band.EstimateBand("other"))
    off = band.BandTest((FIRST,), bands=("other",), found="underconfident")
    parameters = BALL.simulate().parameters
    assert declaring(off, bands=bands).doubts((FIRST, parameters)) == ("underconfident",)
    right = band.BandTest((FIRST,), bands=("estimate",))
    assert declaring(right, bands=bands).doubts((FIRST, parameters)) == ("uncalibrated",)
    assert declaring(right, off, bands=bands).findings(FIRST, parameters) == {"estimate": "right", "other": off.found}


def test_what_is_not_there_is_refused() -> None:
    """A declaration names trackers, bands and presets of its own experiment."""
    with pytest.raises(ValueError, match="no band 'mood'"):
        declaring(band.BandTest((FIRST,), bands=("mood",)))
    with pytest.raises(ValueError, match="no preset 'none'"):
        declaring(presets=("none",))


# Each kind of band tells from a frame's numbers whether it held the truth.


def row(truth: tuple[float, ...] | None = None, **series: Any) -> Diagnostics:
    return Diagnostics(1, 0.0, (0.0, 0.0), (1.0, 1.0), 0.0, truth, None, None, None, None, None, None, 0.0, series)


ANGLE = band.DeviationBand("angle", ("a",), ("a_sd",), ("a_true",), turn=360.0)
LENGTH = band.IntervalBand("length", ("l",), ("l_true",))


@pytest.mark.parametrize(
    ("kind", "frame", "held"),
    [
        (band.EstimateBand(), row((0.6, 1.9)), {band.HALF: [True, False], band.MOST: [True, True]}),
        (band.EstimateBand(), row((0.7, 2.0)), {band.HALF: [False, False], band.MOST: [True, False]}),
        (band.EstimateBand(), row(None), {}),
        (ANGLE, row(a=359.0, a_sd=1.0, a_true=0.5), {band.HALF: [False], band.MOST: [True]}),
        (ANGLE, row(a=math.nan, a_sd=1.0, a_true=0.5), {band.HALF: [False], band.MOST: [False]}),
        (ANGLE, row(a=1.0, a_sd=1.0), {band.HALF: [], band.MOST: []}),
        (LENGTH, row(l=Interval(1.0, 2.0), l_true=2.0), {band.MOST: [True]}),
        (LENGTH, row(l=Interval(1.0, 2.0), l_true=2.1), {band.MOST: [False]}),
        (LENGTH, row(l_true=2.1), {band.MOST: []}),
        (band.FlagBand("region", {band.ALL: "in"}), row(**{"in": 0.0}), {band.ALL: [False]}),
        (band.FlagBand("region", {band.ALL: "in"}), row(), {band.ALL: []}),
        (band.FlagBand("points", {band.HALF: "in"}), row(**{"in": (1.0, 0.0, math.nan)}), {band.HALF: [True, False]}),
    ],
)
def test_what_is_held(kind: band.Band, frame: Diagnostics, held: Mapping[float, list[bool]]) -> None:
    """Ends count as within, angles go round, what is not finite holds nothing, and what is not known does not count."""
    assert {share: values.tolist() for share, values in kind.held(frame).items()} == held


# What is said while tracking of how a target separates from its surroundings.


def test_it_says_since_when() -> None:
    """From the frame on in which most of the newest values are of that grade; a single frame changes nothing.

    Before the first frame, and where nothing was measured, nothing is said.
    """
    course = [0.05] * 20 + [11.0] * 20
    since = 20 + SETTLED // 2
    told = describe_course(course)
    assert told == f"Separates not at all since frame {since}: the estimate is 9 % as likely as what is beside it"
    course[10] = 11.0
    told = describe_course(course[:20])
    assert told == "Separates well from the start: what is beside the estimate is 5 % as likely as it"
    assert [describe_course(unknown) for unknown in ([], [0.5, math.nan])] == ["", ""]


def test_the_first_who_knows_says_whether_a_target_is_lost() -> None:
    """The truth decides where it is known, elsewhere the tracker's own account."""
    said = [judge_loss(*each) for each in ((True, False), (False, True), (None, True), (None, None))]
    assert said == [(True, "truth"), (False, "truth"), (True, "tracker"), (None, "")]
