"""Rules on the pictures themselves, or on the numbers that are measured: did all of them change before the loss?

What is seen in a frame is compared with the frame before, and must last. Noise, light, blur and missing pictures
explain a loss that follows them, whatever the filter. What was so from the first frame on is told of noise alone.
"""

from collections.abc import Callable

import numpy as np

from pftrack.analysis.diagnosis.course import EQUAL, FOLLOWING, Moment, Sign, middle, sign
from pftrack.analysis.diagnosis.pictures import Sight

EARLIER = 40
"""Frames, at most, from a change of all pictures to the loss that it leads to."""
NOISIER, LEAST_NOISE = 1.7, 5.0
"""Times the noise before, and grey levels more, at the least, where pictures became noisy,"""
NOISY = 16.0
"""and grey levels of noise that are much from the first frame on."""
JUMPS = 3.0
"""Times the second differences of measured numbers before, where they became noisy."""
TURNS = 0.4
"""Share of the steps of measured numbers, at least, that go back on the step before, where noise makes them: of white
noise it is two thirds."""
LIGHTER, RECOLOURED = 0.35, 30.0
"""Binary logarithm of the ratio of mean grey levels, and grey levels by which a colour is more, in another light."""
FADED, DULLED = 0.03, 0.5
"""Largest share of the contrast before in an empty picture; of the sharpest edges in a blurred one."""
LASTS = 3
"""Frames that what changed must last."""


def _begins(moment: Moment, differs: Callable[[Sight, Sight], bool]) -> int | None:
    """Return the last frame before a loss, or at it, from which on frames differ from the one just before it."""
    sights = moment.course.sights
    behind = min(moment.frame + 1, len(moment.course))
    for index in range(behind - 1, max(moment.frame - EARLIER, 0), -1):
        later = range(index, min(index + LASTS, len(moment.course)))
        if sights and all(differs(sights[index - 1], sights[each]) for each in later):
            return index
    return None


def noisy_pictures(moment: Moment) -> Sign | None:
    """Ask whether the pictures became noisy, or were so from the first one on."""
    sights = moment.course.sights
    since = _begins(moment, lambda one, other: other.noise > max(NOISIER * one.noise, one.noise + LEAST_NOISE))
    if since is not None:
        return sign("noisier-pictures", since, 0.9, noise=sights[since].noise, before=sights[since - 1].noise)
    if sights and sights[0].noise > NOISY and sights[moment.frame].noise > NOISY:
        return sign("noisy-pictures", 0, 0.7, noise=sights[moment.frame].noise)
    return None


def noisy_numbers(moment: Moment) -> Sign | None:
    """Ask whether measured numbers began to jump from frame to frame."""
    sights, frame = moment.course.sights, moment.frame
    first, behind = max(frame - EARLIER, 0), min(frame + LASTS, len(moment.course))
    rows = [sights[index].numbers for index in range(first, behind)] if sights else []
    if not rows or not len(rows[0]) or len({len(row) for row in rows}) > 1 or len(rows) < 3 * LASTS + 2:
        return None
    jumps = np.array([middle(row) for row in np.abs(np.diff(np.array(rows), n=2, axis=0))])
    if not np.isfinite(jumps[-LASTS:]).all():
        return None  # nothing is measured, which is another matter
    levels = [(middle(jumps[:at]), middle(jumps[at:])) for at in range(2 * LASTS, len(jumps) - LASTS + 1)]
    ratios = np.array([after / before for before, after in levels])
    if not np.nanmax(ratios, initial=0.0) > JUMPS:
        return None
    at = int(np.nanargmax(ratios))
    before, after = levels[at]
    begun = at + int(np.argmax(jumps[at:] > JUMPS * before))  # the median answers a little late
    steps = np.diff(np.array(rows[at:]), axis=0)
    if np.mean(steps[1:] * steps[:-1] < 0.0) < TURNS:
        return None  # it only goes faster
    return sign("noisy-numbers", first + begun + 2, 0.7, jump=after, before=before)


def other_light(moment: Moment) -> Sign | None:
    """Ask whether all of the picture changed its brightness or its colours at once."""

    def differs(one: Sight, other: Sight) -> bool:
        ratio = abs(np.log2((other.light + 1.0) / (one.light + 1.0)))
        # Of a target that is hidden there is less of its colour; when it is back, no more than in the first frame.
        more = other.colours - np.maximum(one.colours, moment.course.sights[0].colours)
        return bool(ratio > LIGHTER or more.max() > RECOLOURED)

    since = _begins(moment, differs)
    if since is None:
        return None
    one, other = moment.course.sights[since - 1], moment.course.sights[since]
    return sign("other-light", since, 0.8, light=other.light, before=one.light)


def other_target(moment: Moment) -> Sign | None:
    """Ask whether the target itself looks otherwise, where the truth tells where it is."""
    course = moment.course
    first, behind = max(moment.frame - EARLIER, 0), min(moment.frame + FOLLOWING, len(course))
    sight = (course.hidden != 1.0) & (course.outside != 1.0)
    shown = [index for index in range(first, behind) if course.sights and sight[index]]
    if not moment.knows_truth or len(shown) < 2 * LASTS:
        return None
    colours = np.array([course.sights[index].target for index in shown])
    at = int(np.argmax(np.nan_to_num(np.abs(np.diff(colours, axis=0)).max(axis=1))))
    # Just before, it may have been half covered.
    apart = np.abs(colours[at + 1 :] - np.median(colours[: at + 1], axis=0)).max(axis=1)
    covered = (course.hidden[shown[at] : behind] == 1.0).any()  # bit by bit, and its colours with it
    if covered or not (len(apart) >= LASTS and (apart > RECOLOURED).all() and shown[at + 1] <= moment.frame + 1):
        return None
    return sign("other-target", shown[at + 1], 0.9, apart=middle(apart))


def dull_pictures(moment: Moment) -> Sign | None:
    """Ask whether the pictures became blurred."""
    since = _begins(moment, lambda one, other: other.edge < DULLED * one.edge)
    if since is None:
        return None
    sights = moment.course.sights
    return sign("blurred-pictures", since, 0.8, edge=sights[since].edge, before=sights[since - 1].edge)


def nothing_seen(moment: Moment) -> Sign | None:
    """Ask whether the pictures show nothing any more, or nothing is measured."""
    sights = moment.course.sights
    since = _begins(moment, lambda one, other: other.contrast < FADED * one.contrast)
    if since is not None:
        return sign("blank-pictures", since, 1.0, contrast=sights[since].contrast, before=sights[since - 1].contrast)
    since = _begins(moment, lambda one, other: other.known < 0.5 * one.known)
    return None if since is None else sign("nothing-measured", since, 1.0, known=sights[since].known)


def same_picture(moment: Moment) -> Sign | None:
    """Ask whether one picture came again and again, while the target was seen in it, or is known to have moved."""
    course, sights, frame = moment.course, moment.course.sights, moment.frame
    ahead = frame + 1 < len(course) and sights and sights[frame].digest == sights[frame + 1].digest
    since = frame
    while ahead and since > 0 and sights[since].digest == sights[since - 1].digest:
        since -= 1
    if since in {0, frame}:
        return None
    still = slice(since + 1, frame + 1)
    # Behind something, or beyond the edge, the picture is the same as well, but then nothing of the target is seen.
    moved = (course.true_step[still] > 0.0) & (course.hidden[still] != 1.0) & (course.outside[still] != 1.0)
    seen = moved.any() if moment.knows_truth else moment.fits_after or not np.isfinite(course.fit).any()
    return sign("same-picture", since + 1, 0.9, count=frame - since) if seen else None


def says_nothing(moment: Moment) -> Sign | None:
    """Ask whether the weights were all the same up to the loss, while the target was among the particles."""
    course, until = moment.course, slice(1, moment.frame)
    shares = course.ess_share[until]
    among = course.error[until] <= 2.0 * course.deviation[until]
    if moment.frame <= FOLLOWING or (course.hidden[until] == 1.0).any() or not (among & (shares >= EQUAL)).all():
        return None
    return sign("says-nothing", 1, 0.9, share=middle(shares))
