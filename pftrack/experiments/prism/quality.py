"""What is said of the error of the prism's pose, and how probable it is that the pose is lost.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit prism` fits the probability of a
loss and writes `loss_probability.json`.
"""

import math
from pathlib import Path

from pftrack.core.model.band import Calibration, Miscalibration
from pftrack.experiments.prism.trackers import TRACKERS
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration
from pftrack.experiments.shared.pose.drawing import BANDS, PUBLISHED

FAULTS = (
    PUBLISHED,
    Miscalibration(("alpha-0",), {"pose_band": ("calibrated",)}, {"noise_px": (0, 10)}, direction="underconfident"),
    Miscalibration(("rb-pf",), ranges={"noise_px": (0, 1)}),
    Miscalibration(("pf-asd", "alpha-1", "rb-pf"), ranges={"noise_px": (20, math.inf)}),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("bando", "noise"))

SCENES = Scenes(
    {
        "speed": (0.5, 4.0),
        "noise_px": (0.5, 8.0),
        "yaw_amplitude_deg": (20.0, 60.0),
        "pitch_amplitude_deg": (5.0, 40.0),
    },
    {"sample_count": (5, 10, 25, 50)},
    fitted=60,
    judged=30,
)
"""Slow and fast turns, near to what can be seen and beyond it, measured well and badly."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)
