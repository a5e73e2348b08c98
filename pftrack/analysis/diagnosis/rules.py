"""Rules of diagnosis: each asks whether one cause is at work, and returns a sign of it.

The first ones ask where the target goes, and what is looked for: it may go beyond the edge, behind something, or where
the law of motion does not. What is looked for may have changed, something else may fit as well, or a search took the
wrong place. The others ask what is believed, by particles or without. Particles and their weights may carry too little,
differ too little, or say more than is seen. A belief without particles may be too sure of itself, or on the wrong side
of an ambiguity. What a sign says in words stands in signs.yaml.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.diagnosis.course import (
    FOLLOWING,
    LEADING,
    Course,
    Flags,
    Moment,
    Numbers,
    Rule,
    Sign,
    middle,
    sign,
)
from pftrack.analysis.diagnosis.looks import (
    dull_pictures,
    noisy_numbers,
    noisy_pictures,
    nothing_seen,
    other_light,
    other_target,
    same_picture,
    says_nothing,
)
from pftrack.core.arrays import spans

JUMP = 1.8
"""Times its largest step before that a target goes in a frame where it jumps."""
PASSING = 3
"""Frames, at most, in which a target passes the edge of the picture."""
SLOWER = 0.75
"""Largest share of its way that the estimate follows a target that is left behind."""
BRIEF = 3
"""Frames that are too few to be followed in, or to tell how a target moves."""


def beyond_the_picture(moment: Moment) -> Sign | None:
    """Ask whether the target was beyond the edge of the picture shortly before."""
    outside = moment.course.outside == 1.0
    if not outside[moment.around].any():
        return None
    since = moment.since(outside)
    frames = int(np.count_nonzero(outside[since:]))
    blind = moment.goes_blind
    # An estimate follows what it does not see, and reaches the edge a little later than the target.
    if not moment.knows_truth and blind is not None and since - PASSING <= blind < since:
        since = blind
    if not moment.knows_truth and since > moment.frame:
        return None  # what is lost may go anywhere
    return sign("beyond-the-picture", since, 1.0, frames=frames)


def out_of_sight(moment: Moment) -> Sign | None:
    """Ask whether the target was hidden when, or just before, it was lost, and nothing of it was seen."""
    course = moment.course
    hidden, near = course.hidden == 1.0, moment.near
    if not (hidden[near] & moment.unseen[near]).any():
        return None
    begun = moment.since(hidden)
    length = _stretch(hidden, begun)
    if not begun or length <= BRIEF:
        return None  # it was never seen, or is back before a filter forgets
    back, usual = min(begun + length, len(course) - 1), middle(course.deviation[moment.usual])
    widest = course.deviation[back - 1]
    within = widest < GROWN * usual and course.error[back] <= WITHIN * widest
    # What comes back within a cloud that has hardly grown is there to be seen, and lost for another reason.
    if moment.is_place and back > moment.frame and within:
        return None
    near_it = course.error <= WITHIN * middle(course.error[moment.usual])
    seen = (near_it & ~moment.unseen & ~hidden)[begun + length : moment.frame]
    if begun > moment.frame + BRIEF or np.count_nonzero(seen) >= BRIEF or _first_jump(moment):
        return None  # it went after the loss, or was followed again before it, or jumped
    if any(last - first + 1 >= length for first, last in spans(hidden[:begun].tolist())):
        return None  # it had come back from as long a time out of sight
    # What hides it covers it little by little: it may be lost before nothing of it is left.
    since = begun if begun <= moment.frame else moment.since(moment.unseen)
    return sign(
        "out-of-sight",
        since,
        min(1.0, length / 4),
        frames=length if _is_known(course.hidden, begun + length) else np.nan,
        true=_way(course.truths[begun : begun + length]),
        believed=_way(course.estimates[begun : begun + length]),
        frame=moment.frame,
        usual=usual,
        deviation=float(course.deviation[moment.frame]),
        error=float(course.error[moment.frame]),
    )


def out_of_the_cloud(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether the target left the particles, which did not follow it."""
    course, since = moment.course, moment.goes_blind
    if moment.knows_truth or since is None:
        return None
    if not np.isfinite(course.particles).any():
        return _nothing_fits(moment, since)
    if not moment.leaves_cloud:
        return None
    shares = course.ess_share
    least = float(np.nanmin(shares[max(since - 4, 1) : since + 4]))
    return sign(
        "out-of-the-cloud",
        since,
        0.7,
        usual=moment.usual_fit,
        fit=middle(course.fit[moment.after]),
        least=least,
    )


def _nothing_fits(moment: Moment, since: int) -> Sign | None:
    """Ask the same of hypotheses that are compared with all that is seen: what covers it would be seen, too."""
    misfit = moment.course.misfit
    if not np.isfinite(misfit).any():
        return None
    return sign("nothing-fits", since, 0.6, misfit=middle(misfit[moment.after]), usual=middle(misfit[moment.usual]))


def left_behind(moment: Moment) -> Sign | None:
    """Ask whether the target, in full sight, went where the law of motion does not expect it."""
    course = moment.course
    near = moment.near
    sight = ~((course.hidden[near] == 1.0) | (course.outside[near] == 1.0)).any()
    mirrored = course.mirrored[moment.after] == 1.0  # then it is followed, as what looks the same
    jump = _first_jump(moment)
    had_fit = np.nanmax(course.fit[moment.usual], initial=-np.inf) - middle(course.fit[moment.after])
    # Not every tracker reports a fit, and nor need a file.
    fell = had_fit >= moment.least_fall or not np.isfinite(course.fit).any()
    left = sight and not moment.fits_after and fell
    if not (moment.is_off and (left or jump)) or np.count_nonzero(mirrored) > len(mirrored) / 2:
        return None
    far = course.error > max(0.5 * course.error[moment.frame], WITHIN * middle(course.error[moment.usual]))
    since = jump or min(moment.since(far, gap=0), moment.since(moment.unseen, gap=0))
    true, believed = _paces(course, since, moment.frame)
    if not believed <= SLOWER * true:
        return None  # the estimate runs away, and not the target
    # Of a clip nobody may have told what is hidden.
    in_sight = "left-behind-in-full-sight" if sight and np.isfinite(course.hidden[near]).all() else "left-behind"
    return sign(
        in_sight,
        since,
        0.8,
        true=true,
        believed=believed,
        frame=moment.frame,
        error=float(course.error[moment.frame]),
        fit=middle(course.fit[moment.after]),
        usual=moment.usual_fit,
    )


def _first_jump(moment: Moment) -> int | None:
    """Return the frame just before a loss in which the target went further than ever; None if it did not."""
    steps, first = moment.course.true_step, moment.before.start
    for index in range(max(first, BRIEF + 1), moment.frame + 1):
        longest = np.nanmax(steps[1:index], initial=0.0)
        if 0.0 < JUMP * longest < steps[index]:
            return index
    return None


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
    return sign("changed-model", since, 1.0 - kept, kept=kept, fit=fit)


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
    return sign("wrong-find", begun, 1.0, found=found, fit=course.fit[found], error=course.error[found])


def _poor_find(moment: Moment, ends: NDArray[np.intp]) -> Sign | None:
    """Ask, where no truth is known, whether a search ended at a place that fits worse than the target did."""
    fit = moment.course.fit
    poor = [end for end in ends if moment.frame - 1 <= end <= moment.frame + 30 and _is_poor(moment, int(end))]
    if not poor:
        return None
    found = int(poor[0])
    begun = _begin_of_search(moment, found)
    return sign("poor-find", begun, 0.7, found=found, fit=float(fit[found]), usual=moment.usual_fit)


def _is_poor(moment: Moment, found: int) -> bool:
    """Whether what was found fits worse than what was followed, if not as badly as what is not seen."""
    short = 0.5 * (moment.usual_fit - moment.low_fit)
    return middle(moment.course.fit[found : found + FOLLOWING]) < moment.usual_fit - short


def _begin_of_search(moment: Moment, found: int) -> int:
    begun = found - 1
    while begun > 0 and (moment.course.searching[begun - 1] == 1.0 or moment.unseen[begun - 1]):
        begun -= 1
    return begun


def another_that_fits(moment: Moment) -> Sign | None:
    """Ask whether what is followed while the target is lost fits as well as the target did."""
    course, after = moment.course, moment.after
    # A target that is found again fits as well, and a wrong pose of it is still the target.
    elsewhere = moment.off[after] & (course.hidden[after] != 1.0)
    fit, off = middle(course.fit[after][elsewhere]), middle(course.error[after][elsewhere])
    most = np.count_nonzero(elsewhere) > len(elsewhere) / 2
    # What drifts off a little, or looks for something else, stays near, or finds what fits no better than its place.
    away = course.error[after][-1] >= GOES_AWAY * course.error[moment.frame]
    better = fit - moment.usual_fit >= BETTER[moment.by_likeness]
    anywhere = middle(course.ess_share[after]) >= OPINIONATED
    if not (moment.is_place and most and moment.fits_after and away and better) or anywhere:
        return None
    return sign("another-that-fits", moment.frame, 0.9, fit=fit, usual=moment.usual_fit, off=off)


GOES_AWAY = 1.5
"""Times the error at the loss that it has grown to, at least, a little later, where something else is followed."""
BETTER = {True: -0.04, False: 0.25}
"""By how much it fits better than the target had, at least: by a likeness, 0..1, and by a log evidence."""

FEW = 45
"""Particles, at most, that are few in themselves,"""
FEW_EFFECTIVE = 25.0
"""and how many of them carry the weight at the most."""
FEW_EACH = 12
"""Particles for each number of the estimate, at most, that are few whatever they weigh."""
FEW_DIFFERENT = 5.0
"""Different particles, at most, in what no noise renews."""
DEGENERATE = 0.1
"""ESS over the particles below which a few carry all the weight."""
UNDECIDED = 0.6
"""ESS over the particles above which the picture hardly tells them apart."""
OPINIONATED = 0.92
"""ESS over the particles below which weights prefer some of them, where nothing of the target is seen."""
GROWN = 3.0
"""Least factor by which a deviation grows over its usual value where a cloud comes apart."""
SCATTERED = 9.0
"""Least factor by which it grows over its first value where nothing ever held it together."""
BEGINNING = slice(1, 2)
"""The first frames, in which a cloud is still as it was placed."""
WITHIN = 2.0
"""Deviations that an error is below where the target is still within the cloud."""


def few_weights(moment: Moment) -> Sign | None:
    """Ask whether weights were multiplied without a resampling until a few particles carry all of them."""
    course = moment.course
    few = (course.ess_share < DEGENERATE) & (course.resampled == 0.0)
    drawn = course.resampled[max(moment.frame - 10, 1) : moment.frame + 1]
    if not few[moment.frame - 1 : moment.frame + 2].any() or not np.isfinite(drawn).any() or drawn.mean() > 0.1:
        return None
    since = moment.since(few)
    ess = float(np.nanmin(course.ess[since : moment.frame + 2]))
    return sign("few-weights", since, 1.0, count=middle(course.particles), ess=ess)


def alike_particles(moment: Moment) -> Sign | None:
    """Ask whether the particles differ too little, or are too few, to be where the target may go."""
    course, frame = moment.course, moment.frame
    count = middle(course.particles)
    alike = course.distinct <= np.minimum(FEW_DIFFERENT, 0.1 * course.particles)
    if alike[: frame + 1].any() and alike[max(frame - 3, 0) : frame + 1].any():
        since = moment.since(alike)
        left = float(np.nanmin(course.distinct[max(frame - 3, 0) : frame + 1]))
        return sign("alike-particles", since, 1.0, few=FEW_DIFFERENT, count=count, left=left)
    effective = middle(course.ess[moment.usual])
    few = count <= FEW and not effective > FEW_EFFECTIVE
    if not (few or count <= FEW_EACH * course.estimates.shape[1]):
        return None
    return sign("too-few-particles", 0, max(1.0 - count / (2 * FEW), 0.0), count=count, ess=effective)


def sure_of_nothing(moment: Moment) -> Sign | None:
    """Ask whether weights prefer some particles where the target is known to be hidden, and nothing of it is seen."""
    course, frame = moment.course, moment.frame
    blind = moment.unseen & ~(course.outside == 1.0)
    # What is half covered is still told from the rest, and rightly: all of it must be hidden, and be so at the loss.
    hidden = course.hidden == 1.0
    share = middle(course.ess_share[moment.near][(blind & hidden)[moment.near]])
    if not (share < OPINIONATED and np.count_nonzero((blind & hidden)[moment.near]) >= BRIEF):
        return None
    # The features of a pose are weighed one by one, and most of them hold even where one is hidden.
    if not moment.is_place or not hidden[max(frame - BRIEF, 0) : frame + 1].any():
        return None
    return sign("sure-of-nothing", moment.since(blind), min(1.0, 2 * (1.0 - share)), share=share)


def everything_fits(moment: Moment) -> Sign | None:
    """Ask whether the picture fits wherever one looks, so that nothing holds the particles together."""
    course = moment.course
    later = moment.after
    shares = middle(course.ess_share[moment.before]), middle(course.ess_share[later])
    deviation, off = middle(course.deviation[later]), middle(course.error[later])
    grown = deviation / middle(course.deviation[BEGINNING])
    if (course.hidden[moment.near] == 1.0).any():  # it grows where nothing is seen, too
        return None
    always = middle(course.deviation[moment.usual]) >= GROWN * middle(course.deviation[BEGINNING])
    within = off < WITHIN * deviation if moment.knows_truth else always
    if not (min(shares) >= UNDECIDED and moment.fits_after and grown >= SCATTERED and within):
        return None
    since = moment.since(course.ess_share >= UNDECIDED)
    return sign("everything-fits", since, min(1.0, grown / 10), share=shares[1], grown=grown)


TOO_SURE, DOUBTFUL = 3.0, 2.0
"""Times the stated deviation that an error exceeds where a belief is too sure, and where it begins to be."""
BROKEN = 30.0
"""Times the same that no belief is off which only shrank."""
STANDING = 0.01
"""Largest step of a target that stands still, in stated deviations."""


def same_again(moment: Moment) -> Sign | None:
    """Ask whether a filter without particles takes each picture of a target that stands still for news."""
    course = moment.course
    moves = middle(course.true_step[1 : moment.frame + 1])
    if not (moment.is_gaussian and moves < STANDING * middle(course.deviation[moment.usual])):
        return None
    near = course.excess[moment.near]
    # Where it is lost, that is said of the belief already; elsewhere some errors of a right filter are as great.
    if not np.isfinite(near).any() or not (course.lost[moment.frame] or middle(near) > DOUBTFUL):
        return None
    over = course.excess > DOUBTFUL
    since = min(moment.since(over), moment.frame)
    worst = float(np.nanmax(near))
    if worst > BROKEN:
        return None
    return sign("same-again", since, min(1.0, worst / 10), worst=worst)


def too_sure(moment: Moment) -> Sign | None:
    """Ask whether a belief without particles states a deviation that its error belies."""
    course = moment.course
    over = course.excess > TOO_SURE
    if not (moment.is_gaussian and over[moment.around].any()) or moment.fits_after:
        return None
    since = moment.since(over)
    worst = float(np.nanmax(course.excess[moment.around]))
    if since < BRIEF or worst > BROKEN:
        return None  # it held at no time, or ceases at once to be about what is measured: nothing shrank
    return sign("too-sure", since, min(1.0, worst / 20), limit=TOO_SURE, worst=worst)


def refuted(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether what is seen refutes a belief without particles, frame after frame."""
    course, since = moment.course, moment.goes_blind
    if moment.knows_truth or not moment.is_gaussian or since is None:
        return None
    later = slice(since, since + FOLLOWING)
    fit, nis, limit = (middle(column[later]) for column in (course.fit, course.nis, course.nis_limit))
    return sign(
        "refuted-by-innovations" if nis > limit else "refuted",
        since,
        0.7,
        fit=fit,
        usual=moment.usual_fit,
        deviation=middle(course.deviation[later]),
        nis=nis,
        limit=limit,
    )


def mirror_image(moment: Moment) -> Sign | None:
    """Ask whether the estimate is the mirror image of the truth."""
    mirrored = moment.course.mirrored == 1.0
    begun = moment.frame + int(np.argmax(mirrored[moment.frame : moment.frame + 2 * FOLLOWING]))
    later = slice(begun, begun + FOLLOWING)
    # Any great error is now and then nearer to the image; what follows it stays there, and fits as well as the target.
    stays = np.count_nonzero(mirrored[later]) >= FOLLOWING - 1
    if not (stays and middle(moment.course.fit[later]) >= moment.low_fit):
        return None
    # Near the pose at which both are one, neither is nearer: it is lost before that can be told.
    since = min(moment.since(mirrored), moment.frame)
    return sign("mirror-image", since, 1.0, off=float(moment.course.error[begun]))


RULES: tuple[Rule, ...] = (
    nothing_seen,
    same_picture,
    noisy_pictures,
    noisy_numbers,
    other_light,
    other_target,
    dull_pictures,
    says_nothing,
    beyond_the_picture,
    few_weights,
    alike_particles,
    same_again,
    mirror_image,
    changed_model,
    wrong_find,
    everything_fits,
    too_sure,
    refuted,
    sure_of_nothing,
    left_behind,
    out_of_sight,
    another_that_fits,
    out_of_the_cloud,
)
"""All of them; of two signs since the same frame the one whose rule comes first is told first."""
