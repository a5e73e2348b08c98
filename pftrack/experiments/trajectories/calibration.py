"""What is said of the error of the selected track, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    Miscalibration(
        ("nlng", "lng", "lg"),
        "Errors are of two kinds, small ones and a few outliers. A standard deviation that covers both is too large "
        "for most frames: the band of 50 % holds the truth in 67 to 97 % of the reports, the one of 95 % in 85 to "
        "100 %.",
        direction="underconfident",
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("works", "lattice"))
