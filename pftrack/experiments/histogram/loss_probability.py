"""How probable it is that the window has lost its target.

`python -m tools.loss_probability fit histogram` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.histogram.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "scene_number": (0, 9999),
        "look_alike_red": (0.0, 1.0),
        "occlusion_width_px": (0.0, 90.0),
        "lighting_amplitude": (0.0, 0.4),
    },
    {
        "sample_count": (50, 100, 300, 600),
        "sharpness": (5.0, 10.0, 20.0, 50.0, 100.0),
        "column_colours": ("lawn", "grey"),
        "image_noise_sd": (0.0, 0.0, 4.0),
        "process_noise_px": (1.5, 1.5, 3.0),
    },
    fitted=100,
    judged=60,
)
"""Lawns of all kinds, look-alikes of all shades, columns of all widths, and likelihoods from blunt to sharp."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)
