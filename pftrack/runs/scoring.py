"""Measuring and judging: series of a frame, the verdict on a complete run, and its summary.

Frames with known truth decide on a run. Tables, files and batches show summaries.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from statistics import median
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.files import warn_once
from pftrack.core.model.band import DOUBTS, Finding
from pftrack.core.model.measures import HIT_RATE, EvaluatedRun, Measure, evaluate, is_success
from pftrack.core.model.parameters import Parameters, Value, flat, with_role
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.model.series import Series, SeriesValue, check_value, columns, reduce
from pftrack.core.model.setup import BESIDE, Setup
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Diagnostics, Tracker, TrackState
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import Loss


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a run.

    Attributes:
        labelled_frames: Number of frames with known truth.
        mean_error: Mean error over them, in the experiment's unit; None if there are none or an estimate is not finite.
        success: Whether the decisive measure is high enough; None if unknown.
        success_measure: Name of that measure, a share; None if unknown.
        lost_frames: Number of lost frames (`pftrack.runs.loss`); None where nobody judges.
        first_lost_frame: First lost frame, or None.
    """

    labelled_frames: int
    mean_error: float | None
    success: bool | None
    success_measure: str | None
    lost_frames: int | None
    first_lost_frame: int | None


def judge(course: EvaluatedRun, loss: Loss, decisive: Measure, allowed_share: float) -> Verdict:
    """Judge a run.

    Args:
        course: The run with its truth.
        loss: Losses of the run.
        decisive: The measure that decides on success, a share.
        allowed_share: Share of the frames with known truth, 0..1, that may miss in a success.
    """
    known = course.errors[~np.isnan(course.errors)]
    mean_error = float(known.mean()) if len(known) and np.isfinite(known).all() else None
    success = is_success(decisive, course, allowed_share)
    name = None if success is None else decisive.name
    return Verdict(len(known), mean_error, success, name, loss.lost_frames, loss.first_lost_frame)


def evaluated_run(experiment: Experiment, rows: Sequence[Diagnostics]) -> EvaluatedRun:
    """Return a run with its truth, from the numbers of all its frames."""
    unknown = (np.nan,) * len(rows[0].estimate)
    extent = extent_series(experiment.all_series())
    return EvaluatedRun(
        np.array([row.estimate for row in rows]),
        np.array([row.truth or unknown for row in rows]),
        np.array([np.nan if row.error is None else row.error for row in rows]),
        np.array([bool(row.lost) for row in rows]) if experiment.judge.has_loss else None,
        np.array([row.extent or (np.nan, np.nan) for row in rows]),
        np.array([(extent and row.vector(extent)) or (np.nan, np.nan) for row in rows]),
        np.array([np.nan if row.searching is None else float(row.searching) for row in rows]),
        np.array([np.sqrt(np.mean(np.square(row.sigma))) if row.sigma else np.nan for row in rows]),
    )


def extent_series(declared: Sequence[Series]) -> str | None:
    """Return the name of the series with the tracker's box; None if there is none."""
    return next((series.name for series in declared if series.role == "extent"), None)


def allowed_loss(parameters: Parameters) -> float:
    """Return the share of frames, 0..1, that may miss in a success; 0 if no parameter has that role."""
    shares = with_role(type(parameters), "loss_share")
    return float(getattr(parameters, shares[0].name)) if shares else 0.0


def reductions(declared: Sequence[Series], rows: Sequence[Diagnostics]) -> Mapping[str, float | int | None]:
    """Return the reductions of series over a complete run, by name.

    Args:
        declared: The series.
        rows: Rows of the frames after the first; a row without a series does not count for it.
    """
    kept: dict[str, float | int | None] = {}
    for series in declared:
        if series.reductions:
            values = [row.series[series.name] for row in rows if series.name in row.series]
            kept |= reduce(series, columns(series, values)[series.name])
    return kept


def estimates_hash(estimates: Floats) -> str:
    """Return the SHA-256 of estimates (L, d) as little-endian float64, equal only for estimates equal bit for bit."""
    return hashlib.sha256(np.ascontiguousarray(estimates, dtype="<f8").tobytes()).hexdigest()


# Experiments of other packages have measures, too, and one faulty series must not stop a run. A value that fails or has
# a shape other than declared is missing from the frame, as for a method without it; the log reports it once.


def measurements(
    experiment: Experiment,
    declared: Mapping[str, Series],
    tracker: Tracker,
    frame: Frame,
    state: TrackState,
    beside: Callable[[], float] | None = None,
) -> dict[str, SeriesValue]:
    """Return the series of a frame, by name.

    Args:
        experiment: The experiment, whose `measure` follows the tracker's.
        declared: All series of the experiment, by name.
        tracker: The tracker that computed the state.
        frame: The observation.
        state: The belief.
        beside: Separation of the target from its surroundings, where it is measured.
    """
    kept = _usable(f"{experiment.id}, {tracker.id}", declared, lambda: tracker.measure(state), frame)
    if (measure := experiment.measured.measure) is not None:
        kept |= _usable(experiment.id, declared, lambda: measure(frame, state), frame)
    if beside is not None:
        kept |= _usable(experiment.id, declared, lambda: {BESIDE.name: beside()}, frame)
    return kept


def _usable(
    whose: str, declared: Mapping[str, Series], measure: Callable[[], Mapping[str, SeriesValue]], frame: Frame
) -> dict[str, SeriesValue]:
    what = f"the `measure` of {whose}"
    where = f"in frame {frame.index}; the run continues without it"
    try:
        reported = dict(measure())
    except Exception as error:  # noqa: BLE001 - it is another package's
        warn_once(what, f"{what} failed {where}", error)
        return {}
    kept: dict[str, SeriesValue] = {}
    for name, value in reported.items():
        try:
            check_value(_find_series(declared, name), value)
        except (TypeError, ValueError) as error:
            warn_once(f"{what}: {name}", f"{what} is not usable {where}: {error}")
        else:
            kept[name] = value
    return kept


def _find_series(declared: Mapping[str, Series], name: str) -> Series:
    if name not in declared:
        raise ValueError(f"the series {name!r} is not declared")
    return declared[name]


@dataclass(frozen=True, slots=True)
class Summary:
    """The results of a run so far.

    Attributes:
        experiment: Name of the experiment.
        tracker: Name of the tracker at frame 0.
        seed: Random seed.
        frames: Number of computed frames.
        parameters: Values of the parameters at frame 0, by name.
        changes: Later changes of parameters.
        unit: Unit of the mean error.
        verdict: Verdict by the frames with known truth.
        measures: By name, the experiment's measures for which the truth is known.
        step_ms_median: Median time of a step of the tracker, ms; None for a run of one frame.
        doubts: Doubts about the error bands of the run.
        estimates_sha256: Hash of all estimates; equal if and only if they are the same bit for bit.
    """

    experiment: str
    tracker: str
    seed: int
    frames: int
    parameters: Mapping[str, Value]
    changes: tuple[Change, ...]
    unit: str
    verdict: Verdict
    measures: Mapping[str, float | int]
    step_ms_median: float | None
    doubts: tuple[Finding, ...]
    estimates_sha256: str

    @property
    def hit_rate(self) -> float | None:
        """Share of the frames with known truth in which the target is held; None if there are none."""
        return self.measures.get(HIT_RATE.name)

    def as_dict(self) -> dict[str, Any]:
        """Return the summary as JSON values by name."""
        verdict = {it.name: getattr(self.verdict, it.name) for it in fields(Verdict)}
        return {
            "experiment": self.experiment,
            "tracker": self.tracker,
            "seed": self.seed,
            "frames": self.frames,
            "parameters": dict(self.parameters),
            "changes": [{"frame": change.frame, "values": dict(change.values)} for change in self.changes],
            **verdict,
            "mean_error_px": self.verdict.mean_error if self.unit == "px" else None,
            "hit_rate": self.hit_rate,
            **self.measures,
            "step_ms_median": self.step_ms_median,
            **{doubt: doubt in self.doubts for doubt in DOUBTS},
            "estimates_sha256": self.estimates_sha256,
        }


def summarise(
    experiment: Experiment, setup: Setup, timeline: Timeline, seed: int, rows: Sequence[Diagnostics]
) -> Summary:
    """Return the results of a run.

    Args:
        experiment: The experiment.
        setup: The source.
        timeline: The changes.
        seed: Random seed.
        rows: Rows of the computed frames.
    """
    course, last = evaluated_run(experiment, rows), len(rows) - 1
    decisive = experiment.measure_named(setup.success)
    return Summary(
        experiment=experiment.id,
        tracker=timeline.tracker_at(0),
        seed=seed,
        frames=len(rows),
        parameters=flat(timeline.parameters_at(0)),
        changes=timeline.changes,
        unit=experiment.judge.unit,
        verdict=judge(course, Loss.of(rows), decisive, allowed_loss(timeline.parameters_at(last))),
        measures=evaluate(experiment.measures_on(setup.footage), course),
        step_ms_median=median(row.step_ms for row in rows[1:]) if last else None,
        doubts=experiment.doubts(*timeline.in_force_until(last)),
        estimates_sha256=estimates_hash(np.array([row.estimate for row in rows])),
    )
