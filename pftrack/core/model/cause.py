"""Causes of a loss: the names that failures, rules of diagnosis and studies have in common."""

from typing import Literal, TypeAlias

__all__ = ["CAUSES", "CauseId"]

CauseId: TypeAlias = Literal[
    "sample-impoverishment",
    "overconfident-weights",
    "look-alike-capture",
    "wrong-dynamics",
    "occlusion-longer-than-memory",
    "degenerate-resampling",
    "mirror-pose",
    "shrinking-covariance",
    "template-drift",
    "detector-seized-by-background",
    "target-not-in-the-picture",
    "unclear",
]

CAUSES: dict[CauseId, str] = {
    "sample-impoverishment": "sample impoverishment",
    "overconfident-weights": "overconfident weights",
    "look-alike-capture": "look-alike capture",
    "wrong-dynamics": "wrong dynamics",
    "occlusion-longer-than-memory": "occlusion longer than memory",
    "degenerate-resampling": "degenerate resampling",
    "mirror-pose": "mirror pose",
    "shrinking-covariance": "shrinking covariance",
    "template-drift": "drift of the model",
    "detector-seized-by-background": "seized by the background",
    "target-not-in-the-picture": "target not in the picture",
    "unclear": "unclear",
}
"""What they are called in a sentence."""
