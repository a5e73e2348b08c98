"""What is said of the error of the selected track, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.core.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

FAULTS = (
    Miscalibration(
        ("lng", "lg"),
        "The scale of the noise is given and not found, and has to cover outliers: most errors are far smaller. The "
        "band of 50 % holds the truth in 78 to 97 % of the reports, the one of 95 % in 85 to 100 %.",
        direction="underconfident",
    ),
    Miscalibration(
        ("nlng",),
        "What is believed has heavier tails than a Gaussian, so that its standard deviation is wide for its middle: "
        "the band of 50 % holds the truth in 67 to 91 % of the reports.",
        direction="underconfident",
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("works", "lattice"))
