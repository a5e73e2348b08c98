"""Rules of particles and their weights: they carry too little, differ too little, or say more than is seen."""

import numpy as np

from pftrack.analysis.diagnosis.moment import FOLLOWING, Moment, middle
from pftrack.analysis.diagnosis.sign import Sign

__all__ = ["alike_particles", "everything_fits", "few_weights", "sure_of_nothing"]

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
