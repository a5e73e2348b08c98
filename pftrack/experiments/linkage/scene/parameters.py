"""What can be turned in the simulated scene of a chain."""

from typing import Literal

from pftrack.core.model.parameters import parameter
from pftrack.experiments.linkage.scene.paths import PathName
from pftrack.sources.overlay import OccluderParameters

__all__ = ["LinkageSceneParameters"]

CHAIN, PATH, MEASUREMENTS, START = "Chain", "Path of its own", "Measurements", "Where the estimate begins"


class LinkageSceneParameters(OccluderParameters):
    """The scene: the chain, how it moves, how its points are measured, and where the estimate begins."""

    # fmt: off
    chain_path: PathName = parameter(
        "mirror3", "Path", "How the joints move; the links of 3d move in space, those of all others in a plane.",
        live=False, group=CHAIN)
    path_slowing: int = parameter(
        1, "Slower by", "How many times as long the chain takes for its path; its run has as many frames more.",
        ge=1, le=20, step=1, live=False, group=CHAIN)
    true_length_1_px: float = parameter(
        70, "First link", "True length of the link at the root.",
        unit="px", ge=10, le=120, step=1, live=False, group=CHAIN)
    true_length_2_px: float = parameter(
        60, "Second link", "True length of the middle link.",
        unit="px", ge=10, le=120, step=1, live=False, group=CHAIN)
    true_length_3_px: float = parameter(
        50, "Third link", "True length of the link at the tip.",
        unit="px", ge=10, le=120, step=1, live=False, group=CHAIN)
    from_1_deg: float = parameter(
        40, "First angle from", "Where the first joint begins on a path of its own.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    from_2_deg: float = parameter(
        30, "Second angle from", "Where the second joint begins on it.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    from_3_deg: float = parameter(
        20, "Third angle from", "Where the third joint begins on it.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    to_1_deg: float = parameter(
        70, "First angle to", "Where the first joint turns back.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    to_2_deg: float = parameter(
        60, "Second angle to", "Where the second joint turns back.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    to_3_deg: float = parameter(
        60, "Third angle to", "Where the third joint turns back.",
        unit="°", ge=-180, le=180, step=1, live=False, group=PATH)
    swing_frames: int = parameter(
        50, "Swing", "Frames from one end of a path of its own to the other.",
        unit="frames", ge=2, le=300, step=1, live=False, group=PATH)
    measurement_noise_px: float = parameter(
        1, "Noise", "Standard deviation of a measured coordinate.",
        unit="px", ge=0, le=10, step=0.1, group=MEASUREMENTS, role="world")
    bounded_noise: bool = parameter(
        True, "Bounded noise", "Whether noise beyond three standard deviations is drawn again, as bounds of it assume.",
        group=MEASUREMENTS)
    links_seen_as: Literal["points", "lines", "lines-and-ends"] = parameter(
        "points", "Links seen as",
        "What is measured in space: root, joints and tip; or the line on which each link lies, without its ends; or "
        "the lines, and root and tip. The image of a chain in the plane has one coordinate, and no lines.",
        live=False, group=MEASUREMENTS)
    outlier_share: float = parameter(
        0, "Outliers", "Share of the measured points that are far off.",
        ge=0, le=0.5, step=0.01, group=MEASUREMENTS, role="world")
    outlier_px: float = parameter(
        40, "Size of outliers", "How far off such a point is at most; it is uniform.",
        unit="px", ge=0, le=200, step=5, group=MEASUREMENTS)
    start_angle_rad: float = parameter(
        0, "Angles off by", "How far each angle is off at first, at most; it is uniform.",
        unit="rad", ge=0, le=0.5, step=0.01, live=False, group=START)
    start_length_1_px: float = parameter(
        0, "First length off by", "By how much the first link is taken too long at first.",
        unit="px", ge=-30, le=30, step=1, live=False, group=START)
    start_length_2_px: float = parameter(
        0, "Second length off by", "By how much the second link is taken too long at first.",
        unit="px", ge=-30, le=30, step=1, live=False, group=START)
    start_length_3_px: float = parameter(
        0, "Third length off by", "By how much the third link is taken too long at first.",
        unit="px", ge=-30, le=30, step=1, live=False, group=START)
    # fmt: on
