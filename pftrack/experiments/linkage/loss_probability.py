"""How probable it is that the pose of the chain is lost.

`python -m tools.loss_probability fit linkage` fits it and writes `loss_probability.json`.
"""

from pathlib import Path

from pftrack.experiments.linkage.trackers.step import TRACKERS
from pftrack.experiments.shared.loss_probability.declaration import read_declaration
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = ["LOSS_DECLARATION"]

SCENES = Scenes(
    {
        "measurement_noise_px": (0.0, 3.0),
        "true_length_1_px": (60.0, 80.0),
        "true_length_2_px": (50.0, 70.0),
        "true_length_3_px": (40.0, 60.0),
        "start_angle_rad": (0.0, 0.1),
        "outlier_share": (0.0, 0.05),
    },
    {
        "chain_path": ("mirror3", "cross", "mirror2", "two"),
        "acceleration_rad": (0.01, 0.03, 0.1),
        "observation_variance_px2": (1.0, 5.0, 20.0),
        "motion_bound_rad": (0.03, 0.06, 0.12),
        "error_bound_px": (2.0, 3.0, 6.0),
    },
    frames=120,
    fitted=150,
    judged=80,
    trackers=("ekf-mirrors", "ekf-truncated", "ekf", "ukf", "ellipsoids", "ellipsoids-literal", "box-guides"),
)
"""Links of all lengths that are possible, on four paths that pass a mirror pose, with noise and motion that are assumed
rightly and wrongly. A run of particles takes a hundred times as long as one of the others."""

SIGNALS = (
    "hypotheses",
    "hypothesis_count",
    *(name.format(link) for name in ("direction_{}_sd", "direction_{}", "length_{}") for link in (1, 2, 3)),
)
"""Where a link is nearly parallel to the picture, its mirror image is near, and its length is known well."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)
