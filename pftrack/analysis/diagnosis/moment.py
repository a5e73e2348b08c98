"""The moment of which a diagnosis speaks, and what the run was like before it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pftrack.analysis.diagnosis.course import Course, Flags, Numbers
from pftrack.runs.loss_intervals import LASTING_FRAMES

__all__ = ["ENOUGH", "FOLLOWING", "LEADING", "Moment", "middle"]

SCATTERS = 3.0
"""A fit is low if it is below its usual value by so many times its usual scatter,"""
LEAST_FALL = {True: 0.12, False: 0.6}
"""and by at least so much: of a likeness, 0..1, and of a log evidence."""
LOWEST = 2.0 / 3.0
"""Of its usual value that a likeness has at the least where it is not low, however much it scatters."""
ENOUGH, FEWEST = 8, 4
"""So many usual frames show what is usual, and so many at the least make a scatter."""

PLACE = 2
"""Numbers of an estimate that is a place in the picture."""
FAR = 4.0
"""Times the usual error that an error is great."""

EQUAL = 0.985
"""Of particles whose weights are all the same, to the ESS over their number: nothing that is seen tells them apart."""
FALLEN, RISEN, ALIKE = 0.8, 1.12, 0.9
"""Times the least ESS before that it falls to where few particles are better than the rest; times its usual value, and
of the particles at the least, that it rises to where none is."""
PART_FALL, HALFWAY, FADING = 0.3, (0.25, 0.7), 0.2
"""A part's likeness falls if by so much; it is halfway between these shares of its fall; and so many frames of each are
so, at the least, where a target fades rather than goes out of sight."""
LEADING, FOLLOWING = 8, 8
"""So many frames before a moment may hold what led to it, and so many after it show what came of it."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of a course, with what is usual in the frames before it.

    Attributes:
        course: The run.
        frame: The first frame of the loss, or the one that is asked about.
    """

    course: Course
    frame: int

    @cached_property
    def usual(self) -> Flags:
        """(L,) the frames before it in which the target was followed in sight; those just before only if need be."""
        course, frames = self.course, np.arange(len(self.course))
        good = (frames >= 1) & (frames < self.frame) & ~course.lost & (course.hidden != 1.0) & (course.outside != 1.0)
        calm = good & (frames < self.frame - 2)
        return np.asarray(calm if np.count_nonzero(calm) >= LASTING_FRAMES else good)

    @property
    def is_place(self) -> bool:
        """Whether the estimate is a place in the picture."""
        return int(self.course.estimates.shape[1]) == PLACE

    @property
    def is_gaussian(self) -> bool:
        """Whether the belief is one without particles whose evidence is that of an innovation."""
        course = self.course
        return not any(np.isfinite(column).any() for column in (course.particles, course.likeness, course.misfit))

    @property
    def knows_truth(self) -> bool:
        """Whether the truth is known of any frame."""
        return bool(np.isfinite(self.course.error).any())

    @cached_property
    def _usual_fits(self) -> Numbers:
        """Fits of the usual frames, of that third of them in which they are best: what is lost slowly fits worse."""
        fits = self.course.fit[self.usual & np.isfinite(self.course.fit)]
        parts = np.array_split(fits, min(3, max(len(fits) // ENOUGH, 1)))
        return max(parts, key=middle)

    @cached_property
    def usual_fit(self) -> float:
        """Median of the fit in the usual frames; NaN where there are none."""
        return middle(self._usual_fits)

    @cached_property
    def low_fit(self) -> float:
        """Fit below which the picture does not show the target where it is believed to be."""
        fits = self._usual_fits
        scatter = 1.4826 * middle(np.abs(fits - self.usual_fit)) if len(fits) >= FEWEST else 0.0
        by_likeness = self.course.fit is self.course.likeness
        low = self.usual_fit - max(SCATTERS * scatter, LEAST_FALL[by_likeness])
        # What is lost slowly fits worse and worse, which is no scatter of a good fit.
        return max(low, LOWEST * self.usual_fit) if by_likeness else low

    @cached_property
    def unseen(self) -> Flags:
        """(L,) whether the picture does not show the target where it is believed to be.

        Either the fit is low, or nothing tells the particles apart while the fit is at the lowest of the run.
        """
        nothing = (self.course.ess_share >= EQUAL) & self.at_floor
        return np.asarray((self.course.fit < self.low_fit) | nothing)

    @cached_property
    def at_floor(self) -> Flags:
        """(L,) whether the fit is as low as in any frame of the run, or nearly."""
        fit = self.course.fit
        known = fit[np.isfinite(fit)]
        floor = known.min() + 0.05 * float(np.ptp(known)) if len(known) else np.nan
        return np.asarray(fit <= floor)

    @cached_property
    def goes_blind(self) -> int | None:
        """First frame of the stretch in which nothing is seen any more, if it is so in most of the next; else None."""
        since = self.since(self.unseen)
        blind = self.unseen[since : since + FOLLOWING]
        return since if len(blind) and np.count_nonzero(blind) > len(blind) / 2 else None

    @cached_property
    def leaves_cloud(self) -> bool:
        """Whether, as the fit fell, few particles became better than the rest: those at the edge of the cloud.

        So it is when a target leaves a cloud that does not follow. What is covered makes all of them alike instead.
        """
        shares, since = self.course.ess_share, self.goes_blind
        # Of a pose by its features the effective sample size tells nothing: they are weighed one by one.
        if since is None or self.by_features:
            return False
        before = shares[max(since - LEADING - 2, 1) : max(since - 1, 2)]
        falling = shares[max(since - 4, 1) : since + 4]
        falling = falling[falling < EQUAL]
        if not len(falling) or not np.isfinite(before).any():
            return False
        usual, later = middle(shares[self.usual]), middle(shares[since : since + FOLLOWING])
        never_alike = later < min(RISEN * usual, ALIKE)
        return bool(falling.min() < FALLEN * np.nanmin(before)) or never_alike

    @property
    def by_features(self) -> bool:
        """Whether the estimate is no place, but a pose that is told by the likeness of features."""
        return self.course.fit is self.course.likeness and not self.is_place

    @property
    def is_gone(self) -> bool:
        """Whether a pose by its features fits so badly that it is not only seen from the side, some hidden."""
        return middle(self.course.fit[self.after]) < LOWEST * self.usual_fit

    @cached_property
    def fades(self) -> bool:
        """Whether, as the fit fell, parts of the target fitted by half: they are in sight, and looked for beside it.

        What covers a part takes it within a frame, and leaves those beside it as they were.
        """
        parts, since = self.course.parts, self.goes_blind
        if since is None or not self.by_features or not parts.shape[1]:
            return False
        usual = self.usual & (np.arange(len(parts)) < since - 2)
        fell = _medians(parts[usual]) - _medians(parts[since + 1 : since + 1 + FOLLOWING])
        falling = fell > PART_FALL
        way = (_medians(parts[usual]) - parts[max(since - 1, 0) : since + 2]) / fell
        half = (way > HALFWAY[0]) & (way < HALFWAY[1])
        return bool(np.count_nonzero(half[:, falling]) > FADING * np.count_nonzero(falling))

    @property
    def fits_after(self) -> bool:
        """Whether what is followed from there on fits as what was followed before, in most frames."""
        blind = self.unseen[self.after]
        return middle(self.course.fit[self.after]) >= self.low_fit and bool(np.count_nonzero(blind) <= len(blind) / 2)

    @property
    def is_off(self) -> bool:
        """Whether the estimate is known to be far off: lost by the truth, or by several times the usual error."""
        course = self.course
        far = middle(course.error[self.after]) > FAR * middle(course.error[self.usual])
        return bool(np.isfinite(course.error[self.frame]) and (course.lost[self.frame] or far))

    @property
    def before(self) -> slice:
        """The frames just before it, without frame 0 where there are others."""
        return slice(min(max(self.frame - LEADING, 1), max(self.frame - 1, 0)), max(self.frame, 1))

    @property
    def after(self) -> slice:
        """This frame and those just after it."""
        return slice(self.frame, self.frame + FOLLOWING)

    @property
    def near(self) -> slice:
        """The frames just before and just after it: what hides a target covers it little by little."""
        return slice(max(self.frame - LEADING, 0), self.frame + FOLLOWING)

    @property
    def around(self) -> slice:
        """The frames just before it, this one and the two after it."""
        return slice(max(self.frame - LEADING, 0), self.frame + 3)

    def since(self, holds: Flags, *, gap: int = 1) -> int:
        """Return the first frame of the stretch of frames in which something holds that reaches this one.

        Args:
            holds: (L,) where it holds.
            gap: So many frames in which it does not hold do not end a stretch.

        Returns:
            The frame; this one if it holds in none before, or the first one after if it holds from there on.
        """
        places = np.flatnonzero(holds[: self.frame + 1])
        if not len(places) or places[-1] < self.frame - LEADING:
            later = np.flatnonzero(holds[self.frame :])
            return self.frame + (int(later[0]) if len(later) else 0)
        breaks = np.flatnonzero(np.diff(places) > gap + 1)
        return int(places[breaks[-1] + 1] if len(breaks) else places[0])


def _medians(values: Numbers) -> Numbers:
    """Return the medians (n,) of the finite values in each column of (k, n); NaN of a column without."""
    return np.array([middle(column) for column in values.T])


def middle(values: Numbers) -> float:
    """Return the median of the finite values; NaN if there are none.

    It is a number of NumPy's, so that what is divided by a deviation of zero is infinite.
    """
    known = values[np.isfinite(values)]
    return np.float64(np.median(known) if len(known) else np.nan)
