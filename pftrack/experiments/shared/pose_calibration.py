"""What is said of the error of a pose, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.core.model.band import HALF, MOST, FlagBand
from pftrack.core.model.calibration import Miscalibration

__all__ = ["BANDS", "PUBLISHED"]

BANDS = (FlagBand("angles", {HALF: "within_50", MOST: "within_95"}),)

PUBLISHED = Miscalibration(
    ("pf-asd", "alpha-1", "alpha-0", "rb-pf"),
    "Bando's filters take each point's error for independent of all others: their bands of 95 % hold the true "
    "angle in 16 to 88 % of the frames. The calibrated band of the pose is honest.",
    {"pose_band": ("document",)},
)
