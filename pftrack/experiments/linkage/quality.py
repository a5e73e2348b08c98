"""What is said of the error of lengths and directions, and how probable it is that the pose of the chain is lost.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit linkage` fits the probability of
a loss and writes `loss_probability.json`.
"""

import math
from pathlib import Path

from pftrack.core.model.band import ALL, MOST, Calibration, DeviationBand, FlagBand, IntervalBand, Miscalibration
from pftrack.experiments.linkage.set_trackers import TRACKERS as SETS
from pftrack.experiments.linkage.trackers import TRACKERS
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration

LINKS = (1, 2, 3)
LENGTHS = tuple(f"length_{link}" for link in LINKS)
DIRECTIONS = tuple(f"direction_{link}" for link in LINKS)
TRUE_LENGTHS, TRUE_DIRECTIONS = (tuple(f"true_{name}" for name in names) for names in (LENGTHS, DIRECTIONS))

REGIONS = tuple(SETS)
"""Trackers that promise to hold the truth always."""

BANDS = (
    FlagBand("all that is possible", {ALL: "contained"}, REGIONS),
    IntervalBand("possible lengths", LENGTHS, TRUE_LENGTHS, ALL, REGIONS),
    IntervalBand("lengths", LENGTHS, TRUE_LENGTHS, MOST, tuple(name for name in TRACKERS if name not in SETS)),
    DeviationBand("directions", DIRECTIONS, tuple(f"{name}_sd" for name in DIRECTIONS), TRUE_DIRECTIONS),
)

FAULTS = (
    Miscalibration(("ekf-mirrors", "ekf-truncated", "ekf", "ukf")),
    *(
        Miscalibration(("particles",), {"chain_path": ("cross",)}, {"true_length_1_px": far_off})
        for far_off in ((0, 50), (70, math.inf))
    ),
    Miscalibration(("particles",), {"noise_unknown": (False,)}),
    Miscalibration(("particles",), {"chain_path": ("two", "3d", None)}),
    Miscalibration(("particles",), {"chain_path": ("static",)}, direction="underconfident"),
    Miscalibration(("particles",), {"chain_path": ("mirror3",)}, bands=("directions",)),
    Miscalibration(REGIONS, bands=("directions",), direction="underconfident"),
)
"""None stands for a recording, which is of a chain in space and has no path."""

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("cross", "static"))

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
