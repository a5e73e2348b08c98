"""What is said of the error of a signal, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    Miscalibration(
        ("condensation",),
        "Few particles soon have few ancestors and cling together: with 10 of them the band of 95 % holds the truth in "
        "53 % of the reports, with 50 in 91 %; 100 are enough in one dimension.",
        ranges={"sample_count": (0, 50)},
    ),
    Miscalibration(
        ("condensation",),
        "A hundred particles cannot fill more dimensions: the band of 95 % holds the truth in 83 % of the reports in "
        "two, and in 54 % in five.",
        ranges={"sample_count": (0, 100), "dimension": (2, math.inf)},
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("works", "few"))
