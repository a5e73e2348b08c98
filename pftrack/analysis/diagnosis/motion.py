"""Rules of where the target goes, and of what is looked for.

It may go beyond the edge, behind something, or where the law of motion does not. What is looked for may have changed,
something else may fit as well, or a search took the wrong place.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.diagnosis.course import ENOUGH, FOLLOWING, LEADING, Course, Flags, Moment, Numbers, Sign, middle

PASSING = 3
"""Frames, at most, in which a target passes the edge of the picture."""
AT_ONCE = 3
"""Frames from the first on, at most, after which a target was never followed."""


def beyond_the_picture(moment: Moment) -> Sign | None:
    """Ask whether the target was beyond the edge of the picture shortly before."""
    outside = moment.course.outside == 1.0
    if not outside[moment.around].any():
        return None
    since = moment.since(outside)
    frames = int(np.count_nonzero(outside[since:]))
    blind = moment.goes_blind
    # An estimate follows what it does not see, and comes to the edge a little later than the target.
    if not moment.knows_truth and blind is not None and since - PASSING <= blind < since:
        since = blind
    return Sign(
        "target-not-in-the-picture",
        since,
        1.0,
        "From frame {since:.0f} on the target is beyond the edge of the picture, for {frames:.0f} frames in all.",
        {"since": since, "frames": frames},
        ("outside", "fit", "deviation"),
    )


def out_of_sight(moment: Moment) -> Sign | None:
    """Ask whether the target was hidden when, or just before, it was lost, and nothing of it was seen."""
    course = moment.course
    hidden, near = course.hidden == 1.0, moment.near
    if not (hidden[near] & moment.unseen[near]).any():
        return None
    begun = moment.since(hidden)
    length = _stretch(hidden, begun)
    # What hides it covers it little by little: it may be lost before nothing of it is left.
    since = begun if begun <= moment.frame else moment.since(moment.unseen)
    return Sign(
        "occlusion-longer-than-memory",
        since,
        min(1.0, length / 4),
        "From frame {since:.0f} on the target goes out of sight|, where it is for {frames:.0f} frames. It goes "
        "{true:.1f}{unit} on meanwhile, and the estimate {believed:.1f}{unit}|; in frame {frame:.0f} the deviation has "
        "grown from {usual:.1f} to {deviation:.1f}{unit}|, and the error is {error:.1f}{unit}|.",
        {
            "since": since,
            "frames": length if _is_known(course.hidden, begun + length) else np.nan,
            "true": _way(course.truths[begun : begun + length]),
            "believed": _way(course.estimates[begun : begun + length]),
            "frame": moment.frame,
            "usual": middle(course.deviation[moment.usual]),
            "deviation": float(course.deviation[moment.frame]),
            "error": float(course.error[moment.frame]),
        },
        ("hidden", "fit", "deviation", "error"),
    )


def suddenly_gone(moment: Moment) -> Sign | None:
    """Ask, where only what the tracker sees is known, whether the target went out of sight within a few frames."""
    course, unseen = moment.course, moment.unseen
    if moment.knows_truth or np.isfinite(course.hidden).any() or not unseen[moment.around].any():
        return None
    by_hypotheses = bool(np.isfinite(course.misfit).any())
    if moment.by_features and not moment.is_gone:
        return None
    if moment.is_gaussian or by_hypotheses or moment.leaves_cloud or moment.fades or _at_once(moment):
        return None
    since = moment.since(unseen)
    before = middle(course.fit[max(since - 4, 0) : max(since - 2, 1)])
    if not before > moment.usual_fit - 0.5 * (moment.usual_fit - moment.low_fit):
        return None
    return Sign(
        "occlusion-longer-than-memory",
        since,
        0.6,
        "Within a few frames before frame {since:.0f} the fit of what is followed falls from {before:.2f} to "
        "{fit:.2f}, below all that was usual: something covers it, or it is gone.",
        {"since": since, "before": before, "fit": float(course.fit[since])},
        ("fit", "deviation", "searching"),
    )


def out_of_the_cloud(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether the target left the particles, which did not follow it."""
    course, since = moment.course, moment.goes_blind
    if moment.knows_truth or since is None:
        return None
    if not np.isfinite(course.particles).any():
        return _nothing_fits(moment, since)
    if moment.fades:
        return _beside_its_features(moment, since) if moment.is_gone else None
    if not (moment.leaves_cloud or _at_once(moment)):
        return None
    shares = course.ess_share
    least = float(np.nanmin(shares[max(since - 4, 1) : since + 4]))
    return Sign(
        "wrong-dynamics",
        since,
        0.7 if moment.leaves_cloud else 0.4,
        "From frame {since:.0f} on nothing of the target is seen where the particles go. As the fit fell from "
        "{usual:.2f} to {fit:.2f}, the ESS went down to {least:.0%} of them: the few at the edge of the cloud were the "
        "best, as where a target leaves it."
        if moment.leaves_cloud
        else "From frame {since:.0f} on, as soon as the target moves, nothing of it is seen where the particles go.",
        {"since": since, "usual": moment.usual_fit, "fit": middle(course.fit[moment.after]), "least": least},
        ("fit", "ess_share", "step", "deviation"),
    )


def _beside_its_features(moment: Moment, since: int) -> Sign:
    """Say the same of a target in parts, as a face by its features."""
    course = moment.course
    return Sign(
        "wrong-dynamics",
        since,
        0.6,
        "From frame {since:.0f} on the parts of the target fit worse and worse, {fit:.2f} in place of {usual:.2f}, and "
        "several at a time fit by half: they are in sight, but beside where they are believed to be. What covers one "
        "takes it at once.",
        {"since": since, "usual": moment.usual_fit, "fit": middle(course.fit[since + 1 : since + 1 + FOLLOWING])},
        ("fit", "step", "deviation"),
    )


def _nothing_fits(moment: Moment, since: int) -> Sign | None:
    """Ask the same of hypotheses that are compared with all that is seen: what covers it would be seen, too."""
    misfit = moment.course.misfit
    if not np.isfinite(misfit).any():
        return None
    return Sign(
        "wrong-dynamics",
        since,
        0.6,
        "From frame {since:.0f} on no hypothesis that is tried fits what is seen: it differs by {misfit:.0f}% from the "
        "best of them, and had differed by {usual:.0f}%.",
        {"since": since, "misfit": middle(misfit[moment.after]), "usual": middle(misfit[moment.usual])},
        ("misfit", "fit", "step"),
    )


def _at_once(moment: Moment) -> bool:
    return moment.goes_blind is not None and moment.goes_blind <= AT_ONCE


def left_behind(moment: Moment) -> Sign | None:
    """Ask whether the target, in full sight, went where the law of motion does not expect it."""
    course = moment.course
    near = moment.near
    sight = ~((course.hidden[near] == 1.0) | (course.outside[near] == 1.0)).any()
    mirrored = course.mirrored[moment.after] == 1.0  # then it is followed, as what looks the same
    if not (sight and not moment.fits_after and moment.is_off) or np.count_nonzero(mirrored) > len(mirrored) / 2:
        return None
    far = course.error > 0.5 * course.error[moment.frame]
    since = min(moment.since(far, gap=0), moment.since(moment.unseen, gap=0))
    true, believed = _paces(course, since, moment.frame)
    seen = ", in full sight," if np.isfinite(course.hidden[near]).all() else ""  # of a clip nobody may have told
    return Sign(
        "wrong-dynamics",
        since,
        0.8,
        f"Since frame {{since:.0f}} the target{seen} is left behind"
        "|: it goes {true:.1f}{unit} a frame, and the "
        "estimate {believed:.1f}{unit} that way|; in frame {frame:.0f} they are {error:.1f}{unit} apart|, and what is "
        "believed fits by {fit:.2f}, where the target had fitted by {usual:.2f}|.",
        {
            "since": since,
            "true": true,
            "believed": believed,
            "frame": moment.frame,
            "error": float(course.error[moment.frame]),
            "fit": middle(course.fit[moment.after]),
            "usual": moment.usual_fit,
        },
        ("error", "fit", "true_step", "step"),
    )


def _way(places: Numbers) -> float:
    """Return how far it is from the first to the last of places (n, d)."""
    return float(np.sqrt(np.square(places[-1] - places[0]).sum())) if len(places) else np.nan


def _paces(course: Course, since: int, frame: int) -> tuple[float, float]:
    """Return how far the target goes a frame between two frames, and how far the estimate goes in that direction."""
    first, frames = max(since - 1, 0), min(frame, frame - since + 1)
    goes, follows = (places[frame] - places[first] for places in (course.truths, course.estimates))
    length = float(np.sqrt(np.square(goes).sum()))
    if not (length > 0.0 and goes.shape == follows.shape):
        return middle(course.true_step[since : frame + 1]), middle(course.step[since : frame + 1])
    return length / frames, float(goes @ follows) / length / frames


def _is_known(values: Numbers, frame: int) -> bool:
    """Return whether a frame has a value, or is the one after the last."""
    return frame == len(values) or bool(np.isfinite(values[frame]))


def _stretch(holds: Flags, first: int) -> int:
    """Return for how many frames in a row something holds from a frame on."""
    ends = np.flatnonzero(~holds[first:])
    return int(ends[0]) if len(ends) else len(holds) - first


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
