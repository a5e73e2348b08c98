"""What can be turned on the trackers of trajectories."""

from typing import Literal

from pftrack.core.model.parameters import parameter
from pftrack.experiments.trajectories.scene.target import SelectionParameters
from pftrack.filters.trajectories.cloud import MOST_PARTICLES

__all__ = ["LONGEST_LAG", "TrajectoriesTrackerParameters"]

MODEL, PARTICLES, SCORING = "Model", "Particles", "Scoring"
CLOUDS = ("lng", "nlng")

LONGEST_LAG = 50


class TrajectoriesTrackerParameters(SelectionParameters):
    """Everything that trackers of trajectories read."""

    # fmt: off
    noise_variance_px2: float = parameter(
        3, "Measurement noise σ²", "Square of the scale of a measurement's noise; NLNG begins there and finds its own.",
        unit="px²", ge=0.01, le=100, step=0.5, group=MODEL, role="noise")
    drive_variance_px2: float = parameter(
        1, "Freedom of motion τ²", "Variance of the change of velocity in a frame; small is smooth. NLNG begins there.",
        unit="px²", ge=0.0001, le=100, step=0.1, group=MODEL, role="noise")
    lag_frames: int = parameter(
        25, "Smoothing lag", "How many later frames a smoothed position takes into account.",
        unit="frames", ge=0, le=LONGEST_LAG, step=1, group=MODEL, role="smoothing")
    start_spread_px: float = parameter(
        1, "Initial spread", "Standard deviation of the two positions with which a track begins.",
        unit="px", ge=0.1, le=50, step=0.5, live=False, group=MODEL)
    sample_count: int = parameter(
        2000, "Particles", "Number of particles of each track.",
        ge=10, le=MOST_PARTICLES, step=10, group=PARTICLES, trackers=CLOUDS, role="particles", sets=50)
    point_estimate: Literal["mode", "mean"] = parameter(
        "mode", "Estimate", "The fullest place of a histogram in bins of 1 px, or the mean of the particles.",
        group=PARTICLES, trackers=CLOUDS)
    law_drift: float = parameter(
        0, "Drift of σ² and τ²", "What their logarithms may change by in a frame; without, they settle once for all.",
        ge=0, le=0.5, step=0.01, group=PARTICLES, trackers=("nlng",))
    outlier_px: float = parameter(
        5, "Outlier from", "A measurement further from the estimate than this counts as an outlier.",
        unit="px", ge=0.5, le=100, step=0.5, group=SCORING)
    lost_px: float = parameter(
        10, "Lost from", "A track further from its true position than this counts as lost.",
        unit="px", ge=0.5, le=200, step=0.5, group=SCORING)
    lost_frames_share: float = parameter(
        0.02, "Frames that may be lost", "A run is a success if the selected track is lost in no more of its frames.",
        ge=0, le=1, step=0.01, group=SCORING, role="loss_share")
    # fmt: on
