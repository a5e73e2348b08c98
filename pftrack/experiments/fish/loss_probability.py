"""How probable it is that the fish is lost.

`python -m tools.loss_probability fit fish` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.fish.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "tank_number": (0, 9999),
        "occlusion_width_px": (0.0, 120.0),
        "occlusion_offset_px": (-150.0, 150.0),
        "image_noise": (0, 30),
        "half_length_px": (34.0, 46.0),
    },
    {
        "sample_count": (10, 20, 50, 100, 200),
        "tank": ("goldfish", "goldfish", "strong rudder"),
        "diffusion_scale": (0.5, 1.0, 1.0, 2.0),
        "sigma_d_px2": (10.0, 25.0, 60.0),
    },
    frames=60,
    fitted=80,
    judged=50,
)
"""All tanks, columns of all widths, fish of a size that is known well or badly, few particles and more."""

SIGNALS = ("d_max",)
"""How far the worst point of the outline is from an edge."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)
