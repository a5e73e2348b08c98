"""What is said of the error of a signal, and where that is not so (docs/explanation/calibration.md)."""

import math

from pftrack.core.model.calibration import Calibration, Miscalibration

__all__ = ["CALIBRATION"]

MODELLED = ("kalman", "condensation")
ASSUMED, LAG = "assumed_noise_share", "kalman_lag"
"""Of `SineParameters`."""

FAULTS = (
    Miscalibration(
        MODELLED,
        "The filter takes the noise to be smaller than it is: at three quarters of it the band of 95 % holds the truth "
        "in 90 % of the reports, at half of it in 70 %, at a quarter in 40 %.",
        ranges={ASSUMED: (0, 0.85)},
    ),
    *(
        Miscalibration(
            MODELLED,
            "The filter takes the noise to be larger than it is: in settings drawn at random the band of 50 % "
            "holds the truth in 40 to 100 % of the reports, half of the time in more than 90 %.",
            {"waveform": waveforms},
            {ASSUMED: (1.15, math.inf), LAG: (0, 1.4), **begun},
            direction="underconfident",
        )
        for waveforms, begun in (
            (("cosine",), {}),
            (("sine",), {"initial_sd": (0.011, math.inf)}),
            (("sine",), {"process_noise_sd": (0.0041, math.inf)}),
        )
    ),
    *(
        Miscalibration(
            MODELLED,
            "For the noise that it assumes the filter has so little process noise that it lags behind where the signal "
            "bends: in half of the settings drawn at random the band of 95 % holds the truth in less than 52 % of the "
            "reports.",
            ranges={ASSUMED: assumed, LAG: (least, math.inf)},
        )
        for assumed, least in (((0, 1.15), 1), ((1.15, math.inf), 1.4))
    ),
    Miscalibration(
        MODELLED,
        "A filter that is certain to begin at rest needs many frames to believe that the sine moves at once: the band "
        "of 95 % holds the truth in 0 to 94 % of the reports.",
        {"waveform": ("sine",)},
        {"initial_sd": (0, 0.01), "process_noise_sd": (0, 0.004)},
    ),
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
