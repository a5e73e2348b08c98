"""Measures: one number each for a whole run beside its truth, as benchmarks of the field define them.

An experiment declares the measures that make sense for its target, as it declares its series; summaries, sweeps, pages
and exports take them from there and know none by name. All count the labelled frames alone, those whose truth is known,
the first one included. A measure that a run has no truth for is absent, never 0.

A measure looks at every frame by itself and then puts the frames together in one of four ways:

| how | of the frames | the measure |
|---|---|---|
| share | 1 or 0 | share of the labelled frames that have a 1 |
| median | a number | median over the labelled frames |
| mean | a number from 0 to 1 | mean over the labelled frames |
| until | 1 where the target was missed | frames before the first 1; all frames of the run where there is none |

Sources, by the names that `Measure.source` uses:

- Wu, Lim, Yang, "Online object tracking: a benchmark", 2013 (OTB): precision is the share of frames whose estimate is
  within a threshold of the centre of the true box, with 20 px for the figure that trackers are ranked by.
- Čehovin, Leonardis, Kristan, "Visual object tracking performance measures revisited", 2016: centre error and centre
  error divided by the size of the target; tracking length, the number of frames from the start to the first failure.
- Kristan et al., "A novel performance evaluation methodology for single-target trackers", 2016 (VOT): a tracker has
  failed when its region does not overlap the true one any more.
- Zhang, Bargal, Lin, Brandt, Shen, Sclaroff, "Top-down neural attention by excitation backprop", 2018 (the pointing
  game): the share of points that lie within the true region, for methods that answer with a point.
- Fanelli, Dantone, Gall, Fossati, Van Gool, "Random forests for real time 3D face analysis", 2013: the share of
  pictures whose head pose is within 10 degrees.

OTB and VOT overlap regions. Of a tracker that estimates a point alone a region of the true size is taken to lie around
it: what is measured is where the target was believed to be, not how well its size was followed. One that believes in a
size as well reports it as a series of the role "extent", and is measured by the overlap of its own box.
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
"""A target with a true box on a recording is held within so many widths and heights of its centre: inside the box."""

END_FRAMES = 10
"""So many last frames say whether a target is held at the end."""


@dataclass(frozen=True, slots=True)
class EvaluatedRun:
    """A run of L frames beside its truth, in the experiment's unit; NaN where the truth is not known.

    Attributes:
        estimates: (L, d).
        truths: (L, d).
        errors: (L,) distance of the estimate from the truth; infinite where the estimate is not finite.
        lost: (L,) whether that counts as lost, False where the truth is unknown; None if there is no such notion.
        extents: (L, 2) width and height of the box around the target, px; NaN for one without such a box.
        believed: (L, 2) width and height that the tracker believes the target has, px; NaN for one that does not say.
        searching: (L,) 1 where the tracker looks for its target by its own account, else 0, NaN for one that does not
            say; None where that is not kept.
        deviations: (L,) root mean square of the posterior standard deviations; None where they are not kept.
        loss_probabilities: (L,) how probable it is that the target is lost, NaN where that is not known; None where it
            was not asked for.
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
        title: What it is, a few words.
        description: Its definition, one sentence.
        how: How the frames are put together.
        frames: Course -> (L,) value of each frame, NaN where it is not known.
        unit: Of the number; empty for a share, 0..1, or a pure number.
        better: Whether a "higher" or a "lower" number is better.
        source: Author, title and year of whoever defined it; empty for this project.
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
        """Return the values of the frames, (L,), all NaN where the declaration's `frames` fails; the log says so once.

        Experiments of other packages declare measures, too, and none of them must end a run.
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
        """Return the measure of a run; None where nothing is known, or it is not finite."""
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
    """Return the measures of a run by name, without those that it has no truth for or that come to no finite number."""
    values = {measure.name: measure.of(course) for measure in measures}
    return {name: value for name, value in values.items() if value is not None and math.isfinite(value)}


def is_success(measure: Measure, course: EvaluatedRun, allowed_share: float) -> bool | None:
    """Return whether a share is high enough.

    Args:
        measure: A "share".
        course: The run.
        allowed_share: Share of the labelled frames, 0..1, that may have a 0.

    Returns:
        The verdict; None where nothing is known.
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
    """Return in which frames a position and the box around it are known."""
    return np.asarray(np.isfinite(np.column_stack([course.extents, course.truths])).all(axis=1))


def _offsets(estimates: Floats, centres: Floats, extents: ArrayLike) -> Floats:
    """Return how far estimates (..., 2) are from the centres of true boxes, in widths and heights of the box."""
    return np.asarray(np.abs(estimates[..., :2] - centres[..., :2]) / np.asarray(extents))


def is_inside(estimates: Floats, centres: Floats, extents: ArrayLike) -> Bools:
    """Return which estimates (..., 2) lie inside true boxes, their edge included; one that is not finite does not.

    Args:
        estimates: Places in the picture.
        centres: (..., 2) of the true boxes.
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
    """Return the intersection over the union of the believed box and the true one, (L,)."""
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
"""The values of the frames, (L,), by the names of `measures.yaml`, where the words and definitions stand."""

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
"""Of every experiment with a notion of lost, declared or not."""


def held_at_end(frames: int = END_FRAMES) -> Measure:
    """Return the hit rate of the last labelled frames, so many: in between the target may be lost."""

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
"""Of a target with a position and a box around it in the picture."""

MEAN_IOU = _DECLARED["mean_iou"]
"""Of the same, where a tracker believes in a size."""

POSE_MEASURES = (
    _DECLARED["precision_10deg"],
    _DECLARED["median_error_deg"],
    replace(_DECLARED["frames_to_loss"], name="frames_to_failure"),
)
"""Of a target whose pose is estimated, in degrees: what has no box cannot be inside one."""

MEAN_LOSS_PROBABILITY = _DECLARED["mean_loss_probability"]

# Measures of what a tracker says of itself are those of all runs on a recording whose truth is not known. The tracker
# may be wrong: one that follows the wrong thing says that it follows. So these numbers compare trackers and parameters,
# and prove nothing. How true its probability is that the target is lost was measured in simulated scenes
# (`pftrack.experiments.shared.loss_probability`); it is a measure of a run there where a sweep asks for it.


def own_account(unit: str) -> tuple[Measure, ...]:
    """Return the measures of a run by the tracker's own account.

    Args:
        unit: Of its estimates.
    """
    return _DECLARED["following_share"], replace(_DECLARED["mean_deviation"], unit=unit)


# The one rule of who says that a target is lost: the truth where it is known, which may be a person's marks in a few
# pictures; elsewhere the tracker, if it gives an account of its own; else nobody.

Witness: TypeAlias = Literal["truth", "tracker", ""]
"""The truth, the tracker's own account, or nobody."""


class LossVerdict(NamedTuple):
    """What is said of a frame.

    Attributes:
        lost: Whether the target is lost; None where nobody says.
        witness: Who says so.
    """

    lost: bool | None
    witness: Witness


def judge_loss(lost: bool | None, searching: bool | None) -> LossVerdict:
    """Return whether a target is lost in a frame, and who says so.

    Args:
        lost: By the truth; None where that is not known.
        searching: Whether the tracker looks for the target by its own account; None for one that always follows.
    """
    if lost is not None:
        return LossVerdict(lost, "truth")
    return LossVerdict(searching, "" if searching is None else "tracker")
