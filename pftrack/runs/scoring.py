"""Verdicts: what a whole run comes to, judged by the frames whose truth is known."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.measures import EvaluatedRun, Measure, is_success
from pftrack.core.model.parameters import Parameters, with_role
from pftrack.core.model.series import Series, columns, reduce
from pftrack.core.model.tracker import TrackState
from pftrack.experiments.experiment import Experiment

__all__ = [
    "Verdict",
    "allowed_loss",
    "estimates_hash",
    "evaluated_run",
    "extent_series",
    "judge",
    "judge_estimates",
    "judge_state",
    "reductions",
]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of a run.

    Attributes:
        labelled_frames: Frames whose truth is known.
        mean_error: Over those, in the experiment's unit; None where there are none, or an estimate is not finite.
        success: Whether the measure that decides is high enough; None where it is not known.
        success_measure: Name of that measure, a share; None where it is not known.
        lost_frames: How many of them were lost; None where there are none, or no notion of lost.
        first_lost_frame: The first of them, or None.
    """

    labelled_frames: int
    mean_error: float | None
    success: bool | None
    success_measure: str | None
    lost_frames: int | None
    first_lost_frame: int | None


def judge_state(
    experiment: Experiment,
    state: TrackState,
    target: Target | None,
    parameters: Any,  # noqa: ANN401 - the experiment's own model
) -> tuple[float | None, bool | None]:
    """Return error and verdict of a frame, None where the truth is unknown or there is no notion of lost."""
    if target is None:
        return None, None
    error = float(experiment.error(state.estimate, target.position))
    if math.isnan(error):  # of an estimate that is not finite: NaN would count as an unknown truth
        error = math.inf
    missed = experiment.missed(state, target) if experiment.missed else None
    if missed is not None:
        return error, bool(missed)
    judged = experiment.lost
    return error, bool(judged(error, target.size, parameters)) if judged else None


def judge_estimates(
    experiment: Experiment,
    estimates: NDArray[np.float64],
    frames: Sequence[Frame],
    parameters: Any,  # noqa: ANN401 - the experiment's own model
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what `judge_state` says of each of many estimates, where `lost` alone decides.

    Args:
        experiment: One without `missed`.
        estimates: (L, d).
        frames: The L frames.
        parameters: In force in all of them.

    Returns:
        Errors (L,), and 1 where the target is lost, else 0 (L,); NaN where the truth is unknown.
    """
    positions, sizes = np.full((len(frames), estimates.shape[1]), np.nan), np.zeros(len(frames))
    for place, frame in enumerate(frames):
        if frame.target is not None:
            positions[place], sizes[place] = frame.target.position, frame.target.size
    known = np.isfinite(positions).all(axis=1)
    errors = np.asarray(experiment.error(estimates, positions), np.float64)
    errors = np.where(known & np.isnan(errors), np.inf, errors)
    lost = np.full(len(frames), np.nan)
    if experiment.lost is not None:
        lost[known] = np.asarray(experiment.lost(errors, sizes, parameters))[known]
    return errors, lost


def judge(course: EvaluatedRun, decisive: Measure, allowed_share: float) -> Verdict:
    """Judge a run.

    Args:
        course: The run beside its truth.
        decisive: The measure that decides on success, a share.
        allowed_share: Share of the frames with known truth, 0..1, that may miss in a success.
    """
    known = course.errors[~np.isnan(course.errors)]
    mean_error = float(known.mean()) if len(known) and np.isfinite(known).all() else None
    success = is_success(decisive, course, allowed_share)
    name = None if success is None else decisive.name
    if course.lost is None or not len(known):
        return Verdict(len(known), mean_error, success, name, None, None)
    count = int(np.count_nonzero(course.lost))
    first = int(np.argmax(course.lost)) if count else None
    return Verdict(len(known), mean_error, success, name, count, first)


def evaluated_run(experiment: Experiment, rows: Sequence[Diagnostics]) -> EvaluatedRun:
    """Return a run beside its truth, from the numbers of all its frames."""
    unknown = (np.nan,) * len(rows[0].estimate)
    extent = extent_series(experiment.all_series())
    return EvaluatedRun(
        np.array([row.estimate for row in rows]),
        np.array([row.truth or unknown for row in rows]),
        np.array([np.nan if row.error is None else row.error for row in rows]),
        np.array([bool(row.lost) for row in rows]) if experiment.judges_loss else None,
        np.array([row.extent or (np.nan, np.nan) for row in rows]),
        np.array([(extent and row.vector(extent)) or (np.nan, np.nan) for row in rows]),
        np.array([np.nan if row.searching is None else float(row.searching) for row in rows]),
        np.array([np.sqrt(np.mean(np.square(row.sigma))) if row.sigma else np.nan for row in rows]),
    )


def extent_series(declared: Sequence[Series]) -> str | None:
    """Return the name of the series of the box that a tracker believes in; None where there is none."""
    return next((series.name for series in declared if series.role == "extent"), None)


def allowed_loss(parameters: Parameters) -> float:
    """Return the share of frames, 0..1, that may miss in a success; none where no parameter has that role."""
    shares = with_role(type(parameters), "loss_share")
    return float(getattr(parameters, shares[0].name)) if shares else 0.0


def reductions(declared: Sequence[Series], rows: Sequence[Diagnostics]) -> Mapping[str, float | int | None]:
    """Return what is kept of series over a whole run, by the reductions' names.

    Args:
        declared: The series.
        rows: Of the frames after the first; one that lacks a series does not count for it.
    """
    kept: dict[str, float | int | None] = {}
    for series in declared:
        if series.reductions:
            values = [row.series[series.name] for row in rows if series.name in row.series]
            kept |= reduce(series, columns(series, values)[series.name])
    return kept


def estimates_hash(estimates: NDArray[np.float64]) -> str:
    """Return the SHA-256 of estimates (L, d) as little-endian float64: equal if and only if they are to the bit."""
    return hashlib.sha256(np.ascontiguousarray(estimates, dtype="<f8").tobytes()).hexdigest()
