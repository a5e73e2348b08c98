"""What is said of the error of a window's place, and where that is not so (docs/explanation/calibration.md)."""

from pftrack.core.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

SAMPLERS = ("condensation", "apf", "h-spf", "s-spf", "pc-pf")

FAULTS = (
    Miscalibration(
        SAMPLERS,
        "The weight exp(-lambda (1 - rho)) is a score of how alike two windows are, and no probability of the picture, "
        "so that the width of the band is set by lambda: the band of 50 % holds the truth in 77 to 85 % of the "
        "reports.",
        ranges={"sharpness": (0, 100)},
        direction="underconfident",
    ),
    Miscalibration(
        SAMPLERS,
        "With so large a lambda, small differences between patches of lawn decide, and the cloud sits on one of them: "
        "the band of 95 % holds the truth in 80 % of the reports.",
        ranges={"sharpness": (150, 1000)},
    ),
    Miscalibration(
        ("greedy",),
        "It keeps one place and no cloud. The deviation that it tells is the rounding to whole pixels, not the error "
        "of the place, and a band of 95 % holds the truth in 18 to 55 % of the reports.",
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("pictures", "look-alike"), scene="scene_number")
