"""How probable it is that a hand's pose is lost.

`python -m tools.loss_probability fit hand` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.hand.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {"speed": (0.5, 3.0), "turn_deg": (-30.0, 30.0), "proportions": (0.0, 0.1), "edge_noise_px": (0.0, 2.0)},
    {"motion": ("wrist", "bend", "occlusion"), "occlusion_width_px": (0.0, 0.0, 20.0, 40.0)},
    frames=30,
    fitted=140,
    judged=80,
)
"""All motions, slow and fast, of hands of several proportions, some behind a pillar."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)
