"""What is said of the error of its pose, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.core.model.calibration import Calibration, Miscalibration
from pftrack.experiments.shared.pose_calibration import BANDS, PUBLISHED

__all__ = ["CALIBRATION"]

FAULTS = (
    PUBLISHED,
    Miscalibration(
        ("rb-pf",),
        "The calibrated band was chosen for PF-ASD. With the points of a joint cloud of particles it is too narrow: "
        "the band of 95 % holds the true angle in 80 to 90 % of the reports.",
    ),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("personal", "mean"), scene="person", frames=60)
