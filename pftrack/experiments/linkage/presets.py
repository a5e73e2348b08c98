"""Starting points that show something of chains."""

from collections.abc import Mapping
from pathlib import Path

from pftrack.core.model.parameters import Value
from pftrack.core.model.preset import Preset, read_failures, read_presets
from pftrack.experiments.linkage.parameters import TABLE_4_1

CROSS: Mapping[str, Value] = {
    "chain_path": "cross",
    "true_length_1_px": 60,
    "true_length_2_px": 48,
    "true_length_3_px": 42,
    "start_angle_rad": 0.2,
    "start_length_1_px": 5,
    "start_length_2_px": 6,
    "start_length_3_px": 9,
    "start_angle_bound_rad": 0.2,
    "motion_bound_rad": 0.08,
    **TABLE_4_1,
}
"""The third link passes the pose parallel to the image; bounds of Shimada 1997, table 4.1. What regions are promised of
beginning and motion holds of this scene."""

STATIC: Mapping[str, Value] = {
    "chain_path": "static",
    "start_angle_rad": 0.05,
    "start_length_1_px": 4,
    "start_length_2_px": 4,
    "start_length_3_px": 8,
    "start_angle_variance_rad2": 0.01,
    "start_length_variance_px2": 100,
    "start_rate_variance_rad2": 1e-4,
    "acceleration_rad": 0.01,
    "observation_variance_px2": 1,
}
"""The pose is held for 300 frames; bounds of Shimada 1997, table 5.1."""

SPACE: Mapping[str, Value] = {
    "chain_path": "3d",
    "true_length_1_px": 68,
    "true_length_2_px": 58,
    "true_length_3_px": 48,
    "measurement_noise_px": 0.1666,
    "start_angle_rad": 0.08,
    "observation_variance_px2": 0.04,
    "linearisations": 2,
    "motion_bound_rad": 0.04,
    "error_bound_px": 0.5,
    "start_angle_bound_rad": 0.08,
    "start_length_bound_px": 15,
}
"""A chain that turns and moves in space, measured so well that filters linearised once become too sure of lengths."""

MIRROR_3: Mapping[str, Value] = {"chain_path": "mirror3"}
"""The third link passes the pose parallel to the image, more slowly than on the path `cross`."""

MIRROR_2: Mapping[str, Value] = {"chain_path": "mirror2", "motion_bound_rad": 0.1}
"""The second link does."""

FIRST: Mapping[str, Value] = {
    "chain_path": "two",
    "true_length_1_px": 65,
    "true_length_2_px": 55,
    "true_length_3_px": 45,
    "motion_bound_rad": 0.08,
}
"""Object 1 of Shimada 1997, table 5.2, that is known as table 5.3 says."""

SECOND: Mapping[str, Value] = {**FIRST, "true_length_1_px": 75, "true_length_2_px": 65, "true_length_3_px": 55}
"""Object 2 of table 5.2, known beforehand by the same."""


def _preset(
    name: str,
    title: str,
    tracker: str,
    scene: Mapping[str, Value],
    about: tuple[str, ...],
    watch: str,
    **values: Value,
) -> Preset:
    return Preset(name, title, tracker, {**scene, **values}, about=about, watch=watch, scene=tuple(scene))


PRESETS = read_presets(Path(__file__).with_name("presets.yaml"))

# Two ways in which a single Gaussian goes wrong about a chain of links, and what helps.

FAILURES = read_failures(Path(__file__).with_name("failures.yaml"))
