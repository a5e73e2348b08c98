"""Rules of what is looked for: it has changed, something else fits as well, or a search took the wrong place."""

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.diagnosis.moment import ENOUGH, FOLLOWING, LEADING, Moment, middle
from pftrack.analysis.diagnosis.sign import Sign

__all__ = ["another_that_fits", "changed_model", "widened_cloud", "wrong_find"]

WIDENED, WIDENED_EARLY, WIDER = 1.4, 2.0, 1.1
"""Times its usual value that the deviation is where a cloud comes apart; the same in the first frames, and times the
largest value before."""
DOUBTED = 2.0
"""Times the fall to what is low, at most, where a model that has changed still fits what is followed."""
CHANGED, STILL_ALIKE = 0.8, 0.95
"""Likeness of the model to the first look below which it is another one, and above which it is the same."""


def changed_model(moment: Moment) -> Sign | None:
    """Ask whether what is looked for has become something else, which fits."""
    course = moment.course
    later = moment.after
    kept, fit = middle(course.kept[later]), middle(course.fit[later])
    if not (kept < CHANGED and fit >= moment.usual_fit - DOUBTED * (moment.usual_fit - moment.low_fit)):
        return None
    since = moment.since(course.kept < STILL_ALIKE)
    return Sign(
        "template-drift",
        since,
        1.0 - kept,
        "Since frame {since:.0f} the model is no longer what it was: it is like the first look by {kept:.2f}, and what "
        "is followed is like the model by {fit:.2f}.",
        {"since": since, "kept": kept, "fit": fit},
        ("kept", "fit", "error"),
    )


def wrong_find(moment: Moment) -> Sign | None:
    """Ask whether a search ended at a place that is not the target's."""
    course = moment.course
    searching = course.searching == 1.0
    ends = np.flatnonzero(searching[:-1] & ~searching[1:]) + 1
    # What an earlier search found is another loss's cause, which may be over long ago.
    wrong = [end for end in ends if moment.frame - LEADING <= end <= moment.frame + 30 and course.lost[end]]
    if not moment.knows_truth:
        return _poor_find(moment, ends)
    if not wrong or not np.isfinite(course.error[wrong[0]]):
        return None
    found = int(wrong[0])
    begun = _begin_of_search(moment, found)
    return Sign(
        "detector-seized-by-background",
        begun,
        1.0,
        "Since frame {since:.0f} the target is not seen; the search for it ends in frame {found:.0f} at a "
        "place that fits by {fit:.2f} and is {error:.1f}{unit} away from the target.",
        {"since": begun, "found": found, "fit": course.fit[found], "error": course.error[found]},
        ("searching", "fit", "error"),
    )


def _poor_find(moment: Moment, ends: NDArray[np.intp]) -> Sign | None:
    """Ask, where no truth is known, whether a search ended at a place that fits worse than the target did."""
    fit = moment.course.fit
    poor = [end for end in ends if moment.frame - 1 <= end <= moment.frame + 30 and _is_poor(moment, int(end))]
    if not poor:
        return None
    found = int(poor[0])
    begun = _begin_of_search(moment, found)
    return Sign(
        "detector-seized-by-background",
        begun,
        0.7,
        "Since frame {since:.0f} the target is not seen; the search for it ends in frame {found:.0f} at a place that "
        "fits by {fit:.2f}, where the target had fitted by {usual:.2f}.",
        {"since": begun, "found": found, "fit": float(fit[found]), "usual": moment.usual_fit},
        ("searching", "fit", "deviation"),
    )


def _is_poor(moment: Moment, found: int) -> bool:
    """Whether what was found fits worse than what was followed, if not as badly as what is not seen."""
    short = 0.5 * (moment.usual_fit - moment.low_fit)
    return middle(moment.course.fit[found : found + FOLLOWING]) < moment.usual_fit - short


def _begin_of_search(moment: Moment, found: int) -> int:
    begun = found - 1
    while begun > 0 and (moment.course.searching[begun - 1] == 1.0 or moment.unseen[begun - 1]):
        begun -= 1
    return begun


def widened_cloud(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether the cloud came apart while what is followed fitted as before."""
    course = moment.course
    usual = middle(course.deviation[moment.usual])
    around = course.deviation[max(moment.frame - 4, 1) : moment.frame + 12]
    widest = float(np.nanmax(around)) if np.isfinite(around).any() else np.nan
    cloud = moment.is_place and bool(np.isfinite(course.particles).any())
    before = course.deviation[moment.usual]
    # In its first frames a cloud grows to what is usual.
    wide = max(
        (WIDENED if len(before) >= ENOUGH else WIDENED_EARLY) * usual, WIDER * float(np.max(before, initial=0.0))
    )
    if moment.knows_truth or not (cloud and moment.fits_after and widest >= wide):
        return None
    apart = course.deviation > 0.5 * (usual + widest)
    since = min(moment.since(apart, gap=0), moment.frame)
    return Sign(
        "look-alike-capture",
        since,
        min(1.0, widest / usual / 4),
        "Around frame {since:.0f} the particles come apart, to a deviation of {widest:.1f} from "
        "{usual:.1f}{unit}, while what is followed fits as before: they follow more than one thing.",
        {"since": since, "widest": widest, "usual": usual},
        ("deviation", "fit", "ess_share", "step"),
    )


def another_that_fits(moment: Moment) -> Sign | None:
    """Ask whether what is followed while the target is lost fits as well as the target did."""
    course = moment.course
    fit, off = middle(course.fit[moment.after]), middle(course.error[moment.after])
    # A pose that is wrong is no other thing.
    if not (moment.is_place and moment.fits_after and moment.is_off):
        return None
    return Sign(
        "look-alike-capture",
        moment.frame,
        0.9,
        "From frame {since:.0f} on something else is followed that fits as well as the target did, {fit:.2f} against "
        "{usual:.2f}, and is {off:.1f}{unit} away from it.",
        {"since": moment.frame, "fit": fit, "usual": moment.usual_fit, "off": off},
        ("error", "fit", "deviation"),
    )
