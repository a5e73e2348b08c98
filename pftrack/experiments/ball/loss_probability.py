"""How probable it is that the ball is lost.

`python -m tools.loss_probability fit ball` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.ball.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "occlusion_width_px": (0.0, 110.0),
        "distracter_radius_px": (1.0, 20.0),
        "layout": (0, 19),
        "period_s": (0.8, 3.0),
        "amplitude_px": (50.0, 120.0),
        "ball_radius_px": (4.0, 9.0),
    },
    {
        "sample_count": (50, 100, 200, 400, 800, 1600),
        "ball_path": ("swings", "swings", "swings", "bounces"),
        "process_noise_px": (2.0, 3.0, 5.0),
        "image_noise_sd": (0.0, 0.0, 0.0, 0.0, 0.0, 10.0),
    },
)
"""Pillars of all widths, look-alikes of all sizes, slow and fast balls, few particles and many."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)
