"""Checks of bands: they hold the truth as an experiment declares that they were found to.

A band of 50 % is right if it holds the truth in 45 to 55 % of the reports, one of 95 % in 92 to 98 %, and a region that
promises to hold it in all. It is too narrow if any of its shares is for sure, by more than three standard errors over
seeds; else too wide if any is. What is neither is unclear. A declaration (`pftrack.core.model.band.BandTest`) must not
say otherwise; a band without any is not calibrated.

The quick check uses the first frames of a few runs of the default scene, where trackers still know how they began. It
finds gross errors of bands that are declared right. The thorough one has `SEEDS`, and the presets of the calibration as
well.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pftrack.analysis.alternatives import alternatives
from pftrack.analysis.diagnosis import diagnose_course
from pftrack.analysis.diagnosis.course import course_of
from pftrack.analysis.failures import Entry, FailureRun, run_failure
from pftrack.core.model.band import ALL, HALF, MOST, Finding
from pftrack.core.model.preset import CAUSES
from pftrack.core.model.recipe import Change
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.loss_probability import Past, feature_names
from pftrack.runs.coverage import Coverage, count_held, measured_parameters, measured_run, pool_counts
from pftrack.runs.many import Trial, read_blocks
from pftrack.testing.check import FRAMES, SEED, Check, demand, each_tracker, straight
from pftrack.testing.numbers import UNKNOWN

LIMITS: Mapping[float, tuple[float, float]] = {HALF: (0.45, 0.55), MOST: (0.92, 0.98), ALL: (1.0, 1.0)}
"""The least and the greatest share of the reports that is accepted for a band."""

SEEDS = range(40, 50)
"""Seeds of the thorough check; the declarations of pftrack's own experiments rest on others (`tools/coverage.py`)."""

FEW, SLACK = range(3), 0.25
"""Seeds of the quick check, and its additional tolerance: the first frames differ from the others."""

SURELY, SURELY_OF_TEN = 3.0, 4.09
"""Standard errors by which a share is outside for sure; the same if ten runs give the error, by Student's t."""


def thorough_checks(experiment: Experiment) -> Iterator[Check]:
    """Yield checks over ten other seeds of the default scene, and of the presets that the calibration names."""
    for tracker in experiment.trackers:
        for preset in ("", *experiment.quality.calibration.presets):
            name = f"bands of many runs hold the truth as often as they say ({tracker}, {preset or 'default'})"
            yield Check(name, partial(_demand, experiment, tracker, preset))


def judge(shares: Sequence[Coverage], slack: float = 0.0, surely: float = SURELY) -> Finding:
    """Return what all shares of a band show: off if one is for sure, right if all are within the limits."""
    narrow, wide, right = False, False, True
    for one in shares:
        low, high = LIMITS[one.promised]
        margin = 0.0 if one.promised == ALL else surely * np.nan_to_num(one.error) + slack
        narrow |= one.share + margin < low
        wide |= one.share - margin > high
        right &= low <= one.share <= high
    return "overconfident" if narrow else "underconfident" if wide else "right" if right else "uncalibrated"


def find_contradictions(
    said: Mapping[str, Finding], measured: Sequence[Coverage], *, slack: float = 0.0, surely: float = SURELY
) -> Iterator[str]:
    """Yield what was measured of the bands of a tracker and is declared otherwise, a clause each.

    A band that is off may be too narrow in some runs and too wide in others, so only what is right contradicts it.

    Args:
        said: Declared finding of each band in this setting, by its subject.
        measured: Measured shares of all its bands.
        slack: Tolerance beyond standard errors; if not 0, only bands that are declared right are judged.
        surely: Standard errors by which a share is outside for sure.
    """
    for of, finding in said.items():
        shares = [one for one in measured if one.of == of]
        found = judge(shares, slack, surely)
        if {"right"} < {finding, found} - {"uncalibrated"} and (finding == "right" or not slack):
            yield f"the band of the {of} {_words(shares)}: it is declared {finding}, and is {found}"


def _words(shares: Sequence[Coverage]) -> str:
    told = [f"{100 * one.promised:.0f} % holds the truth in {100 * one.share:.1f} %" for one in shares]
    return f"of {' and that of '.join(told)} of the reports"


@each_tracker("bands hold the truth as often as they say")
def _few_runs_hold(experiment: Experiment, tracker: str) -> None:
    _demand(experiment, tracker, "", FEW, FRAMES, SLACK, SURELY)


def declared_of(experiment: Experiment, tracker: str, preset: str) -> dict[str, Finding]:
    """Return what is declared of a tracker's bands with a preset, or in the default scene if it is empty."""
    return experiment.findings(tracker, measured_parameters(experiment, preset, SEEDS[0]))


def _demand(
    experiment: Experiment,
    tracker: str,
    preset: str,
    seeds: range = SEEDS,
    frames: int | None = None,
    slack: float = 0.0,
    surely: float = SURELY_OF_TEN,
) -> None:
    said, counts = declared_of(experiment, tracker, preset), []
    for seed in () if set(said.values()) <= {"uncalibrated"} else seeds:
        run = measured_run(experiment, tracker, preset, seed, frames or experiment.quality.calibration.frames)
        run.finish()
        counts.append(count_held(run))
    wrong = list(find_contradictions(said, pool_counts(counts), slack=slack, surely=surely))
    demand(not wrong, f"{tracker}: {'; '.join(wrong)}")


# Checks on losses: failures, alternatives to the run, and the probability of the loss.
#
# Each failure that an experiment declares is diagnosed as what it is, and its cure cures. Other seeds from a frame on
# are branches with these, and every change that is tried can be computed. A loss probability is a probability, the same
# on every path to it, and rises with a loss. The sign of two effects is known: a tracker that searches its target has
# lost it, and a lower similarity makes the target less likely to be there. Other signs are unknown. A filter that is
# seized by a look-alike, or by a wall, has a better log evidence there than it had behind the pillar, its particles
# carry more, and its estimate rests. So these may have weights of either sign.

MARKED = 7
"""A mark in so many pictures."""
AT_END = 5
"""Number of frames at the end that decide whether the target is held."""


def failure_checks(experiment: Experiment) -> Iterator[Check]:
    """Yield a check of each failure."""
    for number, failure in enumerate(experiment.failures, 1):
        shown = Entry(number, experiment, failure)
        name = f"each failure fails in its way, and its cure cures ({failure.id})"
        yield Check(name, partial(_fails_and_is_cured, shown))


def _fails_and_is_cured(shown: Entry) -> None:
    failure, cured, name = run_failure(shown), run_failure(shown, cured=True), shown.failure.id
    frame = shown.failure.frame
    demand(frame + 1 < len(failure.rows), f"{name} must stand before its last frame, got {frame}")
    demand(not failure.rows[frame].is_lost, f"{name} must stand at a frame in which the target is held, got {frame}")
    demand(failure.rows[frame + 1].is_lost, f"{name} must stand at the frame before the loss, got {frame}")
    cause = CAUSES[shown.failure.cause]
    demand(failure.shown, f"{name} must be diagnosed as {cause}, got: {failure.diagnosis.sentence}")
    demand(_lost_at_end(failure) == AT_END, f"{name} must end with {AT_END} lost frames")
    demand(not cured.shown, f"the cure of {name} must cure, got: {cured.finding}")
    demand(_lost_at_end(cured) == 0, f"the cure of {name} must hold the target in the last {AT_END} frames")
    demand(cured.recipe.seed == failure.recipe.seed, f"the cure of {name} must be shown on the same seed")
    _is_told_by_marks(shown, failure)


def _is_told_by_marks(shown: Entry, failure: FailureRun) -> None:
    """Check reports with marks in only a few pictures: they must not contain unknown numbers."""
    series, unit = shown.experiment.all_series(), shown.experiment.judge.unit
    rows = [row if row.frame % MARKED == 0 else replace(row, **UNKNOWN) for row in failure.rows]
    course = course_of(rows, series, unit=unit)
    for frame in range(0, len(rows), 10):
        for sign in diagnose_course(course, frame).signs:
            demand("nan" not in sign.words, f"{shown.failure.id} must be explained by known values, got: {sign.words}")


def _lost_at_end(done: FailureRun) -> int:
    return sum(row.is_lost for row in done.rows[-AT_END:])


BEGIN = FRAMES - 4
OTHER_SEED = SEED + 1


@each_tracker("other seeds from a frame on are a branch with these seeds")
def _other_seeds_are_branches(experiment: Experiment, tracker: str) -> None:
    branch = straight(experiment, tracker).run.branch(BEGIN, {"seed": OTHER_SEED})
    one = Trial(experiment, branch.source, branch.timeline, OTHER_SEED, branch.current.state)
    for block in read_blocks(branch.source, branch.timeline.history, BEGIN + 1, FRAMES - 1):
        one.take(block)
    branch.finish()
    errors = np.array([np.nan if row.error is None else row.error for row in branch.diagnostics[BEGIN + 1 :]])
    demand(
        np.array_equal(one.errors, errors, equal_nan=True),
        f"runs that continue from frame {BEGIN} with the seed {OTHER_SEED} give other errors than a branch: "
        f"{one.errors.tolist()} for {errors.tolist()}",
    )


@each_tracker("every change that is tried of a run can be computed")
def _changes_can_be_computed(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    state = run.branch(BEGIN).current.state
    for each in alternatives(run, BEGIN + 1):
        if each.kind == "tracker":  # every switch between two trackers has a separate check
            continue
        timeline = run.timeline.insert(Change(BEGIN + 1, each.values)) if each.values else run.timeline
        one = Trial(experiment, run.source, timeline, OTHER_SEED, state)
        try:
            for block in read_blocks(run.source, timeline.history, BEGIN + 1, BEGIN + 1):
                one.take(block)
        except Exception as error:  # noqa: BLE001 - it is another package's
            demand(False, f"{each.title} must be computed, got {type(error).__name__}: {error}")


@each_tracker("its loss probability is one, told at once or frame by frame")
def _is_probability(experiment: Experiment, tracker: str) -> None:
    declared = experiment.quality.loss_probability
    for name in {**declared.models, **declared.refused}:
        demand(
            name in experiment.trackers, f"{experiment.id} has no tracker {name!r}, which its loss probability names"
        )
    model = declared.models.get(tracker)
    if model is None:
        return
    wanted, given = len(feature_names(model.signals)), len(model.regression.weights)
    demand(given == wanted, f"the loss probability of {tracker} must weigh {wanted} features, got {given}")
    rows = straight(experiment, tracker).run.diagnostics
    _, told = model.follow(Past(), rows)
    demand(bool(np.isnan(told[0])), f"the loss probability of frame 0 must not be known, got {told[0]}")
    inside = (told[1:] >= 0.0) & (told[1:] <= 1.0)
    demand(bool(inside.all()), f"loss probabilities must be between 0 and 1, got {told[1:][~inside]}")
    past, one_by_one = Past(), []
    for row in rows:
        past, found = model.follow(past, [row])
        one_by_one += found.tolist()
    same = np.array_equal(one_by_one, told, equal_nan=True)
    demand(same, f"the loss probability of {tracker} is another one where it is told frame by frame")


@each_tracker("its loss probability rises when it searches, or when little is like its target")
def _rises(experiment: Experiment, tracker: str) -> None:
    model = experiment.quality.loss_probability.models.get(tracker)
    if model is None:
        return
    rows = straight(experiment, tracker).run.diagnostics
    _, told = model.follow(Past(), rows)
    likeness = {one.name: 0.0 for one in model.series.values() if one.role == "likeness"}
    shown = {name: value for name, value in likeness.items() if name in model.signals}
    worse = {}
    if "searching" in model.signals and rows[-1].searching is False:
        worse["it searches"] = replace(rows[-1], searching=True)
    if shown.keys() & rows[-1].series.keys():
        worse["nothing is like its target"] = replace(rows[-1], series={**rows[-1].series, **shown})
    for what, row in worse.items():
        _, found = model.follow(Past(), [*rows[:-1], row])
        demand(
            bool(found[-1] >= told[-1]),
            f"the loss probability of {tracker} must not fall when {what}, got {found[-1]} after {told[-1]}",
        )
