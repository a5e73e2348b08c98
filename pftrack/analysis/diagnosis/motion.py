"""Rules of where the target goes: beyond the edge, behind something, or where the law of motion does not."""

import numpy as np

from pftrack.analysis.diagnosis.course import Course, Flags, Numbers
from pftrack.analysis.diagnosis.moment import FOLLOWING, Moment, middle
from pftrack.analysis.diagnosis.sign import Sign

__all__ = ["beyond_the_picture", "left_behind", "out_of_sight", "out_of_the_cloud", "suddenly_gone"]

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
