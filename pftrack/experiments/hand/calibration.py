"""What is said of the error of finger tips, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    Miscalibration(
        ("beam", "particles"),
        "The deviation that is told is how far apart the kept hands are. They are the best few and much alike, and "
        "what is not known of a hand's proportions shifts all of them together: bands of 95 % hold a tip in 34 to "
        "48 % of the reports.",
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("wrist", "bend"))
