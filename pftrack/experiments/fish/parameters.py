"""Parameters of the trackers of a fish."""

from pathlib import Path
from typing import Literal, TypeAlias

from pydantic import field_validator

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.reports import (
    correlated_changes,
    diffusion_scale,
    learned_motion,
    loss_share,
    particle_count,
)
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance

# `learned.json` is written by `pftrack reproduce fish-offline --full --figures FOLDER` from the twenty tracks of clips
# 100 to 109 that the ordinary filter followed with 3,000 particles and wide noise. It intentionally includes the
# estimates' noise as well as the fish's motion; otherwise it would not allow rare, violent turns.

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
"""Numbers of a recorded state: the centre of the body, its heading, and the bend of the tail."""

GUIDANCE = Guidance(
    experiment="fish",
    chart=FISH,
    built_in=Path(__file__).with_name("learned.json").read_text(encoding="utf-8"),
    series="body",
)

Told: TypeAlias = Literal["colour", "dark", "light"]
"""Separation of the body from the rest."""

TRACKERS = ("ordinary", "constant-velocity", "guided")
SAMPLING, LIKELIHOOD, FOREGROUND, SHAPE = "Particles", "Likelihood", "Foreground", "Shape of the fish"
MODES = "Learned motion"


class _Sampling(Parameters, group=SAMPLING, trackers=("ordinary",)):
    """Particles, and how they walk."""

    sample_count: int = particle_count(500, trackers=TRACKERS)
    walk_steps: Literal["learned", "wide"] = parameter("learned", "Random walk")
    """Whether the ordinary filter draws steps with the mean and standard deviation of the fish that were learned from,
    or with wide ones that follow whatever happens: that is how tracks to learn from are made."""
    wide_px: float = parameter(30, "Wide steps", unit="px", within=(0.1, 200, 1), useful=(1, 60), role="noise")
    """Standard deviation of a wide step along each axis, for a fish of 40 px half length."""
    wide_deg: float = parameter(45, "Wide turns", unit="°", within=(0.1, 180, 1), useful=(1, 90), role="noise")
    """Standard deviation of a wide turn, and of a wide bend."""


class _Motion(Parameters, group=MODES):
    """How learned motion is used, and which mode is shown."""

    motion_reading: Literal["document", "increments", "world"] = parameter("document", "Reading", trackers=("guided",))
    """How the learned acceleration is meant: as published, which counts a turn twice; as increments of the velocity in
    the body's frame; or with a velocity that keeps its direction in the picture."""
    correlated_changes: bool = correlated_changes(trackers=("guided",))
    diffusion_scale: float = diffusion_scale(trackers=TRACKERS)
    learned: str = learned_motion(trackers=TRACKERS)
    shown_mode: int = parameter(3, "Shown mode", within=(1, 4, 1), role="drawing")
    """Number of the learned mode that the ghost fish shows, the strongest first."""
    along_mode: float = parameter(2, "Along the mode", unit="sd", within=(-4, 4, 0.1), role="drawing")
    """How far along that mode the ghost fish is, at most if it sways: drag it to see what belongs together."""
    mode_sways: bool = parameter(True, "Swaying mode", role="drawing")
    """Whether the ghost fish sways to and fro along the mode as frames go by."""


class _Likelihood(Parameters, group=LIKELIHOOD):
    """How particles are weighed."""

    sigma_d_px2: float = parameter(
        25, "Edge tolerance", unit="px²", within=(0.1, 400, 1), useful=(1, 100), role="sharpness"
    )
    """At which square of the distance from the worst point of the outline to an edge the likelihood falls to 1/e."""
    bend_limited: bool = parameter(True, "Bend limit")
    """Whether a bend beyond a right angle is impossible. Without the limit a fish turned head to tail, its tail folded
    along the body, fits as well."""


class _Foreground(Parameters, group=FOREGROUND):
    """Separation of the fish from the rest."""

    foreground: Told = parameter("colour", "Told by")
    """How the fish is separated from the rest: by its colour, or by being darker or lighter than what is around it."""
    lowest_hue: int = parameter(3, "Lowest hue", within=(0, 179, 1))
    """Lowest hue of the fish, 0 to 179 round the circle; above the highest hue the range goes through red."""
    highest_hue: int = parameter(22, "Highest hue", within=(0, 179, 1))
    """Highest hue of the fish, 0 to 179 round the circle."""
    saturation_low: int = parameter(110, "Least saturation", within=(0, 255, 1))
    """Least saturation of the fish."""
    value_low: int = parameter(110, "Least brightness", within=(0, 255, 1))
    """Least brightness of the fish."""
    least_contrast: int = parameter(25, "Least contrast", unit="grey levels", within=(1, 255, 1), useful=(1, 100))
    """Difference of a dark or light fish from the mean around it."""
    contrast_radius_px: int = parameter(40, "Surroundings", unit="px", within=(1, 200, 1), useful=(5, 100))
    """Half the side of the square whose mean a dark or light fish is compared with."""


class _Shape(Parameters, group=SHAPE):
    """How large the fish is."""

    half_length_px: float = parameter(40, "Half length", unit="px", within=(2, 400, 0.5), useful=(10, 100))
    """Half of the body from head to the root of the tail. The learned motion is scaled to it."""
    half_width_px: float = parameter(15, "Half width", unit="px", within=(1, 400, 0.5), useful=(4, 40))
    """Half of the width of the body."""
    tail_length_px: float = parameter(40, "Tail length", unit="px", within=(0, 400, 0.5), useful=(0, 100))
    """Length from the root of the tail to its tip."""


class FishTrackerParameters(_Shape, _Foreground, _Likelihood, _Motion, _Sampling, group="Scoring"):
    """Particles, how they move and are weighed, what the fish looks like, and which learned mode is shown."""

    lost_share: float = loss_share(0)

    @field_validator("learned")
    @classmethod
    def _learned(cls, text: str) -> str:
        GUIDANCE.parse(text)
        return text
