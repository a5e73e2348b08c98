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
        ("pf-asd", "alpha-0"),
        "The calibrated band was chosen for faces that are not known exactly. With the person's own face it is too "
        "narrow: the bands of 50 and 95 % hold the true angle in 39 to 41 and 90 to 91 % of the reports.",
        {"pose_band": ("calibrated",), "face_model": ("personal",)},
    ),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("personal", "mean"), scene="person", frames=60)
