"""The parameters of how a window is expected to move, and a camera with it."""

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.shared.sampling.parameters import large_process_noise, velocity_retention

__all__ = ["PARTICLE", "MotionParameters"]

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
