"""All that can be set on the trackers of a hand; areas and distances are those of a palm axis of 52 px."""

from typing import Literal

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.hand.detection.silhouette import SilhouetteParameters
from pftrack.experiments.shared.parameters import loss_share, particle_count

__all__ = ["NOMINAL_SCALE_PX", "HandTrackerParameters"]

NOMINAL_SCALE_PX = 52.0
"""Length of the palm axis for which areas and distances are given; those in px grow with it, areas with its square."""

MOST_KEPT = 16
"""Hands from frame to frame."""

BEAM, PARTICLES = ("beam",), ("particles",)
KEPT, CANDIDATES, MOTION, FIT, RANKING = "Beam", "Candidates", "Motion", "Fit", "Ranking"
LOSS = "Loss"


class _Search(Parameters):
    """What is tried, and how much of it is kept."""

    beam_width: int = parameter(
        4,
        "Hands kept",
        "How many different hands are kept from frame to frame.",
        ge=1,
        le=MOST_KEPT,
        step=1,
        group=KEPT,
        trackers=BEAM,
    )
    palm_count: int = parameter(
        20,
        "Palms tried",
        "For how many of the best palms fingers are looked for.",
        ge=1,
        le=100,
        step=1,
        group=CANDIDATES,
        trackers=BEAM,
    )
    step_area_px2: float = parameter(
        90,
        "Step area",
        "How much of the silhouette one step of a candidate's angle changes, for a palm axis of 52 px.",
        unit="px²",
        ge=10,
        le=1000,
        step=10,
        group=CANDIDATES,
        trackers=BEAM,
    )
    sample_count: int = particle_count(100, group=CANDIDATES, trackers=PARTICLES)


class _Motion(Parameters):
    """How far a hand may be from where it was expected."""

    palm_turn_sd_rad: float = parameter(
        0.06,
        "Palm in the picture",
        "Standard deviation of the palm's angles a and c from the prediction.",
        unit="rad",
        ge=0.005,
        le=1,
        step=0.005,
        group=MOTION,
        role="noise",
    )
    palm_tilt_sd_rad: float = parameter(
        0.10,
        "Palm about the forearm",
        "Standard deviation of the palm's angle b from the prediction.",
        unit="rad",
        ge=0.005,
        le=1,
        step=0.005,
        group=MOTION,
        role="noise",
    )
    flexion_sd_rad: float = parameter(
        0.35,
        "Bending of fingers",
        "Standard deviation of a finger's flexion from the prediction.",
        unit="rad",
        ge=0.01,
        le=2,
        step=0.01,
        group=MOTION,
        role="noise",
    )
    spread_sd_rad: float = parameter(
        0.08,
        "Spreading of fingers",
        "Standard deviation of a finger's spread from the prediction.",
        unit="rad",
        ge=0.005,
        le=1,
        step=0.005,
        group=MOTION,
        role="noise",
    )
    growth_sd: float = parameter(
        0,
        "Change of size",
        "By which share a hand that comes nearer or goes away may grow or shrink from frame to frame; 0 if it stays as "
        "far. It trades off with tilts, and needs the refined ranking.",
        ge=0,
        le=0.1,
        step=0.005,
        group=MOTION,
        trackers=BEAM,
    )
    still_penalty: float = parameter(
        0.7,
        "Price of standing still",
        "By how much less probable, in natural logarithms, the pose of before is as a prediction than one moved on.",
        ge=0,
        le=10,
        step=0.1,
        group=MOTION,
        trackers=BEAM,
    )
    wrist_prior: bool = parameter(
        True,
        "Straight wrist",
        "Whether a bent wrist is less probable. It trades off with bent fingers, and a silhouette shows little of it.",
        group=MOTION,
    )
    wrist_sd_rad: float = parameter(
        0.15,
        "Bending of the wrist",
        "Standard deviation of the wrist's flexion c from 0.",
        unit="rad",
        ge=0.01,
        le=2,
        step=0.01,
        group=MOTION,
        role="noise",
    )


class _Fit(Parameters):
    """How well parts of the hand must fit the silhouette."""

    palm_fit_sd: float = parameter(
        2,
        "Palm fit",
        "Standard deviation of a palm's mean protrusion length, in fiftieths of the palm axis.",
        ge=0.1,
        le=20,
        step=0.1,
        group=FIT,
        role="sharpness",
    )
    hidden_fit_sd: float = parameter(
        2.5,
        "Fit of hidden fingers",
        "The same for a finger that no protrusion shows.",
        ge=0.1,
        le=20,
        step=0.1,
        group=FIT,
        role="sharpness",
    )
    tip_sd_px: float = parameter(
        3.5,
        "Fit of tips",
        "Standard deviation of a finger's tip from that of its protrusion, for a palm axis of 52 px.",
        unit="px",
        ge=0.1,
        le=50,
        step=0.1,
        group=FIT,
        role="sharpness",
    )
    axis_sd_px: float = parameter(
        2.5,
        "Fit of axes",
        "Standard deviation of a finger's axis from that of its protrusion once the tips coincide, for 52 px.",
        unit="px",
        ge=0.1,
        le=50,
        step=0.1,
        group=FIT,
        role="sharpness",
    )
    hidden_cost: float = parameter(
        2,
        "Price of a hidden finger",
        "By how much less probable, in natural logarithms, it is that no protrusion shows a finger.",
        ge=0,
        le=20,
        step=0.1,
        group=FIT,
    )
    joint_cost: float = parameter(
        1.5,
        "Price of a hidden tip",
        "By how much less probable it is that the end of a protrusion is a finger's last joint rather than its tip.",
        ge=0,
        le=20,
        step=0.1,
        group=FIT,
    )


class _Loss(Parameters):
    """When a hand is lost."""

    highest_misfit: float = parameter(
        0.35,
        "Highest misfit",
        "Share of the silhouette's area by which the best hand may differ from it; one that differs by more is wrong.",
        ge=0.05,
        le=2,
        step=0.05,
        group=LOSS,
    )
    lost_after_frames: int = parameter(
        3,
        "Lost after",
        "After so many such frames in a row the tracker waits for an open hand.",
        unit="frames",
        ge=1,
        le=100,
        step=1,
        group=LOSS,
        role="memory",
    )
    patience_frames: int = parameter(
        5,
        "Patience",
        "For how many frames without a hand in the picture the last pose is kept to go on from.",
        unit="frames",
        ge=0,
        le=100,
        step=1,
        group=LOSS,
        role="memory",
    )


class HandTrackerParameters(_Search, _Motion, _Fit, _Loss, SilhouetteParameters):
    """Candidates, how they are weighed against the silhouette, and how whole hands are ranked."""

    scoring: Literal["points", "cells", "reference"] = parameter(
        "points",
        "Scoring",
        "Whether a candidate is judged as a point, by Gaussians of fixed widths, or for its cell of angles, by their "
        "mean over it (Shimada 1997, eq. 2.9). Or as in the reference implementation: as a point, with the prior of "
        "one prediction, not their sum, protrusions that end at tips and last joints only, and no test of reach.",
        group=RANKING,
    )
    ranking: Literal["refined", "reference"] = parameter(
        "refined",
        "Ranking",
        "Whether the best hands are brought nearer to the silhouette before they are compared with it, or are compared "
        "as the search's steps left them.",
        group=RANKING,
        trackers=BEAM,
    )
    cover_term: bool = parameter(
        True,
        "Whole silhouettes",
        "Whether the best hands are drawn and compared with the silhouette as wholes.",
        group=RANKING,
    )
    cover_sd: float = parameter(
        0.04,
        "Fit of whole silhouettes",
        "Share of the silhouette's area by which a right hand may differ from it.",
        ge=0.005,
        le=1,
        step=0.005,
        group=RANKING,
        role="sharpness",
    )
    lost_share: float = loss_share(0.3, group=RANKING)
    shown_hypothesis: int = parameter(
        1,
        "Shown hypothesis",
        "Which of the hands that are kept is drawn, the most probable first.",
        ge=1,
        le=MOST_KEPT,
        step=1,
        group="Drawing",
        role="drawing",
    )
