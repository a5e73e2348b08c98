"""All that can be set on the trackers of a fish."""

from typing import Literal

from pydantic import field_validator

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.fish.model import Told
from pftrack.experiments.fish.trackers import GUIDANCE
from pftrack.experiments.shared.reports import (
    correlated_changes,
    diffusion_scale,
    learned_motion,
    loss_share,
    particle_count,
)

TRACKERS = ("ordinary", "constant-velocity", "guided")
SAMPLING, LIKELIHOOD, FOREGROUND, SHAPE = "Particles", "Likelihood", "Foreground", "Shape of the fish"
MODES = "Learned motion"


class FishTrackerParameters(Parameters):
    """Particles, how they move and are weighed, what the fish looks like, and which learned mode is shown."""

    sample_count: int = particle_count(500, group=SAMPLING, trackers=TRACKERS)
    walk_steps: Literal["learned", "wide"] = parameter(
        "learned",
        "Random walk",
        "Whether the ordinary filter draws steps with the mean and standard deviation of the fish that were learned "
        "from, or with wide ones that follow whatever happens: that is how tracks to learn from are made.",
        group=SAMPLING,
        trackers=("ordinary",),
    )
    wide_px: float = parameter(
        30,
        "Wide steps",
        "Standard deviation of a wide step along each axis, for a fish of 40 px half length.",
        unit="px",
        ge=0.1,
        le=200,
        step=1,
        group=SAMPLING,
        trackers=("ordinary",),
        role="noise",
    )
    wide_deg: float = parameter(
        45,
        "Wide turns",
        "Standard deviation of a wide turn, and of a wide bend.",
        unit="°",
        ge=0.1,
        le=180,
        step=1,
        group=SAMPLING,
        trackers=("ordinary",),
        role="noise",
    )
    motion_reading: Literal["document", "increments", "world"] = parameter(
        "document",
        "Reading",
        "How the learned acceleration is meant: as published, which counts a turn twice; as increments of "
        "the velocity in the body's frame; or with a velocity that keeps its direction in the picture.",
        group=MODES,
        trackers=("guided",),
    )
    correlated_changes: bool = correlated_changes(trackers=("guided",))
    diffusion_scale: float = diffusion_scale(trackers=TRACKERS)
    learned: str = learned_motion(trackers=TRACKERS)
    shown_mode: int = parameter(
        3,
        "Shown mode",
        "Which of the learned modes the ghost fish shows, the strongest first.",
        ge=1,
        le=4,
        step=1,
        group=MODES,
        role="drawing",
    )
    along_mode: float = parameter(
        2,
        "Along the mode",
        "How far along that mode the ghost fish is, at most if it sways: drag it to see what belongs together.",
        unit="sd",
        ge=-4,
        le=4,
        step=0.1,
        group=MODES,
        role="drawing",
    )
    mode_sways: bool = parameter(
        True,
        "Swaying mode",
        "Whether the ghost fish sways to and fro along the mode as frames go by.",
        group=MODES,
        role="drawing",
    )
    sigma_d_px2: float = parameter(
        25,
        "Edge tolerance",
        "At which square of the distance from the worst point of the outline to an edge the likelihood falls to 1/e.",
        unit="px²",
        ge=0.1,
        le=400,
        step=1,
        group=LIKELIHOOD,
        role="sharpness",
    )
    bend_limited: bool = parameter(
        True,
        "Bend limit",
        "Whether a bend beyond a right angle is impossible. Without the limit a fish turned head to tail, its tail "
        "folded along the body, fits as well.",
        group=LIKELIHOOD,
    )
    foreground: Told = parameter(
        "colour",
        "Told by",
        "How the fish is separated from the rest: by its colour, or by being darker or lighter than what is around it.",
        group=FOREGROUND,
    )
    lowest_hue: int = parameter(
        3,
        "Lowest hue",
        "Of the fish's colour, 0 to 179 round the circle; above the highest hue the range goes through red.",
        ge=0,
        le=179,
        step=1,
        group=FOREGROUND,
    )
    highest_hue: int = parameter(
        22, "Highest hue", "Of the fish's colour, 0 to 179 round the circle.", ge=0, le=179, step=1, group=FOREGROUND
    )
    saturation_low: int = parameter(
        110, "Least saturation", "Of the fish's colour.", ge=0, le=255, step=1, group=FOREGROUND
    )
    value_low: int = parameter(110, "Least brightness", "Of the fish's colour.", ge=0, le=255, step=1, group=FOREGROUND)
    least_contrast: int = parameter(
        25,
        "Least contrast",
        "By how much a dark or light fish differs from the mean around it.",
        unit="grey levels",
        ge=1,
        le=255,
        step=1,
        group=FOREGROUND,
    )
    contrast_radius_px: int = parameter(
        40,
        "Surroundings",
        "Half the side of the square whose mean a dark or light fish is compared with.",
        unit="px",
        ge=1,
        le=200,
        step=1,
        group=FOREGROUND,
    )
    half_length_px: float = parameter(
        40,
        "Half length",
        "Half of the body from head to the root of the tail. What was learned is scaled to it.",
        unit="px",
        ge=2,
        le=400,
        step=0.5,
        group=SHAPE,
    )
    half_width_px: float = parameter(
        15, "Half width", "Half of the body across.", unit="px", ge=1, le=400, step=0.5, group=SHAPE
    )
    tail_length_px: float = parameter(
        40, "Tail length", "From the root of the tail to its tip.", unit="px", ge=0, le=400, step=0.5, group=SHAPE
    )
    lost_share: float = loss_share(0, group="Scoring")

    @field_validator("learned")
    @classmethod
    def _learned(cls, text: str) -> str:
        GUIDANCE.parse(text)
        return text
