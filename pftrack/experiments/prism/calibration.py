"""What is said of the error of its pose, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.experiments.pose.calibration import BANDS, PUBLISHED
from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    PUBLISHED,
    Miscalibration(
        ("alpha-0",),
        "With features only, the points are worse than the solid makes them elsewhere, and the misfit counts their "
        "errors as lasting, which they are not: the band of 50 % holds the true angle in 64 to 73 % of the reports.",
        {"pose_band": ("calibrated",)},
        {"noise_px": (0, 10)},
        direction="underconfident",
    ),
    Miscalibration(
        ("rb-pf",),
        "The calibrated band was chosen for PF-ASD. Points that are particles of one joint cloud are off together, "
        "which no misfit shows: the band of 95 % holds the true angle in 88 % of the reports.",
        ranges={"noise_px": (0, 1)},
    ),
    Miscalibration(
        ("pf-asd", "alpha-1", "rb-pf"),
        "With noise of 50 px the features lose their points, and what the solid predicts keeps them together all the "
        "same, so that no misfit shows it: bands of 95 % hold the true angle in 30 to 84 % of the reports.",
        ranges={"noise_px": (20, math.inf)},
    ),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("bando", "noise"))
