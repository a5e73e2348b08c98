"""The belief in a chain after a frame, in one form for all trackers, and their reports."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Cloud, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.series import Hypotheses, Interval, Series, SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.numerics.elementary import wrap
from pftrack.core.refusal import ParameterError
from pftrack.experiments.declared import read_reported
from pftrack.experiments.linkage.model import LINKS, Bounds
from pftrack.experiments.linkage.scene import LinkageSceneParameters, in_degrees
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import measure_innovation
from pftrack.experiments.shared.reports import hypotheses_cloud, loss_share, particle_count
from pftrack.filters.beam import Beam
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.particles import ParticleSet


class Hypothesis(Protocol):
    """One member of a beam: a Gaussian, or a region."""

    @property
    def pose(self) -> Floats:
        """(6,) in the middle of it: the directions theta*_1..3, rad, and the lengths r_1..3, px."""

    def arrays(self) -> Mapping[str, Floats]:
        """Return its arrays by name, for a file."""


class Events(NamedTuple):
    """The events of a frame.

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
        low: (d,) lower bounds of the box of possible values: two standard deviations, 95 % of the lengths of particles,
            or everything not excluded.
        high: (d,) of the same.
        directions: (3,) theta*, rad.
        directions_sd: (3,) standard deviations of the same.
        origin_px: (2,) place of the chain's origin in the picture.
        reference: (3, 3) reference attitude, in space.
        log_evidence: Log evidence of this frame, where the method has one; else 0.
        events: Events of this frame.
        innovation: Innovation of a Gaussian filter with an observation.
        seen_px: Observation of a Gaussian filter, NaN for missing values; empty for other methods.
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
        """(d,) posterior standard deviations of the angles, degrees; NaN for values in px, which series report."""
        told = in_degrees(self.spread)
        told[-3:] = np.nan
        if self.in_space:
            told[3:5] = np.nan
        return told

    @property
    def in_space(self) -> bool:
        """Whether the chain moves in space rather than in a plane."""
        return self.reference is not None

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return particles, or what the hypotheses are made of, with log weights."""
        if isinstance(self.belief, ParticleSet):
            return self.belief.arrays()
        members: tuple[Hypothesis, ...] = self.belief.members
        parts = [member.arrays() for member in members]
        joined = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
        return {**joined, "log_weights": self.belief.log_weights, "parents": self.belief.parents}


SERIES = tuple(read_reported(Path(__file__).parent).values())
"""Series of every tracker: the range of each length, directions, hypotheses, and events. The range is two standard
deviations to either side, the middle 95 % of particles, or all that is not excluded; of hypotheses, of all together."""

GAUSSIAN_SERIES = (*SERIES, *reports.NIS, Series("seen_px", "what was measured", "px", "vector", role="measured"))

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
    """Return the distance, in deviations, to the nearest pose with one link mirrored in depth, from theta* to -theta*.

    In the plane both give the same image, so measurements do not show which one is true; where they are near each
    other, a filter may end on the other side.
    """
    ways = np.abs(wrap(2.0 * state.directions))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float((ways / state.directions_sd).min())


FLAT = ("theta 1", "theta 2", "theta 3", "length 1", "length 2", "length 3")
SPATIAL = ("omega x", "omega y", "omega z", "t x", "t y", *FLAT)
"""Names of the numbers of an estimate, in the plane and in space; angles in degrees, the others in px."""


class Seen(Model):
    """The displayed parts of a chain: hypotheses or particles, and ranges."""

    @override
    def cloud(self, state: LinkageState) -> Cloud | None:
        """Return hypotheses, laid open; None for particles, which a beam turns into one hypothesis."""
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

        A range is all that is not excluded, or two standard deviations to either side. It grows by possible motion, and
        is cut by the observation and by the bounds of joints and lengths.
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
        """Return particles, laid open; None for hypotheses, from which the particle filter drew its first particles."""
        belief = state.belief
        return Cloud(belief.states, belief.log_weights, belief.ancestors) if isinstance(belief, ParticleSet) else None


def _widths(state: LinkageState) -> Floats:
    return np.asarray(in_degrees(state.high) - in_degrees(state.low))


# All that can be set on the trackers of a chain.

FREE_DEG = 360.0
"""A bound of an angle that is none."""

GAUSSIANS = ("ekf", "ekf-truncated", "ekf-mirrors", "ukf")
SAMPLED = (*GAUSSIANS, "particles")
JOINTS, LENGTHS, NOISE, START = "Joints", "Lengths", "Motion and noise", "What is known at first"
ELLIPSOIDS = ("ellipsoids", "ellipsoids-literal")
REGIONS = (*ELLIPSOIDS, "box-guides")
MIRRORS, PARTICLES, SETS = "Mirrored hypotheses", "Particles", "Regions"


class _Joints(Parameters, group=JOINTS):
    """Angles that joints may have."""

    first_joint_low_deg: float = parameter(-360, "First joint from", unit="°", within=(-360, 360, 5))
    """Least angle of the first link, 0 parallel to the image; -360 leaves it free."""
    first_joint_high_deg: float = parameter(360, "First joint to", unit="°", within=(-360, 360, 5))
    """Greatest angle of the first link; 360 leaves it free."""
    joint_low_deg: float = parameter(0, "Other joints from", unit="°", within=(-360, 360, 5))
    """Least angle by which the second and the third joint bend."""
    joint_high_deg: float = parameter(90, "Other joints to", unit="°", within=(-360, 360, 5))
    """Greatest angle by which the second and the third joint bend."""
    joint_difference_12_deg: float = parameter(360, "Joints 1 and 2", unit="°", within=(0, 360, 5))
    """Largest difference between the angles of the first two joints; 360 leaves them free."""
    joint_difference_23_deg: float = parameter(30, "Joints 2 and 3", unit="°", within=(0, 360, 5))
    """Largest difference between the angles of the last two joints; 360 leaves them free."""


class _Lengths(Parameters, group=LENGTHS):
    """Lengths that links may have."""

    length_1_low_px: float = parameter(60, "Link 1 from", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Least length of the first link."""
    length_1_high_px: float = parameter(80, "Link 1 to", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Greatest length of the first link."""
    length_2_low_px: float = parameter(50, "Link 2 from", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Least length of the second link."""
    length_2_high_px: float = parameter(70, "Link 2 to", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Greatest length of the second link."""
    length_3_low_px: float = parameter(40, "Link 3 from", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Least length of the third link."""
    length_3_high_px: float = parameter(60, "Link 3 to", unit="px", within=(1, 2000, 1), useful=(10, 150))
    """Greatest length of the third link."""
    length_difference_12_px: float = parameter(15, "Links 1 and 2", unit="px", within=(0, 2000, 1), useful=(0, 100))
    """Largest difference between the lengths of the first two links."""
    length_difference_23_px: float = parameter(15, "Links 2 and 3", unit="px", within=(0, 2000, 1), useful=(0, 100))
    """Largest difference between the lengths of the last two links."""


class _Noise(Parameters, group=NOISE, trackers=SAMPLED):
    """How the chain moves and is seen."""

    acceleration_rad: float = parameter(
        0.03, "Acceleration", unit="rad/frame²", within=(0.0001, 1, 0.005), useful=(0.005, 0.2), role="noise"
    )
    """Standard deviation of the angular acceleration, with the velocity constant otherwise."""
    root_acceleration_px: float = parameter(
        0.1, "Acceleration of the root", unit="px/frame²", within=(0.0001, 50, 0.05), useful=(0.05, 2), role="noise"
    )
    """Standard deviation of the root's acceleration in space, along each axis."""
    observation_variance_px2: float = parameter(
        5, "Observation variance", unit="px²", within=(0.0001, 1000, 0.5), useful=(0.01, 50), role="noise"
    )
    """Variance of each observed coordinate, as the trackers assume it."""
    outlier_limit_sd: float = parameter(20, "Outlier limit", unit="sd", within=(2, 1000, 1), useful=(2, 60))
    """A frame whose observation lies farther than this from every prediction is left out."""
    linearisations: int = parameter(
        1, "Linearisations", within=(1, 10, 1), trackers=("ekf", "ekf-truncated", "ekf-mirrors")
    )
    """Number of linearisations of an observation: first at the prediction, then at the last result. In space, and if
    noise is small, more than one avoid premature confidence of the filter; in the plane they lose mirror images."""


class _Start(Parameters, group=START, trackers=SAMPLED):
    """Prior knowledge in the first frame."""

    start_angle_variance_rad2: float = parameter(
        0.2, "Variance of angles", unit="rad²", within=(1e-6, 10, 0.01), useful=(0.01, 1), live=False
    )
    """Variance of each angle in the first frame."""
    start_rate_variance_rad2: float = parameter(
        0.01, "Variance of turning", unit="rad²", within=(1e-8, 1, 0.001), useful=(0.0001, 0.1), live=False
    )
    """Variance of the change of each angle in a frame, in the first frame."""
    start_length_variance_px2: float = parameter(
        400, "Variance of lengths", unit="px²", within=(1e-4, 1e5, 10), useful=(10, 1000), live=False
    )
    """Variance of each length in the first frame."""
    start_root_variance_px2: float = parameter(
        9, "Variance of the root", unit="px²", within=(1e-4, 1e5, 1), useful=(1, 100), live=False
    )
    """Variance of each coordinate of the root in space, in the first frame."""


class _Mirrors(Parameters, group=MIRRORS, trackers=("ekf-mirrors",), constants={"score_memory": 0.7}):
    """Hypotheses on both sides of the picture plane."""

    beam_width: int = parameter(4, "Beam", within=(1, 16, 1))
    """Number of hypotheses kept from frame to frame."""
    mirror_tau: float = parameter(0.35, "Almost parallel", within=(0, 1, 0.05))
    """A link whose direction has a sine below this is taken on both sides, as it is and mirrored in depth."""
    rejection_sd: float = parameter(3, "Far outside", unit="sd", within=(0.1, 100, 0.5), useful=(0.5, 10))
    """A hypothesis that lies so far beyond a bound is refuted."""


class _Particles(Parameters, group=PARTICLES, trackers=("particles",)):
    """Particles, and whether their noises are known."""

    sample_count: int = particle_count(200)
    noise_unknown: bool = parameter(True, "Unknown noises")
    """Whether acceleration of each joint and observation variance are estimated, up to twice what is given."""


class _Sets(
    Parameters,
    group=SETS,
    trackers=REGIONS,
    constants={
        "region_passes": 2,
        "direction_cells": 128,
        "attitude_cells": 7,
        "least_ellipsoid": "trace",
        "tightened": True,
    },
):
    """Regions that hold the truth, and how exactly they are computed."""

    motion_bound_rad: float = parameter(
        0.06, "Motion bound", unit="rad/frame", within=(0, 1, 0.01), useful=(0, 0.3), role="noise"
    )
    """Most that the directions of all links, and in space the attitude, move in a frame, as one vector; the regions
    hold the truth only if that is so. 0 for a chain that is known to stand still."""
    root_motion_bound_px: float = parameter(
        1, "Motion bound of the root", unit="px/frame", within=(0, 200, 0.5), useful=(0, 20), role="noise"
    )
    """Most that the root moves in a frame along each axis of the picture, in space, while no point is seen."""
    error_bound_px: float = parameter(3, "Error bound", unit="px", within=(0, 200, 0.5), useful=(0, 15), role="noise")
    """Greatest error of an observed coordinate; the regions hold the truth only if that is so."""
    start_angle_bound_rad: float = parameter(
        0.1, "Angles within", unit="rad", within=(0, 3, 0.01), useful=(0, 1), live=False
    )
    """Largest error of each angle in the first frame, to either side."""
    start_length_bound_px: float = parameter(
        20, "Lengths within", unit="px", within=(0, 2000, 1), useful=(0, 60), live=False
    )
    """Largest error of each length in the first frame, to either side."""
    start_root_bound_px: float = parameter(
        3, "Root within", unit="px", within=(0, 2000, 0.5), useful=(0, 30), live=False
    )
    """Largest error of the root in the first frame, along each axis of the picture, in space."""
    split_regions: bool = parameter(True, "Splitting")
    """Whether a region is split where a link may lean towards the camera or away from it."""
    angle_scale_px: float = parameter(
        55, "Scale of angles", unit="px/rad", within=(1, 1000, 5), useful=(5, 200), trackers=ELLIPSOIDS
    )
    """Weight of a rad, in px, in the trace, which adds squares of angles and lengths."""
    predicted_ellipsoid: Literal["outer", "lengthened", "printed"] = parameter(
        "outer", "Prediction", trackers=("ellipsoids-literal",)
    )
    """How an ellipsoid grows by a motion: by an outer bound; by making every semi-axis longer, as Shimada says in
    words; or by P + du I with du in px, as it prints. The last two lose a part of what is possible."""
    first_ellipsoid: Literal["circumscribed", "inscribed"] = parameter(
        "circumscribed", "First ellipsoid", live=False, trackers=("ellipsoids-literal",)
    )
    """Whether the first ellipsoid is around the box of what is possible, or within it, which loses its corners."""


class LinkageTrackerParameters(_Sets, _Particles, _Mirrors, _Start, _Noise, _Lengths, _Joints):
    """Bounds of joints and lengths, motion and observation of the chain, and settings of each tracker."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Refuse bounds that nothing fulfils, naming one of those that contradict each other."""
        for name, other in (
            ("first_joint_low_deg", "first_joint_high_deg"),
            ("joint_low_deg", "joint_high_deg"),
            *((f"length_{i}_low_px", f"length_{i}_high_px") for i in (1, 2, 3)),
        ):
            least, most = getattr(self, name), getattr(self, other)
            if least > most:
                raise ParameterError(name, least, f"at most {other}, {most:g}")
        joints = (
            (self.first_joint_low_deg, self.first_joint_high_deg),
            *2 * ((self.joint_low_deg, self.joint_high_deg),),
        )
        lengths = tuple((getattr(self, f"length_{i}_low_px"), getattr(self, f"length_{i}_high_px")) for i in (1, 2, 3))
        for ranges, what, unit in ((joints, "joint", "deg"), (lengths, "length", "px")):
            low, high = ranges[0]
            for i, (least, most) in enumerate(ranges[1:], 1):
                field = f"{what}_difference_{i}{i + 1}_{unit}"
                widest = getattr(self, field)
                if least > high + widest or most < low - widest:
                    needed = max(least - high, low - most)
                    raise ParameterError(field, widest, f"at least {needed:g} with these ranges of both")
                low, high = max(least, low - widest), min(most, high + widest)
        return self

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of joints and lengths, rad and px."""
        low = np.deg2rad([self.first_joint_low_deg, self.joint_low_deg, self.joint_low_deg])
        high = np.deg2rad([self.first_joint_high_deg, self.joint_high_deg, self.joint_high_deg])
        difference = np.deg2rad([self.joint_difference_12_deg, self.joint_difference_23_deg])
        free = np.deg2rad(FREE_DEG)
        low[low <= -free], high[high >= free], difference[difference >= free] = -np.inf, np.inf, np.inf
        return Bounds(
            tuple(low.tolist()),
            tuple(high.tolist()),
            tuple(difference.tolist()),
            (self.length_1_low_px, self.length_2_low_px, self.length_3_low_px),
            (self.length_1_high_px, self.length_2_high_px, self.length_3_high_px),
            (self.length_difference_12_px, self.length_difference_23_px),
        )


SCORING, DRAWING = "Scoring", "Drawing"


class LinkageParameters(LinkageTrackerParameters, group=SCORING):
    """The trackers, what counts as lost, and what is drawn."""

    lost_deg: float = parameter(11.5, "Limit of success", unit="°", within=(0.5, 180, 0.5), useful=(0.5, 45))
    """The chain counts as lost when the direction of a link is further off than this, or when regions exclude it."""
    lost_share: float = loss_share(0.1)
    shown_hypothesis: int = parameter(
        1, "Shown hypothesis", within=(1, 100, 1), useful=(1, 16), group=DRAWING, role="drawing"
    )
    """Which of a frame's hypotheses is drawn in the picture beside the estimate."""


class SimulatedLinkageParameters(LinkageParameters, LinkageSceneParameters):
    """The simulated chain and its trackers."""
