"""How sure a shape's points are said to be, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.core.model.band import HALF, MOST, FlagBand
from pftrack.core.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

WHOLE = (
    "The ellipsoid of a point also says how unsure place, size and rotation of the whole are, which are no errors of "
    "the shape: ellipsoids of 50 % hold the true points in 87 to 99 % of the reports."
)

FAULTS = (
    Miscalibration(
        ("informed", "online", "svd"),
        "The covariance of a point is that of its own noise, as if cameras were known and affine. What is wrong of all "
        "points together, by perspective and by the map from an affine shape to a solid, is not in it: ellipsoids of "
        "95 % hold the true points in 1 to 22 % of the reports.",
    ),
    Miscalibration(
        ("growing",),
        "The first shape comes from a window in which hidden points are far off, and is taken for surer than it is; "
        "what later frames add does not make up for that. Ellipsoids of 95 % hold the true points in 78 % of the "
        "reports.",
        {"tracked_body": ("prism",)},
        {"unseen_noise_px": (100, math.inf)},
    ),
    Miscalibration(
        ("growing",), WHOLE, {"tracked_body": ("prism",)}, {"unseen_noise_px": (0, 30)}, direction="underconfident"
    ),
    Miscalibration(("growing",), WHOLE, {"tracked_body": ("face",)}, direction="underconfident"),
)

CALIBRATION = Calibration(
    bands=(FlagBand("points", {HALF: "within_50", MOST: "within_95"}),),
    faults=FAULTS,
    presets=("person", "burst"),
    scene="body_seed",
)
