"""The parameters of the trackers by colour histograms; each class names those that read its fields."""

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.reports import (
    SAMPLING,
    SWITCHING,
    SamplingParameters,
    SwitchingParameters,
    gamma,
    gamma_max,
    gamma_min,
    large_process_noise,
    loss_share,
    particle_count,
    velocity_retention,
)
from pftrack.vision.likelihoods.counting import Space

PARTICLE = ("condensation", "apf", "pc-pf", "h-spf", "s-spf")
"""The trackers with particles."""

MODEL = "Motion model"


class MotionParameters(Parameters, group=MODEL, trackers=PARTICLE):
    """How the target is expected to move."""

    process_noise_px: float = parameter(
        1.5, "Process noise", unit="px", within=(0.01, 200, 0.1), useful=(0.1, 15), role="noise"
    )
    """Standard deviation of the noise on the position, each frame and axis."""
    velocity_noise_px: float = parameter(
        0.3, "Velocity noise", unit="px/frame", within=(0, 100, 0.05), useful=(0, 5), role="noise"
    )
    """Standard deviation of the noise on the velocity, each frame and axis."""
    velocity_retention: float = velocity_retention()
    large_process_noise_px: float = large_process_noise()
    wide_share: float = parameter(0, "Wide share", within=(0, 0.5, 0.05))
    """Share of the particles that the wide noise moves, for jumps that no velocity foretells."""
    wide_noise_px: float = parameter(
        12, "Wide noise", unit="px", within=(0.01, 500, 0.5), useful=(0.5, 60), role="noise"
    )
    """Standard deviation of the noise on the position of that share, each frame and axis."""
    follow_camera: bool = parameter(False, "Follow the camera", trackers=())
    """Move all places as the whole picture has moved since the last frame, by block matching; the target must not fill
    it."""
    initial_velocity_px: float = parameter(
        1, "Initial velocity", unit="px/frame", within=(0, 100, 0.1), useful=(0, 10), live=False
    )
    """Standard deviation of the particles' velocities at the start."""
    follow_size: bool = parameter(False, "Follow the size")
    """Let the size of the window be part of the state; switched off, each particle keeps the size it has."""
    size_noise: float = parameter(0.02, "Size noise", within=(0, 1, 0.005), useful=(0, 0.1), role="noise")
    """Standard deviation of the noise on the logarithm of the size, each frame, while it is followed."""
    search_reach_px: int = parameter(
        8, "Search reach", unit="px", within=(1, 64, 1), useful=(1, 32), trackers=("greedy",)
    )
    """Reach of the greedy search from the last place, across and down."""


COLOUR = "Colour model"
LOSS = "Loss and renewal"
SCORING = "Scoring"


class _Sampling(SamplingParameters, group=SAMPLING, trackers=PARTICLE):
    """How particles are drawn."""

    sample_count: int = particle_count(300)


class _Switching(SwitchingParameters, group=SWITCHING):
    """When another sampler, or another process noise, is used: about where the cloud is once its target is hidden."""

    gamma_px: float = gamma(6)
    gamma_min_px: float = gamma_min(5)
    gamma_max_px: float = gamma_max(12)


class _Colour(Parameters, group=COLOUR):
    """What the target looks like, and how sharply particles are weighed by that."""

    sharpness: float = parameter(
        20, "Sharpness lambda", within=(0, 1000, 1), useful=(0, 200), trackers=PARTICLE, role="sharpness"
    )
    """How much a frame is trusted: the likelihood is exp(-lambda (1 - rho)) of the likeness rho."""
    colour_space: Space = parameter("hsv", "Colour space")
    """Colours that the histogram counts: hue and saturation, the a and b of Lab, or the shares of red and green; each
    counts pixels without a colour by their brightness."""
    spatial_kernel: bool = parameter(False, "Weigh the middle")
    """Count pixels in the middle of the window more than those near its edge, by Epanechnikov's kernel."""
    parts_across: int = parameter(1, "Parts across", within=(1, 4, 1))
    """Number of columns of parts of the window, each with its own histogram."""
    parts_down: int = parameter(1, "Parts down", within=(1, 6, 1))
    """Number of rows of parts of the window."""
    weigh_background: bool = parameter(False, "Weigh against the background")
    """Count colours less that were also around the target in the first picture."""
    surround_contrast: float = parameter(0, "Contrast", within=(0, 2, 0.05))
    """Similarity lost by a window that stands out from its surroundings less than the first one."""
    cells_share: float = parameter(0, "Cells", within=(0, 1, 0.05), trackers=PARTICLE)
    """Weight of edges and colours in 8 x 8 cells relative to the histogram; they are learned from frame to frame."""
    window_width_px: float = parameter(25, "Window width", unit="px", within=(1, 1025, 2), useful=(5, 101), live=False)
    """Width of the window around a particle, rounded to an odd number."""
    window_height_px: float = parameter(
        33, "Window height", unit="px", within=(1, 1025, 2), useful=(5, 101), live=False
    )
    """Height of the window around a particle, rounded to an odd number."""


class _Loss(Parameters, group=LOSS):
    """When the target counts as lost by the tracker's own account, and when its model is renewed."""

    search_share: float = parameter(0, "Search share", within=(0, 1, 0.05), trackers=PARTICLE)
    """Share of the particles that look for a lost target at the likeliest places of the whole picture; with 1 the
    tracker begins again where it finds its target."""
    lost_likeness: float = parameter(0.6, "Lost below", within=(0, 1, 0.01))
    """Likeness rho below which the estimate misses; with cells, share of the usual score of both."""
    lost_after_frames: int = parameter(
        8, "Lost after", unit="frames", within=(1, 1000, 1), useful=(1, 60), role="memory"
    )
    """Number of consecutive missed frames after which the target counts as lost; a share below 1 looks as often."""
    found_likeness: float = parameter(0.85, "Found above", within=(0, 1, 0.01))
    """The same from which on a place in the picture is taken for the lost target."""
    renewal_rate: float = parameter(0, "Renewal", within=(0, 1, 0.01), useful=(0, 0.2))
    """Share of the model that a frame replaces by what is seen at the estimate; 0 keeps the first look for ever."""
    renewal_likeness: float = parameter(0.85, "Renew above", within=(0, 1, 0.01))
    """Likeness rho below which a frame renews nothing."""
    renewal_spread: float = parameter(0.5, "Renew within", within=(0, 10, 0.05))
    """A frame renews nothing while a standard deviation of the position is above this share of half the window."""


class ScoringParameters(Parameters, group=SCORING):
    """What counts as success."""

    lost_radii: float = parameter(0.875, "Success region", unit="half sides", within=(0.1, 20, 0.025), useful=(0.25, 3))
    """The target counts as lost when the estimate is this many halves of its longer side away, or further."""
    lost_share: float = loss_share(0)


class HistogramTrackerParameters(_Loss, _Colour, MotionParameters, _Switching, _Sampling):
    """Everything that can be turned on the trackers by colour histograms."""
