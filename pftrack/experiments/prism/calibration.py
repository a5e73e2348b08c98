"""What is said of the error of its pose, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.core.model.calibration import Calibration, Miscalibration
from pftrack.experiments.shared.pose_calibration import BANDS, PUBLISHED

__all__ = ["CALIBRATION"]

FAULTS = (
    PUBLISHED,
    Miscalibration(
        ("alpha-0",),
        "The calibrated band was chosen for PF-ASD. With features only it is wider than the errors: the band of 50 % "
        "holds the true angle in 64 to 73 % of the reports.",
        {"pose_band": ("calibrated",)},
        {"noise_px": (0, 10)},
        direction="underconfident",
    ),
    Miscalibration(
        ("rb-pf",),
        "The calibrated band was chosen for PF-ASD. With the points of a joint cloud of particles it is too narrow: "
        "the band of 95 % holds the true angle in 88 % of the reports.",
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
