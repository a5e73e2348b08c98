"""What is believed of a chain after a frame, in one form for all trackers, and what they report of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Cloud, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.series import Hypotheses, Interval, Series, SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments.declared import read_reported
from pftrack.experiments.linkage.model import LINKS
from pftrack.experiments.linkage.scene import in_degrees
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import NIS, measure_innovation
from pftrack.experiments.shared.reports import hypotheses_cloud
from pftrack.filters.beam import Beam
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.particles import ParticleSet


class Hypothesis(Protocol):
    """One member of a beam: a Gaussian, or a region."""

    @property
    def pose(self) -> Floats:
        """(6,) in the middle of it: the directions theta*_1..3, rad, and the lengths r_1..3, px."""

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""

    def arrays(self) -> Mapping[str, Floats]:
        """Return its arrays by name, for a file."""


class Events(NamedTuple):
    """What happened in a frame.

    Attributes:
        splits: Hypotheses that were added.
        merges: Hypotheses that were dropped since another one held them.
        refuted: Hypotheses that were dropped since they contradict what is known.
        truncated: Bounds that took something off a belief.
        outlier: Whether the observation was left out as a wrong one.
    """

    splits: int = 0
    merges: int = 0
    refuted: int = 0
    truncated: int = 0
    outlier: bool = False


NOTHING = Events()


@dataclass(frozen=True, slots=True, eq=False)
class LinkageState:
    """The posterior of one frame, immutable.

    In the plane the estimate is (theta_1..3, r_1..3), in space (omega, t, theta_1..3, r_1..3) with theta_1 = 0; rad and
    px, omega relative to the reference attitude.

    Attributes:
        belief: Gaussians or regions, each of them a `Hypothesis`, or particles.
        mean: (d,) the estimate, d 6 or 11.
        spread: (d,) standard deviations of the same.
        low: (d,) of the box of what is believed possible: two standard deviations, 95 % of the lengths of particles, or
            all that is not excluded.
        high: (d,) of the same.
        directions: (3,) theta*, rad.
        directions_sd: (3,) standard deviations of the same.
        origin_px: (2,) place of the chain's origin in the picture.
        reference: (3, 3) reference attitude, in space.
        log_evidence: Of this frame, where the method has one; else 0.
        events: What happened in this frame.
        innovation: How far off what was seen was, of a Gaussian filter that saw something.
        seen_px: What a Gaussian filter was given to see, NaN where it saw nothing; empty of other methods.
    """

    belief: Beam[Any] | ParticleSet
    mean: Floats
    spread: Floats
    low: Floats
    high: Floats
    directions: Floats
    directions_sd: Floats
    origin_px: Floats
    reference: Floats | None = None
    log_evidence: float = 0.0
    events: Events = NOTHING
    innovation: NormalisedInnovation | None = None
    seen_px: tuple[float, ...] = ()

    @property
    def estimate(self) -> Floats:
        """(d,) posterior mean, angles in degrees."""
        return in_degrees(self.mean)

    @property
    def sigma(self) -> Floats:
        """(d,) posterior standard deviations of the angles, degrees; NaN for what is in px, which series tell."""
        told = in_degrees(self.spread)
        told[-3:] = np.nan
        if self.in_space:
            told[3:5] = np.nan
        return told

    @property
    def in_space(self) -> bool:
        """Whether the chain moves in space rather than in a plane."""
        return self.reference is not None

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        if isinstance(self.belief, ParticleSet):
            return 2048 + self.belief.nbytes
        members: tuple[Hypothesis, ...] = self.belief.members
        return 2048 + sum(member.nbytes for member in members)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return particles, or what the hypotheses are made of, with log weights."""
        if isinstance(self.belief, ParticleSet):
            return self.belief.arrays()
        members: tuple[Hypothesis, ...] = self.belief.members
        parts = [member.arrays() for member in members]
        joined = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
        return {**joined, "log_weights": self.belief.log_weights, "parents": self.belief.parents}


SERIES = tuple(read_reported(Path(__file__).parent).values())
"""Of every tracker: the range of each length, directions, hypotheses, and what happened. The range is two standard
deviations to either side, the middle 95 % of particles, or all that is not excluded; of hypotheses, of all together."""

GAUSSIAN_SERIES = (*SERIES, *NIS, Series("seen_px", "what was measured", "px", "vector", role="measured"))

PARTICLE_SERIES = (*SERIES, *reports.CLOUD)


def measure(state: LinkageState) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    belief, events = state.belief, state.events
    lengths = {
        f"length_{i + 1}": Interval(float(state.low[i - LINKS]), float(state.high[i - LINKS])) for i in range(LINKS)
    }
    angles = {f"direction_{i + 1}": float(np.rad2deg(state.directions[i])) for i in range(LINKS)}
    deviations = {f"direction_{i + 1}_sd": float(np.rad2deg(state.directions_sd[i])) for i in range(LINKS)}
    happened = {
        "split": float(events.splits > 0),
        "merged": float(events.merges > 0),
        "refuted": float(events.refuted > 0),
        "cut": float(events.truncated),
        "outlier": float(events.outlier),
    }
    innovation = measure_innovation(state.innovation)
    values: dict[str, SeriesValue] = {**lengths, **angles, **deviations, **happened, **innovation}
    if not state.in_space:
        values["mirror_gap"] = _mirror_gap(state)
    if state.seen_px:
        values["seen_px"] = state.seen_px
    if isinstance(belief, ParticleSet):
        return {**values, **reports.cloud(belief, resampled=bool((belief.ancestors != np.arange(len(belief))).any()))}
    poses = tuple(
        (*np.rad2deg(member.pose[:LINKS]).tolist(), *member.pose[LINKS:].tolist()) for member in belief.members
    )
    weights = tuple(belief.weights.tolist())
    return {
        **values,
        "hypothesis_count": float(len(belief)),
        "hypotheses": Hypotheses(poses, weights, parents=tuple(belief.parents.tolist())),
    }


def _mirror_gap(state: LinkageState) -> float:
    """Return how many deviations it is to the nearest pose with one link mirrored in depth, from theta* to -theta*.

    In the plane it is seen just the same, so nothing that is measured tells which of both is the true one; where they
    are near each other, a filter may come out on the other side.
    """
    ways = np.abs(wrap(2.0 * state.directions))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float((ways / state.directions_sd).min())


FLAT = ("theta 1", "theta 2", "theta 3", "length 1", "length 2", "length 3")
SPATIAL = ("omega x", "omega y", "omega z", "t x", "t y", *FLAT)
"""Names of the numbers of an estimate, in the plane and in space; angles in degrees, the others in px."""


class Seen(Model):
    """What there is to see of a chain: hypotheses or particles, and ranges."""

    @override
    def cloud(self, state: LinkageState) -> Cloud | None:
        """Return hypotheses, laid open; None of particles, of which a beam makes one hypothesis."""
        belief = state.belief
        if isinstance(belief, ParticleSet):
            return None
        poses = np.array([member.pose for member in belief.members])
        return hypotheses_cloud(poses, belief.log_weights, belief.parents)

    @override
    def update_parts(
        self, before: LinkageState, state: LinkageState, frame: Frame, parameters: Values
    ) -> tuple[Part, ...]:
        """Return how the frame has changed the range of each number, and what happened to hypotheses and bounds.

        A range is all that is not excluded, or two standard deviations to either side. It grows by what may have moved,
        and is cut by what was seen and by the bounds of joints and lengths.
        """
        events = state.events
        happened = (
            Amount("bounds that cut", float(events.truncated)),
            Amount("hypotheses refuted", float(events.refuted)),
            Amount("hypotheses merged", float(events.merges)),
            Amount("hypotheses added", float(events.splits)),
        )
        if before is state or len(before.low) != len(state.low):
            return happened
        old, new = (_widths(each) for each in (before, state))
        low, high = in_degrees(state.low), in_degrees(state.high)
        change = 100.0 * (new / np.maximum(old, 1e-12) - 1.0)
        rows = tuple(map(tuple, np.column_stack([low, high, old, new, np.where(old > 0.0, change, np.nan)]).tolist()))
        names = SPATIAL if state.in_space else FLAT
        columns = ("from", "to", "width before", "width", "change (%)")
        return (Contributions("ranges, before and after the frame (° or px)", columns, names, rows), *happened)


class SeenParticles(Seen):
    """The same by particles."""

    @override
    def cloud(self, state: LinkageState) -> Cloud | None:
        """Return particles, laid open; None of hypotheses, of which the particle filter drew its first ones."""
        belief = state.belief
        return Cloud(belief.states, belief.log_weights, belief.ancestors) if isinstance(belief, ParticleSet) else None


def _widths(state: LinkageState) -> Floats:
    return np.asarray(in_degrees(state.high) - in_degrees(state.low))
