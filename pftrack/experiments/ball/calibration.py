"""What is said of the error of a ball's place, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

WIDTH = "occlusion_width_px"

AS_WIDE_AS_THE_BALL = (
    "A particle is weighed by the one pixel under it, so that all places on the ball are alike: the band is as wide as "
    "the ball, and the one of 50 % holds its middle in 82 to 99 % of the reports."
)
GONE_BEHIND = (
    "Behind a pillar as wide as this many runs lose the ball and do not notice, so that they are sure of a wrong "
    "place: bands of 95 % hold the truth in {} of the reports."
)

FAULTS = (
    Miscalibration(("h-spf", "s-spf"), AS_WIDE_AS_THE_BALL, ranges={WIDTH: (0, 50)}, direction="underconfident"),
    Miscalibration(("apf",), AS_WIDE_AS_THE_BALL, ranges={WIDTH: (0, 90)}, direction="underconfident"),
    Miscalibration(
        ("condensation", "upf", "pc-pf"), AS_WIDE_AS_THE_BALL, ranges={WIDTH: (0, 0)}, direction="underconfident"
    ),
    Miscalibration(("guided",), AS_WIDE_AS_THE_BALL, {"ball_path": ("swings",)}, direction="underconfident"),
    Miscalibration(("h-spf", "s-spf"), GONE_BEHIND.format("33 to 83 %"), ranges={WIDTH: (70, math.inf)}),
    Miscalibration(("apf",), GONE_BEHIND.format("60 %"), ranges={WIDTH: (100, math.inf)}),
    Miscalibration(("condensation", "upf", "pc-pf"), GONE_BEHIND.format("33 to 93 %"), ranges={WIDTH: (30, math.inf)}),
    Miscalibration(
        ("kalman",),
        "It takes the middle of all that looks like the ball for a measurement whose error is the same in each frame "
        "and independent of the last: what is seen of a half hidden ball is not its middle, and where it turns, the "
        "estimate lags behind for many frames. The band of 95 % holds the truth in 45 to 71 % of the reports.",
    ),
    Miscalibration(
        ("guided",),
        "What it has learned is how the ball swings: where it bounces, particles are led astray, and the band of 95 % "
        "holds the truth in 60 % of the reports.",
        {"ball_path": ("bounces",)},
    ),
)

CALIBRATION = Calibration(faults=FAULTS, presets=("too-wide", "bounces"))
