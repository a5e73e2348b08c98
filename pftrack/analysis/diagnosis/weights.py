"""Rules of what is believed, by particles or without.

Particles and their weights may carry too little, differ too little, or say more than is seen. A belief without
particles may be too sure of itself, or on the wrong side of an ambiguity.
"""

import numpy as np

from pftrack.analysis.diagnosis.course import FOLLOWING, Moment, Numbers, Sign, middle

FEW = 50
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
"""Times its usual value that a deviation is greater where a cloud is no longer held together."""
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
    few = count <= FEW and not effective > FEW_EFFECTIVE
    if not (few or count <= FEW_EACH * course.estimates.shape[1]):
        return None
    return Sign(
        "sample-impoverishment",
        0,
        1.0 - count / (2 * FEW),
        "There are {count:.0f} particles|, of which {ess:.1f} carry the weight while the target is seen|: too few to "
        "be near it wherever it may go.",
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
    if not np.isfinite(course.hidden[moment.near]).any():
        # What is in sight by half is told from the rest as well; only where all of it is gone the fit is at its lowest.
        window, nothing = moment.near, blind & moment.at_floor
    share = middle(course.ess_share[window][nothing[window]])
    if not (share < OPINIONATED and np.count_nonzero(nothing[window]) >= 3):
        return None
    # The features of a pose are weighed one by one, and most of them hold even where one is hidden.
    if not moment.is_place or (moment.leaves_cloud and not hides.any()):
        return None
    begun = moment.goes_blind or moment.frame
    grown = middle(course.deviation[begun : begun + FOLLOWING]) / middle(course.deviation[moment.usual])
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
    if not (min(shares) >= UNDECIDED and moment.fits_after and grown >= GROWN and within):
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


TOO_SURE, DOUBTFUL = 3.0, 2.0
"""Times the stated deviation that an error exceeds where a belief is too sure, and where it begins to be."""
STANDING = 0.01
"""Of the stated deviation that a target goes in a frame where it stands still."""
WHITE = 1.2
"""Mean square of the changes of a number from frame to frame over its variance, above which it does not go anywhere: of
white noise it is 2 on average (von Neumann 1941)."""
STILL_FRAMES, FEWEST = (60, 30), 12
"""So many frames make a picture that stands still, if not all of them do; and the fewest of which that can be said."""
WENT = 1.5
"""Of its deviations that an estimate goes, at the least, where it should have stayed where it was."""
MIRROR_NEAR, PARTED = 3.0, 8.0
"""Deviations from a mirror image, at most, where a filter may come out on its side; and where both have parted."""


def same_again(moment: Moment) -> Sign | None:
    """Ask whether a filter without particles takes each picture of a target that stands still for news."""
    course = moment.course
    moves = middle(course.true_step[1 : moment.frame + 1])
    if np.isfinite(course.particles).any() or not (moves < STANDING * middle(course.deviation[moment.usual])):
        return None
    near = course.excess[moment.near]
    # Where it is lost, that is said of the belief already; elsewhere some errors of a right filter are as great.
    if not np.isfinite(near).any() or not (course.lost[moment.frame] or middle(near) > DOUBTFUL):
        return None
    over = course.excess > DOUBTFUL
    since = min(moment.since(over), moment.frame)
    worst = float(np.nanmax(near))
    return Sign(
        "shrinking-covariance",
        since,
        min(1.0, worst / 10),
        "The target stands still, and the filter takes each picture for news: since frame {since:.0f} what it believes "
        "is off by up to {worst:.1f} times the deviation that it states.",
        {"since": since, "worst": worst},
        ("excess", "error", "deviation"),
    )


def still_picture(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether what a filter without particles measures stands still."""
    course, frame = moment.course, moment.frame
    if moment.knows_truth or np.isfinite(course.particles).any():
        return None
    firsts = (1, *(frame + 1 - count for count in STILL_FRAMES))
    still = [
        one for one in firsts if one > 0 and frame + 1 - one >= FEWEST and _stands(course.measured[one : frame + 1])
    ]
    if not still:
        return None
    since = still[0]
    first = slice(since, since + FEWEST // 3)
    goes = np.abs(course.estimates[frame] - np.median(course.estimates[first], axis=0))
    way = float(np.nanmax(goes / course.sigmas[first].mean(axis=0), initial=0.0))
    if not way > WENT:
        return None
    return Sign(
        "shrinking-covariance",
        since,
        0.6,
        "Since frame {since:.0f} what is measured of the target stands still but for its noise, and the filter takes "
        "each of {count:.0f} pictures for news: meanwhile the estimate has gone {way:.1f} times the deviation that it "
        "had stated.",
        {"since": since, "count": frame + 1 - since, "way": way},
        ("deviation", "step", "nis"),
    )


def _stands(measured: Numbers) -> bool:
    """Whether all numbers (n, m) that were measured stay where they are but for white noise."""
    known = measured[:, np.isfinite(measured).all(axis=0)]
    if not known.shape[1]:
        return False
    changes, variances = np.square(np.diff(known, axis=0)).mean(axis=0), known.var(axis=0)
    return bool((changes >= WHITE * variances).all())


def too_sure(moment: Moment) -> Sign | None:
    """Ask whether a belief without particles states a deviation that its error belies."""
    course = moment.course
    if not moment.is_gaussian:
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
        ("excess", "nis", "error", "deviation"),
    )


def refuted(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether what is seen refutes a belief without particles, frame after frame."""
    course, since = moment.course, moment.goes_blind
    if moment.knows_truth or not moment.is_gaussian or since is None:
        return None
    later = slice(since, since + FOLLOWING)
    fit, nis, limit = (middle(column[later]) for column in (course.fit, course.nis, course.nis_limit))
    text = (
        "Since frame {since:.0f} the log evidence of what is seen is below all that was usual, {fit:.1f} against "
        "{usual:.1f}, and yet the deviation is {deviation:.1f}{unit}: the filter is too sure of itself to follow."
    )
    squared = (
        " The normalised innovation squared is {nis:.1f}; if the filter were right, it would be below {limit:.1f} in "
        "95 of 100 frames."
    )
    return Sign(
        "shrinking-covariance",
        since,
        0.7,
        text + squared if nis > limit else text,
        {
            "since": since,
            "fit": fit,
            "usual": moment.usual_fit,
            "deviation": middle(course.deviation[later]),
            "nis": nis,
            "limit": limit,
        },
        ("nis", "fit", "deviation", "step"),
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
        "Since frame {since:.0f} the estimate is nearer to the mirror image of the target than to the target|; then it "
        "is {off:.1f}{unit} off|, and the camera cannot tell one from the other.",
        {"since": since, "off": float(moment.course.error[first])},
        ("mirrored", "error", "fit"),
    )


def near_its_mirror_image(moment: Moment) -> Sign | None:
    """Ask, where no truth is known, whether two poses that the camera shows alike were near each other."""
    course, frame = moment.course, moment.frame
    gap = course.mirror_gap
    first = max(frame - 2 * FOLLOWING, 1)
    window = gap[first : frame + 2 * FOLLOWING]
    # Of hypotheses both are known to have been near each other when they have parted; of a Gaussian it is told at once.
    passed = moment.fits_after if moment.is_gaussian else bool(gap[frame] > PARTED)
    if moment.knows_truth or not (window < MIRROR_NEAR).any() or not passed:
        return None
    nearest = first + int(np.nanargmin(window))
    since = min(first + int(np.flatnonzero(window < MIRROR_NEAR)[0]), frame)
    return Sign(
        "mirror-pose",
        since,
        0.5,
        "Since frame {since:.0f} the estimate is, or was, near its mirror image, in frame {nearest:.0f} {gap:.1f} "
        "deviations from it, and the camera shows both alike: the target may be either, and no number of the tracker's "
        "tells which.",
        {"since": since, "nearest": nearest, "gap": float(gap[nearest])},
        ("mirror_gap", "nis", "fit"),
    )
