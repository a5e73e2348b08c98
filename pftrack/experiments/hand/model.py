"""Parameters of the trackers of a hand, the same for compiled code, and the prior of a hand.

Areas and distances are those of a palm axis of 52 px; compiled code has them in px of the hand that is followed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.series import Hypotheses, SeriesValue
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.declared import read_reported
from pftrack.experiments.hand.shape import ANGLES, HandShape, joints
from pftrack.experiments.hand.silhouette import SilhouetteParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.reports import loss_share, particle_count
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet, normalise

NOMINAL_SCALE_PX = 52.0
"""Length of the palm axis for which areas and distances are given; lengths in px scale with it, areas with its
square."""

MOST_KEPT = 16
"""Hands from frame to frame."""

BEAM = ("beam",)
KEPT, CANDIDATES, MOTION, LOSS, RANKING = "Beam", "Candidates", "Motion", "Loss", "Ranking"


class _Search(Parameters, constants={"step_area_px2": 90, "palm_count": 20}, group=CANDIDATES, trackers=BEAM):
    """Candidates, and the number of kept ones."""

    beam_width: int = parameter(4, "Hands kept", within=(1, MOST_KEPT, 1), group=KEPT)
    """Number of different hands kept from frame to frame."""
    sample_count: int = particle_count(100, trackers=("particles",))


FORMER_MOTION = {
    "still_penalty": 0.7,
    "spread_sd_rad": 0.08,
    "wrist_sd_rad": 0.15,
    "palm_turn_sd_rad": 0.06,
    "palm_tilt_sd_rad": 0.1,
}


class _Motion(Parameters, constants=FORMER_MOTION, group=MOTION):
    """How far a hand may be from where it was expected."""

    flexion_sd_rad: float = parameter(
        0.35, "Bending of fingers", unit="rad", within=(0.01, 2, 0.01), useful=(0.01, 1), role="noise"
    )
    """Standard deviation of a finger's flexion from the prediction."""
    growth_sd: float = parameter(0, "Change of size", within=(0, 0.1, 0.005), trackers=BEAM)
    """Relative change of a hand's size per frame as its distance changes; 0 at a fixed distance. It trades off with
    tilts, and needs the refined ranking."""
    wrist_prior: bool = parameter(True, "Straight wrist")
    """Whether a bent wrist is less probable. It trades off with bent fingers, and a silhouette shows little of it."""


class _Loss(Parameters, group=LOSS):
    """When a hand is lost."""

    highest_misfit: float = parameter(0.35, "Highest misfit", within=(0.05, 2, 0.05), useful=(0.05, 1))
    """Share of the silhouette's area by which the best hand may differ from it; one that differs by more is wrong."""
    lost_after_frames: int = parameter(
        3, "Lost after", unit="frames", within=(1, 100, 1), useful=(1, 20), role="memory"
    )
    """After so many such frames in a row the tracker waits for an open hand."""
    patience_frames: int = parameter(5, "Patience", unit="frames", within=(0, 100, 1), useful=(0, 30), role="memory")
    """Number of frames without a hand for which the last pose is kept to continue from."""


FIT = {
    "palm_fit_sd": 2,
    "tip_sd_px": 3.5,
    "hidden_fit_sd": 2.5,
    "axis_sd_px": 2.5,
    "hidden_cost": 2,
    "joint_cost": 1.5,
    "cover_sd": 0.04,
}
"""How well parts of the hand must fit the silhouette, as old recipes name it."""


class HandTrackerParameters(_Search, _Motion, _Loss, SilhouetteParameters, group=RANKING, constants=FIT):
    """Candidates, how they are weighed against the silhouette, and how whole hands are ranked."""

    scoring: Literal["points", "cells", "reference"] = parameter("points", "Scoring")
    """Whether a candidate is judged as a point, by Gaussians of fixed widths, or for its cell of angles, by their mean
    over it (Shimada 1997, eq. 2.9). Or as in the reference implementation: as a point, with the prior of one
    prediction, not their sum, protrusions that end at tips and last joints only, and no test of reach."""
    ranking: Literal["refined", "reference"] = parameter("refined", "Ranking", trackers=BEAM)
    """Whether the best hands are brought nearer to the silhouette before they are compared with it, or are compared as
    the search's steps left them."""
    cover_term: bool = parameter(True, "Whole silhouettes")
    """Whether the best hands are drawn and compared with the silhouette as wholes."""
    lost_share: float = loss_share(0.3)
    shown_hypothesis: int = parameter(1, "Shown hypothesis", within=(1, MOST_KEPT, 1), group="Drawing", role="drawing")
    """Which of the hands that are kept is drawn, the most probable first."""


SWEEPS = 3
"""Number of hill-climbing passes over the numbers of a pose."""
MIDDLE_JOINT, LAST_JOINT = 1, 2
"""Places along a finger, from the root 0 to the tip 3."""
WRIST_SD_PX = 2.0
"""Deviation of the wrist from its measured place, for a palm axis of 52 px."""
STEP_AREA_PX2 = 90.0
"""Area of the silhouette that one step of a candidate's angle changes, for a palm axis of 52 px."""
TILT = 3
"""The palm's angle b in a pose."""
TURN_SD, TILT_SD, SPREAD_SD, STRAIGHT_SD = 0.06, 0.1, 0.08, 0.15
"""Standard deviations, rad: of the palm's angles a and c, of its angle b out of the picture's plane, and of a finger's
spread, each from the prediction; and of the wrist's flexion c from 0."""
PALM_COUNT = 20
"""Number of the best palms whose fingers are searched."""
COVER_SD = 0.04
"""Difference of a right hand from the silhouette, as a share of the silhouette's area."""
TIP_SD_PX, AXIS_SD_PX = 3.5, 2.5
"""Deviation of a finger's tip from that of its protrusion, and of its axis once the tips coincide, for a palm axis of
52 px."""
PALM_FIT_SD, HIDDEN_FIT_SD = 2.0, 2.5
"""Scales of the mean protrusion length of a palm, and of a finger without a protrusion, in fiftieths of the palm
axis."""
STILL_COST, HIDDEN_COST, JOINT_COST = 0.7, 2.0, 1.5
"""Penalties, in natural logarithms, of a pose that stays as it was, of a finger without a protrusion, and of a
protrusion that ends at a finger's last joint."""


class Settings(NamedTuple):
    """Steps, standard deviations and costs; areas in px^2, distances in px, angles in rad.

    Attributes:
        step_area: S_c.
        flexion_sd: Flexion of fingers.
        straight_sd: Deviation of c from 0; infinite if it does not count.
        wrist_sd: Deviation of the wrist from its measured place.
        palm_count: Number of palms whose fingers are searched.
        tip_sd: Distance of a tip.
        axis_sd: Mean distance of axes.
        unit: Length of the palm axis relative to that for which costs of lengths are given.
        cover_sd: Difference of a right hand as a share of the silhouette's area; infinite if it does not count.
        cells: Whether likelihoods are means over the cells of candidates.
        reference: Whether a hand's prior is that of one prediction, not the sum over all; protrusions end at tips and
            last joints only; and palms are taken whose fingers do not reach all protrusions.
        growth_sd: Relative change of the hand's size per frame; 0 if the size is fixed.
        sweeps: How often each number of a pose is moved uphill before hands are ranked.
    """

    step_area: float
    flexion_sd: float
    straight_sd: float
    wrist_sd: float
    palm_count: int
    tip_sd: float
    axis_sd: float
    unit: float
    cover_sd: float
    cells: bool
    reference: bool
    growth_sd: float
    sweeps: int


class Task(NamedTuple):
    """A hand to find, and the settings of the search.

    Attributes:
        scale: Length of its palm axis, px.
        shape: Shape of the hand.
        settings: Steps, standard deviations and costs.
    """

    scale: float
    shape: HandShape
    settings: Settings


@lru_cache(maxsize=64)
def settings(parameters: HandTrackerParameters, scale: float) -> Settings:
    """Return the settings for a palm axis of a length, px."""
    unit = scale / NOMINAL_SCALE_PX
    return Settings(
        step_area=STEP_AREA_PX2 * unit * unit,
        flexion_sd=float(parameters.flexion_sd_rad),
        straight_sd=STRAIGHT_SD if parameters.wrist_prior else math.inf,
        wrist_sd=WRIST_SD_PX * unit,
        palm_count=PALM_COUNT,
        tip_sd=TIP_SD_PX * unit,
        axis_sd=AXIS_SD_PX * unit,
        unit=unit,
        cover_sd=COVER_SD if parameters.cover_term else math.inf,
        cells=parameters.scoring == "cells",
        reference=parameters.scoring == "reference",
        growth_sd=float(parameters.growth_sd),
        sweeps=SWEEPS if parameters.ranking == "refined" else 0,
    )


# Every kept hand makes predictions with its own probability. A hand may come from any of them, so its prior is the sum
# over all predictions (Shimada 1997, eq. 2.13), each a Gaussian (eqs. 2.4 and 2.12):
#
#     P_b(q) = sum_i P_f(q_i) N(q; q_i, Lambda).
#
# So two predictions that agree count more than a single one. Alternatively, each hand gets only the share of the
# prediction near which it was searched.


class Predictions(NamedTuple):
    """Predictions of hands.

    Attributes:
        poses: (I, 25).
        log_weights: (I,) logarithms of P_f, up to a constant.
    """

    poses: Floats
    log_weights: Floats


@compiled
def palm_log_shares(pose: Floats, predictions: Predictions) -> Floats:
    """Return what each prediction gives to the prior of a palm (I,), as logarithms: three angles of a pose (25,)."""
    shares = np.empty(predictions.poses.shape[0])
    for i in range(shares.shape[0]):
        shares[i] = predictions.log_weights[i] - 0.5 * _palm_square(pose, predictions.poses[i])
    return shares


@compiled
def log_shares(pose: Floats, predictions: Predictions, settings: Settings) -> Floats:
    """Return what each prediction gives to the prior of a whole hand (I,), as logarithms up to a constant.

    A finger's flexion is the mean of its three joints, which bend alike.

    Args:
        pose: (25,).
        predictions: I predictions.
        settings: Standard deviations.
    """
    shares = np.empty(predictions.poses.shape[0])
    for i in range(shares.shape[0]):
        predicted = predictions.poses[i]
        square = _palm_square(pose, predicted)
        for j in range(2):
            off = (pose[j] - predicted[j]) / settings.wrist_sd
            square += off * off
        for at in range(5, ANGLES, 4):
            turn, bent = (pose[at] - predicted[at]) / SPREAD_SD, 0.0
            for j in range(at + 1, at + 4):
                bent += (pose[j] - predicted[j]) / (3.0 * settings.flexion_sd)
            square += turn * turn + bent * bent
        shares[i] = predictions.log_weights[i] - 0.5 * square
    return shares


@compiled
def log_prior(shares: Floats, origin: int, reference: bool) -> float:
    """Return the log prior of a hand from shares (I,): of all predictions (eq. 2.13), or of the nearest one."""
    return float(shares[origin] if reference else normalise(shares)[1])


@compiled
def _palm_square(pose: Floats, predicted: Floats) -> float:
    square = 0.0
    for j in range(2, 5):
        off = (pose[j] - predicted[j]) / (TILT_SD if j == TILT else TURN_SD)
        square += off * off
    return square


@dataclass(frozen=True, eq=False)
class HandState:
    """The posterior of one frame, immutable; both trackers use the same type, so a run can switch trackers.

    Attributes:
        beam: Poses (25,) with weights and parents, the best first.
        origins: (K, 25) pose of each one's parent in the frame before, which predicts motion.
        shape: Shape of the hand to find.
        scale: Length of its palm axis, px.
        wrist_offset: (2,) offset of the measured wrist from that of the model, along x and y of the forearm, px.
        fit: (K,) difference of each pose's silhouette, as a share of the silhouette's area; NaN if not compared.
        protrusions: Number of visible protrusions.
        finding: The problem with the silhouette, a sentence; empty without a problem.
        waited: Number of frames since then.
        misfits: Number of consecutive frames without a fitting hand.
        lost: Whether the tracker waits for an open hand.
        searching: Whether the hand is lost, and searched as an open one.
        particles: (N, 25) of the particle filter; None if there is only a beam.
        log_evidence: Up to the constant that the likelihood leaves out.
    """

    beam: Beam[Floats]
    origins: Floats
    shape: HandShape
    scale: float
    wrist_offset: Floats
    fit: Floats
    protrusions: int = 0
    finding: str = ""
    waited: int = 0
    misfits: int = 0
    lost: bool = False
    searching: bool = False
    particles: ParticleSet | None = None
    log_evidence: float = 0.0

    @property
    def pose(self) -> Floats:
        """(25,) the most probable pose."""
        return self.beam.members[self.beam.best]

    @cached_property
    def tips(self) -> Floats:
        """(K, 15) column, row and height above the wrist of the five finger tips of every pose, px."""
        places = [joints(pose, self.scale, self.shape)[:, 3].ravel() for pose in self.beam.members]
        return np.array(places)

    @property
    def estimate(self) -> Floats:
        """(15,) the finger tips of the most probable pose, px: a mean of several poses would not be a valid pose."""
        best: Floats = self.tips[self.beam.best]
        return best

    @property
    def sigma(self) -> Floats:
        """(15,) distances of the kept poses' tips from these, root of the weighted mean square, px."""
        squares = np.square(self.tips - self.estimate)
        found: Floats = np.sqrt((self.beam.weights[:, None] * squares).sum(axis=0))
        return found

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return poses, log weights and parents of the beam, or of the particles if there are any."""
        found: dict[str, NDArray[Any]] = {
            "poses": np.array(self.beam.members),
            "log_weights": self.beam.log_weights,
            "parents": self.beam.parents,
        }
        if self.particles is not None:
            found |= {"particles": self.particles.states, "particle_log_weights": self.particles.log_weights}
        return found


NO_FINGER = "no finger is seen beside the palm: a fist, or fingers before it"

SERIES = tuple(read_reported(Path(__file__).parent).values())
"""Series that both trackers report."""


def measure(state: HandState) -> Mapping[str, SeriesValue]:
    """Report the kept hands, the best one's angles and fit, and the particles if there are any."""
    beam = state.beam
    poses, weights = np.array(beam.members), beam.weights
    palms = np.rad2deg(poses[:, 2:5])
    sd = np.sqrt((weights[:, None] * np.square(palms - palms[beam.best])).sum(axis=0))
    flexion = np.rad2deg(state.pose[5:].reshape(5, 4)[:, 1:].mean(axis=1))
    hands = Hypotheses(
        tuple(map(tuple, poses.tolist())), tuple((weights / weights.sum()).tolist()), tuple(beam.parents.tolist())
    )
    values: dict[str, SeriesValue] = {
        "hands": hands,
        "palm": tuple(palms[beam.best].tolist()),
        "palm_sd": tuple(sd.tolist()),
        "flexion": tuple(flexion.tolist()),
        "difference": 100.0 * float(state.fit[beam.best]),
        # Turned out of the picture's plane the other way, a hand has nearly the same silhouette.
        "mirror_gap": float(2.0 * abs(state.pose[TILT]) / TILT_SD),
        "protrusions": float(state.protrusions),
        "searching": float(state.searching),
    }
    return values if state.particles is None else {**values, **reports.cloud(state.particles, resampled=True)}
