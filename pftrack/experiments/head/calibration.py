"""What is said of the error of its pose, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.experiments.pose.calibration import BANDS, PUBLISHED
from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    PUBLISHED,
    Miscalibration(
        ("rb-pf",),
        "The calibrated band was chosen for PF-ASD. With the points of a joint cloud of particles it is too narrow: "
        "the band of 95 % holds the true angle in 75 to 93 % of the reports.",
    ),
    Miscalibration(
        ("alpha-0",),
        "The calibrated band was chosen for PF-ASD. With features only it is wider than the errors: the band of 50 % "
        "holds the true angle in 64 to 66 % of the reports.",
        {"pose_band": ("calibrated",)},
        direction="underconfident",
    ),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("personal", "mean"), scene="person", frames=60)
