"""What compiled code needs of parameters, in px of the hand that is followed."""

import math
from functools import lru_cache
from typing import NamedTuple

from pftrack.experiments.hand.shape import HandShape
from pftrack.experiments.hand.trackers.parameters import NOMINAL_SCALE_PX, HandTrackerParameters

__all__ = ["Settings", "Task", "settings"]

SWEEPS = 3
"""How often each number of a pose is moved uphill."""
MIDDLE_JOINT, LAST_JOINT = 1, 2
"""Of the places along a finger, from the root 0 to the tip 3."""
WRIST_SD_PX = 2.0
"""Of the wrist from where it was seen, for a palm axis of 52 px."""


class Settings(NamedTuple):
    """Steps, standard deviations and costs; areas in px^2, distances in px, angles in rad.

    Attributes:
        step_area: S_c.
        turn_sd: Of the palm's a and c from the prediction.
        tilt_sd: Of its b.
        flexion_sd: Of fingers.
        spread_sd: Of fingers.
        straight_sd: Of c from 0; infinite if that does not count.
        wrist_sd: Of the wrist from where it was seen.
        palm_count: For how many palms fingers are looked for.
        palm_fit_sd: Of x_p of a palm.
        hidden_fit_sd: Of x_p of a hidden finger.
        tip_sd: Of the distance of a tip.
        axis_sd: Of the mean distance of axes.
        hidden_cost: Of a finger that no protrusion shows.
        joint_cost: Of a protrusion that ends at a finger's last joint.
        unit: Length of the palm axis beside that for which costs of lengths are given.
        cover_sd: Share of the silhouette's area by which a right hand differs; infinite if that does not count.
        cells: Whether likelihoods are means over the cells of candidates.
        mixture: Whether a hand's prior is the sum over all predictions.
        lowest_end: Number of the joint nearest to the palm at which a protrusion may end, 3 being the tip.
        reach: Whether palms are refused whose fingers do not reach all protrusions.
        growth_sd: By which share the hand may be seen larger or smaller than in the frame before; 0 if it may not.
        sweeps: How often each number of a pose is moved uphill before hands are ranked.
    """

    step_area: float
    turn_sd: float
    tilt_sd: float
    flexion_sd: float
    spread_sd: float
    straight_sd: float
    wrist_sd: float
    palm_count: int
    palm_fit_sd: float
    hidden_fit_sd: float
    tip_sd: float
    axis_sd: float
    hidden_cost: float
    joint_cost: float
    unit: float
    cover_sd: float
    cells: bool
    mixture: bool
    lowest_end: int
    reach: bool
    growth_sd: float
    sweeps: int


class Task(NamedTuple):
    """A hand that is looked for, and how.

    Attributes:
        scale: Length of its palm axis, px.
        shape: Of the hand.
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
        step_area=parameters.step_area_px2 * unit * unit,
        turn_sd=float(parameters.palm_turn_sd_rad),
        tilt_sd=float(parameters.palm_tilt_sd_rad),
        flexion_sd=float(parameters.flexion_sd_rad),
        spread_sd=float(parameters.spread_sd_rad),
        straight_sd=float(parameters.wrist_sd_rad) if parameters.wrist_prior else math.inf,
        wrist_sd=WRIST_SD_PX * unit,
        palm_count=parameters.palm_count,
        palm_fit_sd=float(parameters.palm_fit_sd),
        hidden_fit_sd=float(parameters.hidden_fit_sd),
        tip_sd=parameters.tip_sd_px * unit,
        axis_sd=parameters.axis_sd_px * unit,
        hidden_cost=float(parameters.hidden_cost),
        joint_cost=float(parameters.joint_cost),
        unit=unit,
        cover_sd=float(parameters.cover_sd) if parameters.cover_term else math.inf,
        cells=parameters.scoring == "cells",
        mixture=parameters.scoring != "reference",
        lowest_end=LAST_JOINT if parameters.scoring == "reference" else MIDDLE_JOINT,
        reach=parameters.scoring != "reference",
        growth_sd=float(parameters.growth_sd),
        sweeps=SWEEPS if parameters.ranking == "refined" else 0,
    )
