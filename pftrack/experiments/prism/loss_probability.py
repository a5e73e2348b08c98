"""How probable it is that the prism's pose is lost.

`python -m tools.loss_probability fit prism` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.prism.trackers import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

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
