"""Measuring and judging: what is measured of a frame, the verdict on a whole run, and its summary.

A run is judged by the frames whose truth is known. Summaries are for a table, a file and a batch.
"""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from statistics import median
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.files import warn_once
from pftrack.core.model.band import DIRECTIONS, Direction
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.measures import HIT_RATE, EvaluatedRun, Measure, evaluate, is_success
from pftrack.core.model.parameters import Parameters, Value, flat, with_role
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.model.series import Series, SeriesValue, check_value, columns, reduce
from pftrack.core.model.setup import BESIDE, Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.experiments.experiment import Experiment


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


def estimates_hash(estimates: Floats) -> str:
    """Return the SHA-256 of estimates (L, d) as little-endian float64: equal if and only if they are to the bit."""
    return hashlib.sha256(np.ascontiguousarray(estimates, dtype="<f8").tobytes()).hexdigest()


# A loss is best looked at in the frames before it, where another choice can still save the target.

APPROACH_FRAMES = 10
"""Frames before a loss at which one begins to watch."""

LASTING_FRAMES = 5
"""A loss is one to ask about if it lasts so many frames, or to the end."""

GOOD_FRAMES = 3
"""Fewer frames between two losses are no track that anybody could watch being lost."""

MEMORY_FRAMES = 40
"""A target that was out of sight this many frames before it was lost was lost because of that."""


def approach(loss: int) -> int:
    """Return the frame from which to watch what happens in another one."""
    return max(0, loss - APPROACH_FRAMES)


def loss_start(frame: int, before: int | None, *, lost: bool | None) -> int | None:
    """Return the frame in which the loss began that goes on in a frame.

    Args:
        frame: The frame.
        before: The same of the frame before it.
        lost: Whether the target is lost, as `pftrack.core.model.measures` has it.

    Returns:
        The frame; None if the target is not lost here.
    """
    if not lost:
        return None
    return frame if before is None else before


def losses(lost: Sequence[bool]) -> list[tuple[int, int]]:
    """Return the first and the last frame of each loss, by time, from whether the target is lost in each frame."""
    ends = [index for index, holds in enumerate(lost) if holds and not any(lost[index + 1 : index + 2])]
    return list(zip(_starts(lost), ends, strict=True))


def first_loss(lost: Sequence[bool]) -> int | None:
    """Return the frame in which the first lasting loss begins, or the first loss; None if there is none."""
    found = losses(lost)
    lasting = [first for first, last in found if last - first + 1 >= LASTING_FRAMES or last + 1 == len(lost)]
    return next(iter(lasting), found[0][0] if found else None)


def before_loss(lost: Sequence[bool], hidden: Sequence[bool], frame: int) -> int | None:
    """Return the frame from which to watch how the target was lost.

    That is some frames before the loss, or before the target went out of sight if that led to it, but after the loss
    that was before: where a good track is still to be seen. A few good frames between two losses are none.

    Args:
        lost: For each frame, whether the target is lost, as `loss_start` has it.
        hidden: For each frame, whether the target is out of sight.
        frame: The last loss that began at or before this frame is meant; failing that, the first one after it.

    Returns:
        The frame; None if the target was never lost.
    """
    begun = _lasting_starts(lost)
    if not begun:
        return None
    loss = max((start for start in begun if start <= frame), default=begun[0])
    went = max((start for start in _starts(hidden) if start <= loss), default=None)
    led_to_it = went is not None and any(hidden[max(went, loss - MEMORY_FRAMES) : loss + 1])
    first = approach(went if went is not None and led_to_it else loss)
    return max((index + 1 for index in range(first, loss) if lost[index]), default=first)


def _lasting_starts(lost: Sequence[bool]) -> list[int]:
    """Return the frames in which losses begin, those left out that follow another one after a few frames."""
    found = losses(lost)
    ends = [-GOOD_FRAMES - 1, *(last for _, last in found)]
    return [first for (first, _), end in zip(found, ends, strict=False) if first - end > GOOD_FRAMES]


def _starts(flags: Sequence[bool]) -> list[int]:
    """Return the frames in which something begins to hold."""
    return [index for index, holds in enumerate(flags) if holds and (index == 0 or not flags[index - 1])]


# Experiments of other packages measure, too, and a run is worth more than one of its series. What fails, or is not of
# the shape that was declared, is missing from the frame, as where a method does not have it; the log says so, once.


def measurements(
    experiment: Experiment,
    declared: Mapping[str, Series],
    tracker: Tracker,
    frame: Frame,
    state: TrackState,
    beside: Callable[[], float] | None = None,
) -> dict[str, SeriesValue]:
    """Return what was measured of a frame, by name.

    Args:
        experiment: Whose `measure` comes after the tracker's.
        declared: All series of the experiment, by name.
        tracker: What has computed the state.
        frame: What was seen.
        state: What is believed.
        beside: How the target separates from its surroundings, where that is measured.
    """
    kept = _usable(f"{experiment.id}, {tracker.id}", declared, lambda: tracker.measure(state), frame)
    if (measure := experiment.measure) is not None:
        kept |= _usable(experiment.id, declared, lambda: measure(frame, state), frame)
    if beside is not None:
        kept |= _usable(experiment.id, declared, lambda: {BESIDE.name: beside()}, frame)
    return kept


def _usable(
    whose: str, declared: Mapping[str, Series], measure: Callable[[], Mapping[str, SeriesValue]], frame: Frame
) -> dict[str, SeriesValue]:
    what = f"the `measure` of {whose}"
    where = f"in frame {frame.index}; this is left out, here and later, and the run goes on"
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
        raise ValueError(f"nobody declares a series {name!r}")
    return declared[name]


@dataclass(frozen=True, slots=True)
class Summary:
    """What came of a run so far.

    Attributes:
        experiment: Its name.
        tracker: Name of the tracker at frame 0.
        seed: Of all randomness.
        frames: How many were computed.
        parameters: Those of frame 0, by name.
        changes: Of the parameters.
        unit: Of the mean error.
        verdict: By the frames whose truth is known.
        measures: Those that the experiment declares and the run has a truth for, by name.
        step_ms_median: Of a frame's time in the tracker, ms; None for a run of one frame.
        miscalibration: Ways in which the bands of some of its frames are declared to be off.
        estimates_sha256: Hash of all estimates: equal if and only if they are to the bit.
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
    miscalibration: tuple[Direction, ...]
    estimates_sha256: str

    @property
    def hit_rate(self) -> float | None:
        """Share of the frames with known truth that were not lost; None where there are none."""
        return self.measures.get(HIT_RATE.name)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name."""
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
            **{direction: direction in self.miscalibration for direction in DIRECTIONS},
            "estimates_sha256": self.estimates_sha256,
        }


def summarise(
    experiment: Experiment, setup: Setup, timeline: Timeline, seed: int, rows: Sequence[Diagnostics]
) -> Summary:
    """Return what came of a run.

    Args:
        experiment: Its wiring.
        setup: Its source.
        timeline: Its changes.
        seed: Of all randomness.
        rows: The numbers of the frames that it has computed.
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
        unit=experiment.unit,
        verdict=judge(course, decisive, allowed_loss(timeline.parameters_at(last))),
        measures=evaluate(experiment.measures_on(setup.footage), course),
        step_ms_median=median(row.step_ms for row in rows[1:]) if last else None,
        miscalibration=experiment.miscalibration(*timeline.in_force_until(last)),
        estimates_sha256=estimates_hash(np.array([row.estimate for row in rows])),
    )
