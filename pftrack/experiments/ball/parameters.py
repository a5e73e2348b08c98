"""The parameters that all trackers of a ball share; each field names those that read it.

They are declared in parts, so that another family of trackers takes those that it shares: one that follows something
else than a colour, through the same loop, takes `LoopParameters`. A model has the fields of its last base first.
"""

from pathlib import Path
from typing import Literal

from pydantic import field_validator

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.reports import (
    LEARNED_MOTION,
    correlated_changes,
    diffusion_scale,
    learned_motion,
    loss_share,
    particle_count,
)
from pftrack.experiments.shared.sampling.parameters import (
    SAMPLING,
    Resampling,
    SamplingParameters,
    SwitchingParameters,
    large_process_noise,
    resampling,
    velocity_retention,
)
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.guidance import Guidance

# `learned.json` was learned from ten runs of the scene without a pillar, `pftrack learn ball` with the options
#
#     --tracker h-spf --frames 120 --set occlusion_width_px=0 --set image_noise_sd=10
#     --set sample_count=3000 --set process_noise_px=8

GUIDANCE = Guidance("ball", Chart(place=("u", "v")), Path(__file__).with_name("learned.json").read_text("utf-8"))

PARTICLE = ("condensation", "apf", "upf", "pc-pf", "h-spf", "s-spf", "guided")
MEASURING = ("kalman", "upf")
MODELLED = ("h-spf", "s-spf", "condensation", "apf", "upf", "pc-pf", "kalman")
"""Those that move by the motion model below, rather than as was learned from recorded runs."""
GUIDED = ("guided",)

MODEL = "Motion model"
COLOUR = "Colour model"
SCORING = "Scoring"


class DrawingParameters(SamplingParameters):
    """How particles are drawn, which one of the centroid's trackers has as well."""

    sample_count: int = particle_count(800, group=SAMPLING, trackers=PARTICLE)
    resampling: Resampling = resampling(PARTICLE)


class MotionParameters(Parameters):
    """How the target is expected to move."""

    process_noise_px: float = parameter(
        3,
        "Process noise",
        "Standard deviation of what the motion model leaves out, each frame and axis.",
        unit="px",
        ge=0.01,
        le=200,
        step=0.1,
        group=MODEL,
        trackers=MODELLED,
        role="noise",
    )
    large_process_noise_px: float = large_process_noise(MODEL)
    velocity_retention: float = velocity_retention(MODEL, MODELLED)
    assumed_period_frames: float = parameter(
        0,
        "Assumed period",
        "Period of the swing about the middle of the picture that the motion model assumes; 0 assumes none, which is "
        "Bando's rough model.",
        unit="frames",
        ge=0,
        le=10_000,
        step=1,
        group=MODEL,
        trackers=MODELLED,
    )
    initial_sd_px: float = parameter(
        1,
        "Initial spread",
        "Standard deviation of the particles around the start.",
        unit="px",
        ge=0,
        le=200,
        step=0.5,
        live=False,
        group=MODEL,
    )


class LearningParameters(Parameters):
    """How the motion is learned, and the path looked back at."""

    learn_dynamics: bool = parameter(
        False,
        "Learn the motion",
        "Estimate the motion model while tracking, by online EM.",
        group="Learning",
        trackers=MODELLED,
    )
    forgetting: float = parameter(
        0.99,
        "Forgetting",
        "Factor by which learned statistics fade each frame; the memory is about 1 / (1 - factor) frames.",
        ge=0.5,
        le=1,
        step=0.005,
        group="Learning",
        trackers=MODELLED,
        role="memory",
    )
    warm_up_frames: int = parameter(
        15,
        "Warm-up",
        "Frames to watch before the learned model is used.",
        unit="frames",
        ge=1,
        le=1000,
        step=1,
        group="Learning",
        trackers=MODELLED,
    )
    learning_ridge: float = parameter(
        1e-4,
        "Ridge",
        "Pull of the learned model towards the initial one.",
        ge=0,
        le=1,
        step=1e-4,
        group="Learning",
        trackers=MODELLED,
    )
    largest_spectral_radius: float = parameter(
        1.02,
        "Stability guard",
        "A learned model whose spectral radius is larger is refused.",
        ge=0.5,
        le=2,
        step=0.01,
        group="Learning",
        trackers=MODELLED,
    )
    smoothing_lag_frames: int = parameter(
        0,
        "Smoothing lag",
        "Frames to look back: the path is drawn as it appears given what was seen since; 0 draws none.",
        unit="frames",
        ge=0,
        le=60,
        step=1,
        group=SAMPLING,
        trackers=PARTICLE,
        role="smoothing",
    )


class ColourParameters(Parameters):
    """What the target looks like."""

    measurement_noise_px: float = parameter(
        20,
        "Measurement noise",
        "Standard deviation attributed to the colour centroid as a measurement of the position.",
        unit="px",
        ge=0.1,
        le=1000,
        step=1,
        group=MODEL,
        trackers=MEASURING,
        role="noise",
    )
    recursive_covariance: bool = parameter(
        False,
        "Recursive covariance",
        "Whether the covariance of each particle's unscented filter is handed down from frame to frame, as Bando has "
        "it, or begins anew with the process noise, which holds the ball longer.",
        group=SAMPLING,
        trackers=("upf",),
    )
    background_level: float = parameter(
        0.1,
        "Background level rho",
        "Likelihood of any pixel that is not of the target's colour, relative to one that is.",
        ge=0,
        le=1,
        step=0.01,
        group=COLOUR,
        role="sharpness",
    )
    colour_model: Literal["redness", "chromaticity"] = parameter(
        "redness",
        "Colour model",
        "Compare the share of red alone, as Bando does, or the shares of red and green.",
        group=COLOUR,
    )
    target_red_share: float = parameter(
        2 / 3, "Share of red", "Mean of R / (R + G + B) on the target.", ge=0, le=1, step=0.005, group=COLOUR
    )
    target_green_share: float = parameter(
        1 / 6, "Share of green", "Mean of G / (R + G + B) on the target.", ge=0, le=1, step=0.005, group=COLOUR
    )
    red_spread: float = parameter(
        0.05,
        "Spread of red",
        "Standard deviation of the share of red.",
        ge=0.001,
        le=1,
        step=0.005,
        group=COLOUR,
        role="sharpness",
    )
    green_spread: float = parameter(
        0.05,
        "Spread of green",
        "Standard deviation of the share of green.",
        ge=0.001,
        le=1,
        step=0.005,
        group=COLOUR,
        role="sharpness",
    )


class ScoringParameters(Parameters):
    """What counts as success."""

    lost_radii: float = parameter(
        3,
        "Success region",
        "The target counts as lost when the estimate is further away than this many target radii.",
        unit="radii",
        ge=0.1,
        le=20,
        step=0.1,
        group=SCORING,
    )
    lost_share: float = loss_share(0.25, group=SCORING)


class LoopParameters(LearningParameters, MotionParameters, SwitchingParameters, DrawingParameters):
    """What the trackers of the loop need, whatever they weigh particles by."""


class GuidedParameters(Parameters):
    """How the motion was learned from recorded runs."""

    learned: str = learned_motion(trackers=GUIDED)
    guided_frame: Literal["fixed", "motion"] = parameter(
        "fixed",
        "Frame of the diffusion",
        "Whether accelerations are drawn along the axes of the picture, or along and across the ball's last motion.",
        group=LEARNED_MOTION,
        trackers=GUIDED,
    )
    diffusion_scale: float = diffusion_scale(trackers=GUIDED)
    correlated_changes: bool = correlated_changes(trackers=GUIDED)

    @field_validator("learned")
    @classmethod
    def _fits(cls, text: str) -> str:
        GUIDANCE.parse(text)
        return text


class BallTrackerParameters(GuidedParameters, ScoringParameters, ColourParameters, LoopParameters):
    """Everything that can be turned on the trackers of a ball."""
