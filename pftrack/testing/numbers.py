"""Checks of what is written down of every frame: finite, of the right length, and as declared."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pftrack.analysis.diagnosis.course import course_of
from pftrack.analysis.diagnosis.diagnosis import diagnose_course
from pftrack.core.model.series import check_value, columns
from pftrack.experiments.experiment import Experiment
from pftrack.runs.scoring import evaluated_run
from pftrack.testing.check import Check, CheckError, copy_arrays, demand, each_tracker, straight

UNKNOWN: Mapping[str, Any] = {"truth": None, "error": None, "lost": None, "hidden": None, "extent": None}
"""Of a row, where no truth is known."""


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, each for every tracker."""
    yield from each_tracker(
        experiment,
        [
            ("estimates are finite and as long as positions are", _estimates_are_finite),
            ("its states are values", _states_are_values),
            ("series are as declared", _series_are_declared),
            ("measures are a number a frame", _measures_are_numbers),
        ],
    )


def _estimates_are_finite(experiment: Experiment, tracker: str) -> None:
    course = straight(experiment, tracker)
    length = len(course.run.source.start.position)
    for step in course.steps:
        frame, state = step.diagnostics.frame, step.state
        for name, values in (("estimate", state.estimate), ("sigma", state.sigma)):
            shape = np.shape(values)
            demand(shape == (length,), f"the {name} of frame {frame} must have the shape ({length},), got {shape}")
        finite, sigma = np.isfinite(state.estimate).all(), state.sigma
        demand(finite, f"the estimate of frame {frame} must be finite, got {state.estimate}")
        known = sigma[~np.isnan(sigma)]
        demand(
            len(known), f"the sigma of frame {frame} must be known of a number in the experiment's unit, got {sigma}"
        )
        demand(np.isfinite(known).all(), f"the sigma of frame {frame} must be finite or NaN, got {sigma}")
        demand((known >= 0).all(), f"the sigma of frame {frame} must not be negative, got {sigma}")
        evidence = state.log_evidence
        demand(evidence < np.inf, f"the log evidence of frame {frame} must be a number or -inf, got {evidence}")


def _states_are_values(experiment: Experiment, tracker: str) -> None:
    known = straight(experiment, tracker)
    first = known.steps[0]
    demand(first.state.nbytes > 0, f"a state must say how much memory it takes, got {first.state.nbytes} bytes")
    for name, array in copy_arrays(first).items():
        same = np.array_equal(array, known.begun[name], equal_nan=array.dtype.kind == "f")
        demand(same, f"{name} of the state of frame 0 changed while later frames were computed; states must not change")


def _series_are_declared(experiment: Experiment, tracker: str) -> None:
    declared = {series.name: series for series in experiment.all_series(tracker)}
    for step in straight(experiment, tracker).steps:
        frame = step.diagnostics.frame
        # A run leaves out what cannot be used, so they are asked directly.
        reported = dict(experiment.trackers[tracker].measure(step.state))
        if experiment.measure:
            reported |= experiment.measure(step.frame, step.state)
        for name, value in reported.items():
            demand(name in declared, f"frame {frame} has a series {name!r}, which {tracker} does not declare")
            try:
                check_value(declared[name], value)
            except ValueError as error:
                raise CheckError(f"frame {frame}: {error}") from None
            for column in columns(declared[name], [value]).values():
                demand(not np.isinf(column).any(), f"{name} of frame {frame} must be finite or NaN, got {value}")
    _demand_explanations(experiment, tracker)


def _measures_are_numbers(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    course = evaluated_run(experiment, run.diagnostics)
    for measure in experiment.run_measures:
        values = measure.frames(course)
        shape, kind = np.shape(values), np.asarray(values).dtype
        wanted = (len(run.diagnostics),)
        fits = shape == wanted and kind.kind in "fiub"
        demand(fits, f"the measure {measure.name} must give numbers {wanted}, one a frame, got {kind} {shape}")


def _demand_explanations(experiment: Experiment, tracker: str) -> None:
    """Demand that a loss can be explained from the series.

    The later half of the run is taken for lost, by the truth, and by the tracker's own account without a truth.
    """
    run = straight(experiment, tracker).run
    half = len(run.diagnostics) // 2
    by_truth = [replace(row, lost=row.frame >= half) for row in run.diagnostics]
    by_account = [replace(row, **UNKNOWN, searching=row.frame >= half) for row in run.diagnostics]
    for rows in (by_truth, by_account):
        course = course_of(rows, experiment.all_series(tracker), unit=experiment.unit)
        found = diagnose_course(course)
        demand(found.lost and found.frame == half, f"the loss in frame {half} must be explained, got: {found.sentence}")
        for sign in found.signs:
            demand(0 <= sign.since < len(rows), f"{sign.cause} must begin in a frame of the run, got {sign.since}")
            demand(0 <= sign.strength <= 1, f"the strength of {sign.cause} must be 0 to 1, got {sign.strength}")
            demand(bool(sign.words), f"{sign.cause} must be said in words")
        json.dumps(found.as_dict(), allow_nan=False)
