"""How probable it is that the pose of a head is lost.

`python -m tools.loss_probability fit head` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.head.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "person": (0, 9999),
        "speed": (0.5, 4.0),
        "amplitude": (0.7, 1.5),
        "sun_strength": (0.0, 0.8),
        "image_noise_sd": (0.0, 20.0),
        "pillar_width_px": (0.0, 80.0),
        "pillar_offset_px": (-150.0, 150.0),
    },
    {
        "sample_count": (5, 10, 20, 50),
        "templates": ("relief", "flat"),
        "sunglasses": (False, False, True),
        "image_width_px": (320,),
    },
    frames=80,
    fitted=70,
    judged=40,
    trackers=("pf-asd",),
)
"""Drivers of all faces, who turn slowly and fast, with sunglasses and without, past a pillar, with few particles and
more. The Rao-Blackwellised filter is slow, and is left out."""

SIGNALS = ("correlation", "track_sd_px", "feature_sd_px")
"""How well features fit their templates, and how widely they are spread."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)
