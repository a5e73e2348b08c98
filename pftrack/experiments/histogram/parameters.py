"""The parameters of the trackers by colour histograms; each field names those that read it."""

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.reports import loss_share, particle_count
from pftrack.experiments.shared.sampling.parameters import (
    SAMPLING,
    SamplingParameters,
    SwitchingParameters,
    gamma,
    gamma_max,
    gamma_min,
    large_process_noise,
    velocity_retention,
)
from pftrack.vision.likelihoods.counting import Space

PARTICLE = ("condensation", "apf", "pc-pf", "h-spf", "s-spf")
"""The trackers with particles."""

MODEL = "Motion model"


class MotionParameters(Parameters):
    """How the target is expected to move."""

    process_noise_px: float = parameter(
        1.5,
        "Process noise",
        "Standard deviation of the noise on the position, each frame and axis.",
        unit="px",
        ge=0.01,
        le=200,
        step=0.1,
        group=MODEL,
        trackers=PARTICLE,
        role="noise",
    )
    velocity_noise_px: float = parameter(
        0.3,
        "Velocity noise",
        "Standard deviation of the noise on the velocity, each frame and axis.",
        unit="px/frame",
        ge=0,
        le=100,
        step=0.05,
        group=MODEL,
        trackers=PARTICLE,
        role="noise",
    )
    velocity_retention: float = velocity_retention(MODEL, PARTICLE)
    large_process_noise_px: float = large_process_noise(MODEL)
    wide_share: float = parameter(
        0,
        "Wide share",
        "Share of the particles that the wide noise moves, for jumps that no velocity foretells.",
        ge=0,
        le=0.5,
        step=0.05,
        group=MODEL,
        trackers=PARTICLE,
    )
    wide_noise_px: float = parameter(
        12,
        "Wide noise",
        "Standard deviation of the noise on the position of that share, each frame and axis.",
        unit="px",
        ge=0.01,
        le=500,
        step=0.5,
        group=MODEL,
        trackers=PARTICLE,
        role="noise",
    )
    follow_camera: bool = parameter(
        False,
        "Follow the camera",
        "Move all places as the whole picture has moved since the last frame, by block matching; the target must not "
        "fill it.",
        group=MODEL,
    )
    initial_velocity_px: float = parameter(
        1,
        "Initial velocity",
        "Standard deviation of the particles' velocities at the start.",
        unit="px/frame",
        ge=0,
        le=100,
        step=0.1,
        live=False,
        group=MODEL,
        trackers=PARTICLE,
    )
    follow_size: bool = parameter(
        False,
        "Follow the size",
        "Let the size of the window be part of the state; switched off, each particle keeps the size it has.",
        group=MODEL,
        trackers=PARTICLE,
    )
    size_noise: float = parameter(
        0.02,
        "Size noise",
        "Standard deviation of the noise on the logarithm of the size, each frame, while it is followed.",
        ge=0,
        le=1,
        step=0.005,
        group=MODEL,
        trackers=PARTICLE,
        role="noise",
    )
    search_reach_px: int = parameter(
        8,
        "Search reach",
        "How far from the last place the greedy search looks, across and down.",
        unit="px",
        ge=1,
        le=64,
        step=1,
        group=MODEL,
        trackers=("greedy",),
    )


COLOUR = "Colour model"
LOSS = "Loss and renewal"
SCORING = "Scoring"


class _Sampling(SamplingParameters):
    """How particles are drawn."""

    sample_count: int = particle_count(300, group=SAMPLING, trackers=PARTICLE)


class _Switching(SwitchingParameters):
    """When another sampler, or another process noise, is used: about where the cloud is once its target is hidden."""

    gamma_px: float = gamma(6)
    gamma_min_px: float = gamma_min(5)
    gamma_max_px: float = gamma_max(12)


class _Colour(Parameters):
    """What the target looks like, and how sharply particles are weighed by that."""

    sharpness: float = parameter(
        20,
        "Sharpness lambda",
        "How much a frame is trusted: the likelihood is exp(-lambda (1 - rho)) of the likeness rho.",
        ge=0,
        le=1000,
        step=1,
        group=COLOUR,
        trackers=PARTICLE,
        role="sharpness",
    )
    colour_space: Space = parameter(
        "hsv",
        "Colour space",
        "What the histogram counts: hue and saturation, the a and b of Lab, or the shares of red and green; all count "
        "pixels without a colour by their brightness.",
        group=COLOUR,
    )
    spatial_kernel: bool = parameter(
        False,
        "Weigh the middle",
        "Count pixels in the middle of the window more than those near its edge, by Epanechnikov's kernel.",
        group=COLOUR,
    )
    parts_across: int = parameter(
        1,
        "Parts across",
        "Into how many columns of parts the window is divided, each with a histogram of its own.",
        ge=1,
        le=4,
        step=1,
        group=COLOUR,
    )
    parts_down: int = parameter(
        1,
        "Parts down",
        "Into how many rows of parts the window is divided.",
        ge=1,
        le=6,
        step=1,
        group=COLOUR,
    )
    weigh_background: bool = parameter(
        False,
        "Weigh against the background",
        "Count colours less that were also around the target in the first picture.",
        group=COLOUR,
    )
    surround_contrast: float = parameter(
        0,
        "Contrast",
        "How much likeness it costs if a window stands out from its surroundings less than the first one did.",
        ge=0,
        le=2,
        step=0.05,
        group=COLOUR,
    )
    window_width_px: float = parameter(
        25,
        "Window width",
        "Width of the window around a particle, rounded to an odd number.",
        unit="px",
        ge=1,
        le=1025,
        step=2,
        live=False,
        group=COLOUR,
    )
    window_height_px: float = parameter(
        33,
        "Window height",
        "Height of the window around a particle, rounded to an odd number.",
        unit="px",
        ge=1,
        le=1025,
        step=2,
        live=False,
        group=COLOUR,
    )


class _Loss(Parameters):
    """When the target counts as lost by the tracker's own account, and when its model is renewed."""

    find_again: bool = parameter(
        False,
        "Find again",
        "Take the target for lost when the window at the estimate looks too little like the model for several frames, "
        "and look for it all over the picture.",
        group=LOSS,
    )
    lost_likeness: float = parameter(
        0.6, "Lost below", "Likeness rho below which the estimate misses.", ge=0, le=1, step=0.01, group=LOSS
    )
    lost_after_frames: int = parameter(
        8,
        "Lost after",
        "How many frames in a row have to miss before the target counts as lost.",
        unit="frames",
        ge=1,
        le=1000,
        step=1,
        group=LOSS,
        role="memory",
    )
    found_likeness: float = parameter(
        0.85,
        "Found above",
        "Likeness rho from which on a place in the picture is taken for the lost target.",
        ge=0,
        le=1,
        step=0.01,
        group=LOSS,
    )
    renewal_rate: float = parameter(
        0,
        "Renewal",
        "Share of the model that a frame replaces by what is seen at the estimate; 0 keeps the first look for ever.",
        ge=0,
        le=1,
        step=0.01,
        group=LOSS,
    )
    renewal_likeness: float = parameter(
        0.85, "Renew above", "Likeness rho below which a frame renews nothing.", ge=0, le=1, step=0.01, group=LOSS
    )
    renewal_spread: float = parameter(
        0.5,
        "Renew within",
        "A frame renews nothing while a standard deviation of the position is above this share of half the window.",
        ge=0,
        le=10,
        step=0.05,
        group=LOSS,
    )


class _Scoring(Parameters):
    """What counts as success."""

    lost_radii: float = parameter(
        0.875,
        "Success region",
        "The target counts as lost when the estimate is this many halves of its longer side away, or further.",
        unit="half sides",
        ge=0.1,
        le=20,
        step=0.025,
        group=SCORING,
    )
    lost_share: float = loss_share(0, group=SCORING)


class HistogramTrackerParameters(_Scoring, _Loss, _Colour, MotionParameters, _Switching, _Sampling):
    """Everything that can be turned on the trackers by colour histograms."""
