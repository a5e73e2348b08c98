"""Rules of diagnosis: one for each cause of a loss, from the columns of a course.

A rule measures one mechanism around a moment and returns a `Sign` if it is at work: since when, how strongly, and the
numbers that this is said from. Several may be: whoever asks orders them by when they began. What follows from another
sign begins later, so no rule needs to know the others.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pftrack.diagnosis.course import Course, Flags, Numbers
from pftrack.diagnosis.moment import FOLLOWING, Moment, middle
from pftrack.model.cause import CauseId

__all__ = ["RULES", "Rule", "Sign"]


@dataclass(frozen=True)
class Sign:
    """That a cause is at work.

    Attributes:
        cause: Which.
        since: Frame since when.
        strength: How clearly, from 0 to 1.
        text: A sentence with a place `{name}`, with a format if need be, for each number, and `{unit}` for the run's.
        numbers: What was measured, by name.
        evidence: Names of the columns of the course that show it.
        unit: Of the run's estimates.
    """

    cause: CauseId
    since: int
    strength: float
    text: str
    numbers: dict[str, float]
    evidence: tuple[str, ...]
    unit: str = ""

    @property
    def words(self) -> str:
        """The sentence with its numbers."""
        return self.text.format(**self.numbers, unit=f" {self.unit}".rstrip())


Rule: TypeAlias = Callable[[Moment], Sign | None]

FEW = 50
"""Particles, at most, that are few in themselves,"""
FEW_EFFECTIVE = 25.0
"""and how many of them carry the weight at the most."""
FEW_DIFFERENT = 5.0
"""Different particles, at most, in what no noise renews."""
DEGENERATE = 0.1
"""ESS over the particles below which a few carry all the weight."""
UNDECIDED = 0.6
"""ESS over the particles above which the picture hardly tells them apart."""
OPINIONATED = 0.92
"""ESS over the particles below which weights prefer some of them, where nothing of the target is seen."""
TOO_SURE, DOUBTFUL = 3.0, 2.0
"""Times the stated deviation that an error exceeds where a belief is too sure, and where it begins to be."""
PLACE = 2
"""Numbers of an estimate that is a place in the picture."""
STANDING = 0.01
"""Of the stated deviation that a target goes in a frame where it stands still."""
GROWN = 3.0
"""Times its usual value that a deviation is greater where a cloud is no longer held together."""
BEGINNING = slice(1, 4)
"""The first frames, in which a cloud is still as it was placed."""
WITHIN = 2.0
"""Deviations that an error is below where the target is still within the cloud."""
CHANGED, STILL_ALIKE = 0.8, 0.95
"""Likeness of the model to the first look below which it is another one, and above which it is the same."""


def beyond_the_picture(moment: Moment) -> Sign | None:
    """Ask whether the target was beyond the edge of the picture shortly before."""
    outside = moment.course.outside == 1.0
    if not outside[moment.around].any():
        return None
    since = moment.since(outside)
    frames = int(np.count_nonzero(outside[since:]))
    return Sign(
        "target-not-in-the-picture",
        since,
        1.0,
        "From frame {since:.0f} on the target is beyond the edge of the picture, for {frames:.0f} frames in all.",
        {"since": since, "frames": frames},
        ("outside", "fit", "deviation"),
    )


def few_weights(moment: Moment) -> Sign | None:
    """Ask whether weights were multiplied without a resampling until a few particles carry all of them."""
    course = moment.course
    few = (course.ess_share < DEGENERATE) & (course.resampled == 0.0)
    drawn = course.resampled[max(moment.frame - 10, 1) : moment.frame + 1]
    if not few[moment.frame - 1 : moment.frame + 2].any() or not np.isfinite(drawn).any() or drawn.mean() > 0.1:
        return None
    since = moment.since(few)
    ess = float(np.nanmin(course.ess[since : moment.frame + 2]))
    return Sign(
        "degenerate-resampling",
        since,
        1.0,
        "Parents were not drawn, and since frame {since:.0f} fewer than a tenth of the {count:.0f} particles carry the "
        "weight; the effective sample size goes down to {ess:.1f}.",
        {"since": since, "count": middle(course.particles), "ess": ess},
        ("ess_share", "deviation"),
    )


def alike_particles(moment: Moment) -> Sign | None:
    """Ask whether the particles differ too little, or are too few, to be where the target may go."""
    course, frame = moment.course, moment.frame
    count = middle(course.particles)
    alike = course.distinct <= np.minimum(FEW_DIFFERENT, 0.1 * course.particles)
    if alike[: frame + 1].any() and alike[max(frame - 3, 0) : frame + 1].any():
        since = moment.since(alike)
        left = float(np.nanmin(course.distinct[max(frame - 3, 0) : frame + 1]))
        return Sign(
            "sample-impoverishment",
            since,
            1.0,
            "Of {count:.0f} particles {left:.0f} differ in what no noise renews when the target is lost, and {few:.0f} "
            "or fewer since frame {since:.0f}: where it may go otherwise, there is none.",
            {"since": since, "few": FEW_DIFFERENT, "count": count, "left": left},
            ("distinct", "error", "fit"),
        )
    effective = middle(course.ess[moment.usual])
    if not (count <= FEW and not effective > FEW_EFFECTIVE):
        return None
    return Sign(
        "sample-impoverishment",
        0,
        1.0 - count / (2 * FEW),
        "There are {count:.0f} particles, of which {ess:.1f} carry the weight while the target is seen: too few to be "
        "near it wherever it may go.",
        {"count": count, "ess": effective},
        ("ess_share", "fit", "error"),
    )


def sure_of_nothing(moment: Moment) -> Sign | None:
    """Ask whether weights prefer some particles where nothing of the target is seen."""
    course = moment.course
    blind = moment.unseen & ~(course.outside == 1.0)
    hides = course.hidden[moment.near] == 1.0
    # What is only half covered is still told from the rest, and rightly: where it is known, all of it must be hidden.
    window, nothing = (moment.near, blind & (course.hidden == 1.0)) if hides.any() else (moment.around, blind)
    share = middle(course.ess_share[window][nothing[window]])
    if not (share < OPINIONATED and np.count_nonzero(nothing[window]) >= 3):
        return None
    grown = middle(course.deviation[moment.after]) / middle(course.deviation[moment.usual])
    # Where it is in sight, the particles are elsewhere, and which of them is the least wrong says nothing of weights.
    if not hides.any() if np.isfinite(course.hidden[moment.near]).any() else not grown < GROWN:
        return None
    since = moment.since(blind)
    return Sign(
        "overconfident-weights",
        since,
        min(1.0, 2 * (1.0 - share)),
        "Since frame {since:.0f} the picture does not show the target where it is believed to be, and yet the weights "
        "prefer some places: the ESS is {share:.0%} of the particles, where all should count alike.",
        {"since": since, "share": share},
        ("ess_share", "fit", "deviation", "error"),
    )


def mirror_image(moment: Moment) -> Sign | None:
    """Ask whether the estimate is the mirror image of the truth."""
    mirrored = moment.course.mirrored == 1.0
    window = mirrored[moment.before.start : moment.frame + 2 * FOLLOWING]
    if not window.any():
        return None
    first = moment.before.start + int(np.argmax(window))
    # Near the pose at which both are one, neither is nearer: it is lost before that can be told.
    since = min(moment.since(mirrored), moment.frame)
    return Sign(
        "mirror-pose",
        since,
        1.0,
        "Since frame {since:.0f} the estimate is nearer to the mirror image of the target than to the target; then it "
        "is {off:.1f}{unit} off, and the camera cannot tell one from the other.",
        {"since": since, "off": float(moment.course.error[first])},
        ("mirrored", "error", "fit"),
    )


def changed_model(moment: Moment) -> Sign | None:
    """Ask whether what is looked for has become something else, which fits."""
    course = moment.course
    later = moment.after
    kept, fit = middle(course.kept[later]), middle(course.fit[later])
    if not (kept < CHANGED and fit >= moment.low_fit):
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
    wrong = [end for end in ends if end <= moment.frame + 30 and course.lost[end]]
    if not wrong or not np.isfinite(course.error[wrong[0]]):
        return None
    found = int(wrong[0])
    begun = found - 1
    while begun > 0 and (searching[begun - 1] or moment.unseen[begun - 1]):
        begun -= 1
    return Sign(
        "detector-seized-by-background",
        begun,
        1.0,
        "Since frame {since:.0f} the target is not seen; the search for it ends in frame {found:.0f} at a "
        "place that fits by {fit:.2f} and is {error:.1f}{unit} away from the target.",
        {"since": begun, "found": found, "fit": course.fit[found], "error": course.error[found]},
        ("searching", "fit", "error"),
    )


def everything_fits(moment: Moment) -> Sign | None:
    """Ask whether the picture fits wherever one looks, so that nothing holds the particles together."""
    course = moment.course
    later = moment.after
    shares = middle(course.ess_share[moment.before]), middle(course.ess_share[later])
    deviation, off = middle(course.deviation[later]), middle(course.error[later])
    grown = deviation / middle(course.deviation[BEGINNING])
    if (course.hidden[moment.near] == 1.0).any():  # it grows where nothing is seen, too
        return None
    if not (min(shares) >= UNDECIDED and moment.fits_after and grown >= GROWN and off < WITHIN * deviation):
        return None
    since = moment.since(course.ess_share >= UNDECIDED)
    return Sign(
        "detector-seized-by-background",
        since,
        min(1.0, grown / 10),
        "Since frame {since:.0f} the picture fits nearly as well wherever one looks: the ESS is {share:.0%} of the "
        "particles, and their deviation grows to {grown:.1f} times of what it was.",
        {"since": since, "share": shares[1], "grown": grown},
        ("ess_share", "deviation", "fit"),
    )


def same_again(moment: Moment) -> Sign | None:
    """Ask whether a filter without particles takes each picture of a target that stands still for news."""
    course = moment.course
    moves = middle(course.true_step[1 : moment.frame + 1])
    if np.isfinite(course.particles).any() or not (moves < STANDING * middle(course.deviation[moment.usual])):
        return None
    over = course.excess > DOUBTFUL
    since = min(moment.since(over), moment.frame)
    worst = float(np.nanmax(course.excess[moment.near]))
    return Sign(
        "shrinking-covariance",
        since,
        min(1.0, worst / 10),
        "The target stands still, and the filter takes each picture for news: since frame {since:.0f} what it believes "
        "is off by up to {worst:.1f} times the deviation that it states.",
        {"since": since, "worst": worst},
        ("excess", "error", "deviation"),
    )


def too_sure(moment: Moment) -> Sign | None:
    """Ask whether a belief without particles states a deviation that its error belies."""
    course = moment.course
    if np.isfinite(course.particles).any() or np.isfinite(course.likeness).any():
        return None
    over = course.excess > TOO_SURE
    if not over[moment.around].any() or moment.fits_after:
        return None
    since = moment.since(over)
    worst = float(np.nanmax(course.excess[moment.around]))
    return Sign(
        "shrinking-covariance",
        since,
        min(1.0, worst / 20),
        "Since frame {since:.0f} the error is more than {limit:.0f} times the deviation that the filter states, up to "
        "{worst:.1f} times: it is too sure of itself to learn from what it sees.",
        {"since": since, "limit": TOO_SURE, "worst": worst},
        ("excess", "error", "deviation"),
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
        "From frame {since:.0f} on the target goes out of sight, where it is for {frames:.0f} frames. It goes "
        "{true:.1f}{unit} on meanwhile, and the estimate {believed:.1f}{unit}; in frame {frame:.0f} the deviation has "
        "grown from {usual:.1f} to {deviation:.1f}{unit}, and the error is {error:.1f}{unit}.",
        {
            "since": since,
            "frames": length,
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
    if np.isfinite(course.error).any() or np.isfinite(course.hidden).any() or not unseen[moment.around].any():
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


def another_that_fits(moment: Moment) -> Sign | None:
    """Ask whether what is followed while the target is lost fits as well as the target did."""
    course = moment.course
    fit, off = middle(course.fit[moment.after]), middle(course.error[moment.after])
    is_place = course.estimates.shape[1] == PLACE  # a pose that is wrong is no other thing
    if not (is_place and moment.fits_after and moment.is_off):
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


def left_behind(moment: Moment) -> Sign | None:
    """Ask whether the target, in full sight, went where the law of motion does not expect it."""
    course = moment.course
    near = moment.near
    sight = ~((course.hidden[near] == 1.0) | (course.outside[near] == 1.0)).any()
    if not (sight and not moment.fits_after and moment.is_off):
        return None
    far = course.error > 0.5 * course.error[moment.frame]
    since = min(moment.since(far, gap=0), moment.since(moment.unseen, gap=0))
    true, believed = _paces(course, since, moment.frame)
    return Sign(
        "wrong-dynamics",
        since,
        0.8,
        "Since frame {since:.0f} the target, in full sight, goes {true:.1f}{unit} a frame and the estimate "
        "{believed:.1f}{unit} that way; in frame {frame:.0f} they are {error:.1f}{unit} apart, and nothing of what is "
        "believed is left where the target is seen.",
        {
            "since": since,
            "true": true,
            "believed": believed,
            "frame": moment.frame,
            "error": float(course.error[moment.frame]),
        },
        ("error", "fit", "true_step", "step"),
    )


RULES: tuple[Rule, ...] = (
    beyond_the_picture,
    few_weights,
    alike_particles,
    same_again,
    mirror_image,
    changed_model,
    wrong_find,
    everything_fits,
    too_sure,
    sure_of_nothing,
    out_of_sight,
    suddenly_gone,
    another_that_fits,
    left_behind,
)
"""All of them; of two signs since the same frame the one whose rule comes first is told first."""


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


def _stretch(holds: Flags, first: int) -> int:
    """Return for how many frames in a row something holds from a frame on."""
    ends = np.flatnonzero(~holds[first:])
    return int(ends[0]) if len(ends) else len(holds) - first
