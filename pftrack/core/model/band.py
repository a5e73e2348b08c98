"""Bands: a tracker's own error estimates, and whether the truth lies in them.

A band of 95 % should hold the truth in 95 % of the reports, one of 50 % in half of them, and a region that is promised
to hold it in all. Each kind below derives from the numbers of a frame which of its bands held the truth:

- `EstimateBand`: the estimate with its standard deviations, which every tracker has;
- `DeviationBand`: series with their own standard deviations, compared with series of the truth;
- `IntervalBand`: series of the shape "interval", compared with series of the truth;
- `FlagBand`: series of flags, for bands that are not Gaussian, and for regions.

An experiment lists its bands; those of one that lists none are of its estimate.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pftrack.core.arrays import Bools
from pftrack.core.model.parameters import Value
from pftrack.core.model.tracker import Diagnostics

HALF, MOST, ALL = 0.5, 0.95, 1.0
"""Nominal shares of bands."""

WITHIN: Mapping[float, float] = {HALF: 0.6745, MOST: 1.96}
"""Standard deviations to either side of a Gaussian's middle, by share."""

Held: TypeAlias = Mapping[float, Bools]
"""Whether each number of a frame was held by its band, by the band's share; without a truth there are no numbers."""


@dataclass(frozen=True, slots=True)
class EstimateBand:
    """The estimate with its standard deviations.

    Attributes:
        of: Its subject.
        trackers: Trackers that have it.
    """

    of: str = "estimate"
    trackers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series that it is made of: none."""
        return ()

    def held(self, row: Diagnostics) -> Held:
        """Return whether the truth was held in a frame."""
        return {} if row.truth is None else _within(row.estimate, row.sigma, row.truth)


@dataclass(frozen=True, slots=True)
class DeviationBand:
    """Series of numbers, each with one of its standard deviations and one of its truths.

    Attributes:
        of: What it is about.
        values: Names of the series.
        deviations: Names of those of their standard deviations.
        truths: Names of those of what is true.
        turn: A whole turn in their unit for angles, else 0.
        trackers: That have it.
    """

    of: str
    values: tuple[str, ...]
    deviations: tuple[str, ...]
    truths: tuple[str, ...]
    turn: float = 0.0
    trackers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series that it is made of."""
        return self.values + self.deviations + self.truths

    def held(self, row: Diagnostics) -> Held:
        """Return whether the truth was held in a frame."""
        columns = [[row.number(name) for name in names] for names in (self.values, self.deviations, self.truths)]
        return _within(*columns, turn=self.turn)


@dataclass(frozen=True, slots=True)
class IntervalBand:
    """Series of intervals that hold the truth with one probability.

    Attributes:
        of: What it is about.
        intervals: Names of the series.
        truths: Names of those of what is true.
        share: Nominal share of each.
        trackers: That have it.
    """

    of: str
    intervals: tuple[str, ...]
    truths: tuple[str, ...]
    share: float = MOST
    trackers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series that it is made of."""
        return self.intervals + self.truths

    def held(self, row: Diagnostics) -> Held:
        """Return whether the truth was held in a frame."""
        ends = np.array([row.vector(name) or (np.nan, np.nan) for name in self.intervals])
        truths = np.array([row.number(name) for name in self.truths])
        known = np.isfinite(truths) & np.isfinite(ends).all(axis=1)
        return {self.share: ((ends[:, 0] <= truths) & (truths <= ends[:, 1]))[known]}


@dataclass(frozen=True, slots=True)
class FlagBand:
    """Series of flags that are 1 where the truth was held.

    Attributes:
        of: What it is about.
        flags: Names of the series, by the share of the band.
        trackers: That have it.
    """

    of: str
    flags: Mapping[float, str] = field(default_factory=dict)
    trackers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series that it is made of."""
        return tuple(self.flags.values())

    def held(self, row: Diagnostics) -> Held:
        """Return whether the truth was held in a frame."""
        found = {}
        for share, name in self.flags.items():
            values = np.array(row.vector(name) or (row.number(name),))
            found[share] = values[np.isfinite(values)] > 0.0
        return found


Band: TypeAlias = EstimateBand | DeviationBand | IntervalBand | FlagBand


def _within(values: ArrayLike, deviations: ArrayLike, truths: ArrayLike, *, turn: float = 0.0) -> Held:
    """Return what Gaussians hold; an estimate that is not finite holds nothing, and what has no deviation is left out.

    Lengths may differ where a frame has no truth of some: then there is nothing to compare.
    """
    found, spread, true = (np.asarray(one, dtype=np.float64) for one in (values, deviations, truths))
    if not found.shape == spread.shape == true.shape:
        return {}
    off = np.abs(found - true)
    if turn > 0.0:
        off = np.abs(np.remainder(found - true + 0.5 * turn, turn) - 0.5 * turn)
    known = np.isfinite(spread) & np.isfinite(true)
    off = np.where(np.isfinite(found), off, np.inf)
    return {share: (off <= width * spread)[known] for share, width in WITHIN.items()}


# An experiment declares the settings at which its bands were tested, and what was found. At all others they are not
# calibrated. Figures and reasons stand in `docs/explanation/calibration.md`.

Finding: TypeAlias = Literal["right", "overconfident", "underconfident", "uncalibrated"]

DOUBTS: Mapping[Finding, str] = {
    "overconfident": "Error bands are too narrow here: they hold the truth less often than they say.",
    "underconfident": "Error bands are too wide here: they hold the truth more often than they say.",
    "uncalibrated": "Error bands are a rough guide: they are not calibrated at these settings.",
}
"""Findings other than right, each with the sentence that a screen shows."""


@dataclass(frozen=True, slots=True)
class BandTest:
    """A test of bands, and its settings: those of the default scene, and around it where parameters are named.

    Attributes:
        trackers: Names of those that it is about.
        within: Values of parameters by name: the least and the greatest of a number, all of a choice. Others have the
            values of the default scene; those that the tracker does not read, and those that only draw or score, may
            have any.
        bands: Subjects of the tested bands; empty for all.
        found: Whether they hold the truth as often as they say, or less or more often.
    """

    trackers: tuple[str, ...]
    within: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    bands: tuple[str, ...] = ()
    found: Finding = "right"

    def holds(self, of: str, parameters: Any, turned: set[str]) -> bool:  # noqa: ANN401 - the experiment's own model
        """Return whether it is about a band with these parameters; those turned differ from the default scene."""
        is_known = (not self.bands or of in self.bands) and turned <= self.within.keys()
        return is_known and all(_allows(each, getattr(parameters, name, None)) for name, each in self.within.items())


def _allows(allowed: tuple[Any, ...], value: Any) -> bool:  # noqa: ANN401 - a value, or None without the parameter
    if value is None or isinstance(value, str | bool):
        return value in allowed
    return bool(allowed[0] <= value <= allowed[-1])


@dataclass(frozen=True, slots=True)
class Calibration:
    """Declarations on the bands of an experiment's trackers.

    Attributes:
        bands: Its trackers' error estimates, and their comparison with the truth; empty without promises.
        tested: Settings at which it is known how often they hold the truth; of two the first counts.
        presets: Names of those in which bands are measured, in addition to the default scene.
        scene: Name of the parameter that numbers scenes of one kind, such as people; measured are as many of them as
            seeds. Empty where the seed alone makes another scene.
        frames: Largest number of measured frames of a run.
    """

    bands: tuple[Band, ...] = (EstimateBand(),)
    tested: tuple[BandTest, ...] = ()
    presets: tuple[str, ...] = ()
    scene: str = ""
    frames: int = 120


STANDARD_CALIBRATION = Calibration()
"""For an experiment without a declaration: the band of the estimate, which is not calibrated."""
