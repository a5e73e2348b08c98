"""How probable it is that the selected track is lost.

`python -m tools.loss_probability fit trajectories` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes
from pftrack.experiments.trajectories.trackers.step import TRACKERS

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "selected_track": (0, 53),
        "wall_pitch_px": (7, 16),
        "image_noise_sd": (0.0, 15.0),
        "gain_jump": (0.0, 0.3),
        "gain_jump_share": (0.0, 0.3),
        "scene_speed": (0.5, 2.0),
        "search_reach_px": (6, 20),
    },
    {
        "match_cost": ("difference", "difference", "correlation"),
        "noise_variance_px2": (0.3, 1.0, 3.0, 10.0),
        "drive_variance_px2": (0.1, 1.0, 1.0, 3.0),
        "sample_count": (300, 1000, 2000),
        "template_renewal": (False, False, True),
    },
    frames=50,
    fitted=60,
    judged=30,
)
"""Walls of all pitches, in light that jumps, searched near and far. One track a scene is looked at: a run judges no
more, since its estimate and its truth are that track's."""

SIGNALS = ("track_log_evidence", "outlying")
"""Of the track itself: the log evidence is that of all tracks together."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)
