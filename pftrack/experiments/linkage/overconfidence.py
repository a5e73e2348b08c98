"""Settings in which the range of a length is not to be believed (docs/explanation/calibration.md)."""

from pftrack.model.overconfidence import Overconfidence

__all__ = ["OVERCONFIDENT"]

OVERCONFIDENT = (
    Overconfidence(
        ("ekf-mirrors", "ekf-truncated", "ekf", "ukf"),
        "This filter takes motion and noise as known and linearises about its own estimate, so that it becomes too "
        "sure of lengths: over the presets its ranges of 95 % hold the true length in 11 to 98 % of the frames.",
    ),
    Overconfidence(
        ("particles",),
        "Each particle has one Gaussian for the pose, which is not enough where links pass the parallel to the image "
        "again and again: ranges of 95 % hold the true length in 50 % of the frames.",
        {"chain_path": ("two",)},
    ),
    Overconfidence(
        ("particles",),
        "Where lengths are drawn anywhere within bounds as wide as here, ranges of 95 % hold the true length in 81 % "
        "of the frames; with the lengths of the preset they hold it in 94 %.",
        {"chain_path": ("cross",)},
    ),
    Overconfidence(
        ("particles",),
        "Motion and noise are taken as given: where they are smaller, a filter takes that for a sign that a link is "
        "parallel to the image. In the default scene ranges of 95 % hold the true length in half of the frames.",
        {"noise_unknown": (False,)},
    ),
    Overconfidence(
        ("particles",),
        "In space the particles do not reach all lengths that are possible in the first frames: ranges of 95 % hold "
        "the true length in 80 % of the frames.",
        {"chain_path": ("3d", None)},
    ),
)
"""None stands for a recording, which is of a chain in space and has no path."""
