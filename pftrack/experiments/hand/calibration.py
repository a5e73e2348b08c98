"""What is said of the error of finger tips, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.core.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    Miscalibration(
        ("beam", "particles"),
        "The deviation that is told is how far apart the kept hands are. They are the best few of many that were "
        "tried, and much alike: bands of 95 % hold a tip in 31 to 47 % of the reports.",
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("wrist", "bend"))
