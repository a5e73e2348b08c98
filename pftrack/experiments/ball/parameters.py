"""The parameters that all trackers of a ball share; each class names those that read its fields.

They are declared in parts, so that another family of trackers takes those that it shares: one that follows something
else than a colour, through the same loop, takes `LoopParameters`. A model has the fields of its last base first.
"""

from pathlib import Path
from typing import Literal

from pydantic import field_validator

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.reports import (
    LEARNED_MOTION,
    SAMPLING,
    Resampling,
    SamplingParameters,
    SwitchingParameters,
    correlated_changes,
    diffusion_scale,
    large_process_noise,
    learned_motion,
    loss_share,
    particle_count,
    resampling_threshold,
    velocity_retention,
)
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance

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


class DrawingParameters(SamplingParameters, group=SAMPLING, trackers=PARTICLE):
    """How particles are drawn, which one of the centroid's trackers has as well."""

    sample_count: int = particle_count(800)
    resampling: Resampling = parameter("systematic", "Resampling", "How parents are drawn.", role="resampling")
    resampling_threshold: float = resampling_threshold(trackers=("condensation", "pc-pf", "h-spf", "s-spf", "guided"))


class MotionParameters(Parameters, group=MODEL, trackers=MODELLED):
    """How the target is expected to move."""

    process_noise_px: float = parameter(
        3,
        "Process noise",
        "Standard deviation of what the motion model leaves out, each frame and axis.",
        unit="px",
        within=(0.01, 200, 0.1),
        useful=(0.1, 20),
        role="noise",
    )
    large_process_noise_px: float = large_process_noise()
    velocity_retention: float = velocity_retention()
    assumed_period_frames: float = parameter(
        0,
        "Assumed period",
        "Period of the swing about the middle of the picture that the motion model assumes; 0 assumes none, which is "
        "Bando's rough model.",
        unit="frames",
        within=(0, 10_000, 1),
        useful=(0, 120),
    )
    initial_sd_px: float = parameter(
        1,
        "Initial spread",
        "Standard deviation of the particles around the start.",
        unit="px",
        within=(0, 200, 0.5),
        useful=(0, 20),
        live=False,
        trackers=(),
    )


class LearningParameters(Parameters, group="Learning", trackers=MODELLED):
    """How the motion is learned, and the path looked back at."""

    learn_dynamics: bool = parameter(
        False, "Learn the motion", "Estimate the motion model while tracking, by online EM."
    )
    forgetting: float = parameter(
        0.99,
        "Forgetting",
        "Factor by which learned statistics fade each frame; the memory is about 1 / (1 - factor) frames.",
        within=(0.5, 1, 0.005),
        role="memory",
    )
    warm_up_frames: int = parameter(
        15,
        "Warm-up",
        "Frames to watch before the learned model is used.",
        unit="frames",
        within=(1, 1000, 1),
        useful=(1, 100),
    )
    learning_ridge: float = parameter(
        1e-4, "Ridge", "Pull of the learned model towards the initial one.", within=(0, 1, 1e-4), useful=(0, 0.01)
    )
    largest_spectral_radius: float = parameter(
        1.02, "Stability guard", "A learned model whose spectral radius is larger is refused.", within=(0.5, 2, 0.01)
    )
    smoothing_lag_frames: int = parameter(
        0,
        "Smoothing lag",
        "Frames to look back: the path is drawn as it appears given what was seen since; 0 draws none.",
        unit="frames",
        within=(0, 60, 1),
        group=SAMPLING,
        trackers=PARTICLE,
        role="smoothing",
    )


class ColourParameters(Parameters, group=COLOUR):
    """What the target looks like."""

    measurement_noise_px: float = parameter(
        20,
        "Measurement noise",
        "Standard deviation attributed to the colour centroid as a measurement of the position.",
        unit="px",
        within=(0.1, 1000, 1),
        useful=(1, 60),
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
        within=(0, 1, 0.01),
        role="sharpness",
    )
    colour_model: Literal["redness", "chromaticity"] = parameter(
        "redness", "Colour model", "Compare the share of red alone, as Bando does, or the shares of red and green."
    )
    target_red_share: float = parameter(
        2 / 3, "Share of red", "Mean of R / (R + G + B) on the target.", within=(0, 1, 0.005)
    )
    target_green_share: float = parameter(
        1 / 6, "Share of green", "Mean of G / (R + G + B) on the target.", within=(0, 1, 0.005)
    )
    red_spread: float = parameter(
        0.05,
        "Spread of red",
        "Standard deviation of the share of red.",
        within=(0.001, 1, 0.005),
        useful=(0.005, 0.3),
        role="sharpness",
    )
    green_spread: float = parameter(
        0.05,
        "Spread of green",
        "Standard deviation of the share of green.",
        within=(0.001, 1, 0.005),
        useful=(0.005, 0.3),
        role="sharpness",
    )


class ScoringParameters(Parameters, group=SCORING):
    """What counts as success."""

    lost_radii: float = parameter(
        3,
        "Success region",
        "The target counts as lost when the estimate is further away than this many target radii.",
        unit="radii",
        within=(0.1, 20, 0.1),
        useful=(0.5, 10),
    )
    lost_share: float = loss_share(0.25)


class LoopParameters(LearningParameters, MotionParameters, SwitchingParameters, DrawingParameters):
    """What the trackers of the loop need, whatever they weigh particles by."""


class GuidedParameters(Parameters, group=LEARNED_MOTION, trackers=GUIDED):
    """How the motion was learned from recorded runs."""

    learned: str = learned_motion()
    guided_frame: Literal["fixed", "motion"] = parameter(
        "fixed",
        "Frame of the diffusion",
        "Whether accelerations are drawn along the axes of the picture, or along and across the ball's last motion.",
    )
    diffusion_scale: float = diffusion_scale()
    correlated_changes: bool = correlated_changes()

    @field_validator("learned")
    @classmethod
    def _fits(cls, text: str) -> str:
        GUIDANCE.parse(text)
        return text


class BallTrackerParameters(GuidedParameters, ColourParameters, LoopParameters):
    """Everything that can be turned on the trackers of a ball."""
