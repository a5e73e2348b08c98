"""Measures: numbers that compare a complete run with its truth, as benchmarks of the field define them.

An experiment declares the measures that make sense for its target, as it declares its series; summaries, sweeps, pages
and exports take them from there. All measures count only labelled frames, those with known truth, including the first
one. Without a truth a measure is absent, never 0.

A measure has a value in every frame and combines the frames in one of four ways:

| how | value of a frame | the measure |
|---|---|---|
| share | 1 or 0 | share of the labelled frames with a 1 |
| median | a number | median over the labelled frames |
| mean | a number from 0 to 1 | mean over the labelled frames |
| until | 1 where the target was missed | number of frames before the first 1, or of all frames without one |

Sources, as named in `Measure.source`:

- Wu, Lim, Yang, "Online object tracking: a benchmark", 2013 (OTB): precision is the share of frames whose estimate is
  within a threshold of the centre of the true box; trackers are ranked at 20 px.
- Čehovin, Leonardis, Kristan, "Visual object tracking performance measures revisited", 2016: centre error and centre
  error divided by the size of the target; tracking length, the number of frames from the start to the first failure.
- Kristan et al., "A novel performance evaluation methodology for single-target trackers", 2016 (VOT): a tracker has
  failed when its region no longer overlaps the true one.
- Zhang, Bargal, Lin, Brandt, Shen, Sclaroff, "Top-down neural attention by excitation backprop", 2018 (the pointing
  game): the share of points that lie within the true region, for methods that answer with a point.
- Fanelli, Dantone, Gall, Fossati, Van Gool, "Random forests for real time 3D face analysis", 2013: the share of
  pictures whose head pose is within 10 degrees.

OTB and VOT use the overlap of regions. A tracker that estimates only a point gets a box of the true size around it, so
the overlap measures its position and not its size. A tracker that also estimates a size reports it as a series of the
role "extent", and the overlap uses its own box.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from pydantic import with_config

from pftrack.core.arrays import Bools, Floats
from pftrack.core.files import warn_once
from pftrack.core.texts import CLOSED, read_as

How: TypeAlias = Literal["share", "median", "mean", "until"]


PRECISE_PX, PRECISE_DEG = 20.0, 10.0

HELD_WITHIN = 0.5
"""Largest distance from the true box's centre, in widths and heights, at which a target is held: inside the box."""

END_FRAMES = 10
"""Number of last frames that decide whether a target is held at the end."""


@dataclass(frozen=True, slots=True)
class EvaluatedRun:
    """A run of L frames with its truth, in the experiment's unit; NaN where the truth is unknown.

    Attributes:
        estimates: (L, d) estimates.
        truths: (L, d) true positions.
        errors: (L,) distances of the estimates from the truth; infinite where the estimate is not finite.
        lost: (L,) whether the target is lost, False where the truth is unknown; None if the experiment does not define
            a loss.
        extents: (L, 2) width and height of the box around the target, px; NaN without a box.
        believed: (L, 2) width and height that the tracker estimates, px; NaN for a tracker without a size.
        searching: (L,) 1 where the tracker reports that it searches for its target, else 0, NaN without a report; None
            if it is not kept.
        deviations: (L,) root mean square of the posterior standard deviations; None if they are not kept.
        loss_probabilities: (L,) probability that the target is lost, NaN where unknown; None if not requested.
    """

    estimates: Floats
    truths: Floats
    errors: Floats
    lost: Bools | None
    extents: Floats
    believed: Floats
    searching: Floats | None = None
    deviations: Floats | None = None
    loss_probabilities: Floats | None = None


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Measure:
    """The declaration of a measure.

    Attributes:
        name: Key in summaries, columns of sweeps and exports.
        title: Title in a few words.
        description: Definition in one sentence.
        how: How frames are combined.
        frames: Course -> (L,) value of each frame, NaN where unknown.
        unit: Unit; empty for a share, 0..1, or a pure number.
        better: Whether a "higher" or a "lower" number is better.
        source: Author, title and year of its definition; empty for this project.
    """

    name: str
    title: str
    description: str
    how: How
    frames: Callable[[EvaluatedRun], Floats]
    unit: str = ""
    better: Literal["higher", "lower"] = "higher"
    source: str = ""

    def as_dict(self) -> dict[str, str]:
        """Return the declaration as JSON values."""
        names = ("name", "title", "description", "how", "unit", "better", "source")
        return {name: getattr(self, name) for name in names}

    def values(self, course: EvaluatedRun) -> Floats:
        """Return the values of the frames, (L,); if `frames` fails, all are NaN and the log reports it once.

        Experiments of other packages declare measures, too, and a faulty one must not stop a run.
        """
        unknown, what = np.full(len(course.errors), np.nan), f"the measure {self.name}"
        try:
            values = np.asarray(self.frames(course), dtype=np.float64)
        except Exception as error:  # noqa: BLE001 - it may be another package's
            warn_once(what, f"{what} failed and is left out", error)
            return unknown
        if values.shape != unknown.shape:
            warn_once(what, f"{what} is left out: expected {len(unknown)} numbers, one a frame, got {values.shape}")
            return unknown
        return values

    def of(self, course: EvaluatedRun) -> float | int | None:
        """Return the measure of a run; None if it is unknown or not finite."""
        values = self.values(course)
        known = values[~np.isnan(values)]
        if not len(known):
            return None
        match self.how:
            case "share":
                return 1.0 - np.count_nonzero(known == 0.0) / len(known)
            case "median":
                middle = float(np.median(known))
                return middle if np.isfinite(middle) else None
            case "mean":
                return float(known.mean())
            case "until":
                missed = np.flatnonzero(values == 1.0)
                return int(missed[0]) if len(missed) else len(values)


def evaluate(measures: Sequence[Measure], course: EvaluatedRun) -> Mapping[str, float | int]:
    """Return the measures of a run by name, without those that are unknown or not finite."""
    values = {measure.name: measure.of(course) for measure in measures}
    return {name: value for name, value in values.items() if value is not None and math.isfinite(value)}


def is_success(measure: Measure, course: EvaluatedRun, allowed_share: float) -> bool | None:
    """Return whether a share is high enough.

    Args:
        measure: A measure of the kind "share".
        course: The run.
        allowed_share: Share of the labelled frames, 0..1, that may have a 0.

    Returns:
        The verdict; None if the share is unknown.
    """
    values = measure.values(course)
    known = values[~np.isnan(values)]
    # Counted rather than subtracted from 1, which would round.
    return bool(np.count_nonzero(known == 0.0) <= allowed_share * len(known)) if len(known) else None


# ---------------------------------------------------------------- frame by frame


def _flags(flags: ArrayLike, known: ArrayLike) -> Floats:
    return np.where(known, np.asarray(flags, dtype=np.float64), np.nan)


def _held(course: EvaluatedRun) -> Floats:
    unknown = np.full(len(course.errors), np.nan)
    return unknown if course.lost is None else _flags(~course.lost, ~np.isnan(course.errors))


def _missed(course: EvaluatedRun) -> Floats:
    return 1.0 - _held(course)


def _has_box(course: EvaluatedRun) -> Bools:
    """Return for each frame whether position and box are known."""
    return np.asarray(np.isfinite(np.column_stack([course.extents, course.truths])).all(axis=1))


def _offsets(estimates: Floats, centres: Floats, extents: ArrayLike) -> Floats:
    """Return the distances of estimates (..., 2) from the centres of true boxes, in widths and heights of the box."""
    return np.asarray(np.abs(estimates[..., :2] - centres[..., :2]) / np.asarray(extents))


def is_inside(estimates: Floats, centres: Floats, extents: ArrayLike) -> Bools:
    """Return which estimates (..., 2) lie inside or on the edge of true boxes; non-finite ones do not.

    Args:
        estimates: Positions in the picture.
        centres: (..., 2) centres of the true boxes.
        extents: (..., 2) their widths and heights.
    """
    return np.asarray((_offsets(estimates, centres, extents) <= HELD_WITHIN).all(axis=-1))


def _inside(course: EvaluatedRun) -> Floats:
    return _flags(is_inside(course.estimates, course.truths, course.extents), _has_box(course))


def _failed(course: EvaluatedRun) -> Floats:
    # An estimate that is not finite is in no box.
    overlaps = (_offsets(course.estimates, course.truths, course.extents) < 1.0).all(axis=1)
    return _flags(~overlaps, _has_box(course))


def _overlap(course: EvaluatedRun) -> Floats:
    """Return the intersection over union of the estimated and the true box, (L,)."""
    off = np.abs(course.estimates[:, :2] - course.truths[:, :2])
    common = np.minimum(course.extents, course.believed)
    common = np.minimum(common, (course.extents + course.believed) / 2.0 - off)
    # An estimate that is not finite overlaps nothing.
    shared = np.where(np.isfinite(off), np.maximum(common, 0.0), 0.0).prod(axis=1)
    union = course.extents.prod(axis=1) + course.believed.prod(axis=1) - shared
    return np.where(_has_box(course) & np.isfinite(course.believed).all(axis=1), shared / union, np.nan)


def _normalise(course: EvaluatedRun) -> Floats:
    return course.errors / np.hypot(course.extents[:, 0], course.extents[:, 1])


def _errors(course: EvaluatedRun) -> Floats:
    return course.errors


def _within(limit: float, course: EvaluatedRun) -> Floats:
    return _flags(course.errors <= limit, ~np.isnan(course.errors))


def _loss_probability(course: EvaluatedRun) -> Floats:
    return np.full(len(course.errors), np.nan) if course.loss_probabilities is None else course.loss_probabilities


def _following(course: EvaluatedRun) -> Floats:
    return 1.0 - course.searching if course.searching is not None else np.full(len(course.errors), np.nan)


def _deviation(course: EvaluatedRun) -> Floats:
    deviations, unknown = course.deviations, np.full(len(course.errors), np.nan)
    return unknown if deviations is None else np.where(np.isfinite(deviations), deviations, np.nan)


# ---------------------------------------------------------------- the families

FRAMES: Mapping[str, Callable[[EvaluatedRun], Floats]] = {
    "hit_rate": _held,
    "held_at_end": _held,
    "inside_share": _inside,
    "precision_20px": partial(_within, PRECISE_PX),
    "normalised_error": _normalise,
    "median_error_px": _errors,
    "frames_to_failure": _failed,
    "mean_iou": _overlap,
    "precision_10deg": partial(_within, PRECISE_DEG),
    "median_error_deg": _errors,
    "frames_to_loss": _missed,
    "following_share": _following,
    "mean_deviation": _deviation,
    "mean_loss_probability": _loss_probability,
}
"""Functions for the values of the frames, (L,), by the names of `measures.yaml`, which has titles and definitions."""

_DECLARED = {
    each.name: each
    for each in read_as(
        Measure,
        Path(__file__).with_name("measures.yaml"),
        "name",
        {name: {"frames": frames} for name, frames in FRAMES.items()},
    )
}

HIT_RATE = _DECLARED["hit_rate"]
"""The hit rate, which every experiment that defines a loss has, declared or not."""


def held_at_end(frames: int = END_FRAMES) -> Measure:
    """Return the hit rate of the last labelled frames; before them the target may be lost."""

    def values(course: EvaluatedRun) -> Floats:
        held, last = _held(course), np.flatnonzero(~np.isnan(course.errors))[-frames:]
        found = np.full(len(held), np.nan)
        found[last] = held[last]
        return found

    known = _DECLARED["held_at_end"]
    title, description = (text.format(frames=frames) for text in (known.title, known.description))
    return replace(known, title=title, description=description, frames=values)


_PICTURE = ("inside_share", "precision_20px", "normalised_error", "median_error_px", "frames_to_failure")

PICTURE_MEASURES = tuple(_DECLARED[name] for name in _PICTURE)
"""Measures of a target with a position and a box in the picture."""

MEAN_IOU = _DECLARED["mean_iou"]
"""Additional measure for trackers that estimate a size."""

POSE_MEASURES = (
    _DECLARED["precision_10deg"],
    _DECLARED["median_error_deg"],
    replace(_DECLARED["frames_to_loss"], name="frames_to_failure"),
)
"""Measures of a target whose pose is estimated, in degrees; it has no box."""

MEAN_LOSS_PROBABILITY = _DECLARED["mean_loss_probability"]

# On a recording without a truth, runs are measured by the tracker's own reports. These may be wrong: a tracker that
# follows the wrong thing reports that it follows. So these numbers compare trackers and parameters, and prove nothing.
# P(lost) was calibrated in simulated scenes (`pftrack.experiments.shared.loss_probability`), where a sweep can request
# it as a measure.


def own_account(unit: str) -> tuple[Measure, ...]:
    """Return the measures of a run by the tracker's own reports.

    Args:
        unit: Unit of the estimates.
    """
    return _DECLARED["following_share"], replace(_DECLARED["mean_deviation"], unit=unit)


# The only rule on who judges a loss: the truth where it is known, which may be a person's marks in a few pictures;
# elsewhere the tracker, if it reports losses; else nobody.

Witness: TypeAlias = Literal["truth", "tracker", ""]
"""The truth, the tracker's own report, or nobody."""


class LossVerdict(NamedTuple):
    """The verdict on a frame.

    Attributes:
        lost: Whether the target is lost; None without a judge.
        witness: The judge.
    """

    lost: bool | None
    witness: Witness


def judge_loss(lost: bool | None, searching: bool | None) -> LossVerdict:
    """Return whether a target is lost in a frame, and the judge.

    Args:
        lost: Whether it is lost by the truth; None where the truth is unknown.
        searching: Whether the tracker reports that it searches for the target; None for one without such a report.
    """
    if lost is not None:
        return LossVerdict(lost, "truth")
    return LossVerdict(searching, "" if searching is None else "tracker")
