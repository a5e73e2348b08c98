"""How near to the truth the kept hands are: of one frame, and of a whole run (docs/methods/hands.md).

A hand is *right* if its tips are off by less than 0.20 palm axes on average, every angle of the palm by less than 0.30
rad, and the flexions of the fingers by less than 0.30 rad on average. The most probable hand of a frame may be right,
or any of those that are kept; and once the last frame is known, the hand of each frame from which the last best comes.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.frame import Frame
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import finger_slice
from pftrack.experiments.hand.trackers.state import HandState
from pftrack.filters.beam import backtrack

__all__ = ["SERIES", "Errors", "is_mirrored", "measure", "report"]

RIGHT_TIPS_PALMS, RIGHT_PALM_RAD, RIGHT_FLEXION_RAD = 0.20, 0.30, 0.30
OFF_PALMS, MUCH_NEARER = 0.3, 0.5
FLEXIONS = np.concatenate([np.arange(25)[finger_slice(finger)][1:] for finger in range(5)])
PALM = slice(2, 5)

SERIES = (
    Series(
        "tip_error",
        "mean distance of the tips in the picture",
        "palm axes",
        reductions=(Reduction("tip_error_palms", "tip error", "mean"),),
    ),
    Series(
        "palm_error_rad",
        "largest error of the palm's angles",
        "rad",
        reductions=(Reduction("palm_error", "error of the palm", "mean"),),
    ),
    Series(
        "flexion_error_rad",
        "mean error of the flexions",
        "rad",
        reductions=(Reduction("flexion_error", "error of the flexions", "mean"),),
    ),
    Series(
        "best_right",
        "the best hand is right",
        role="flag",
        reductions=(Reduction("best_right_share", "best is right", "mean"),),
    ),
    Series(
        "any_right",
        "a kept hand is right",
        role="flag",
        reductions=(Reduction("any_right_share", "any is right", "mean"),),
    ),
    Series("mirrored", "tips mirrored in depth", role="mirrored"),
    Series("true_tilt", "true tilt of the palm", "rad"),
    Series("hands_right", "which kept hands are right", shape="vector", role="flag"),
)


class Errors(NamedTuple):
    """How far poses are from the truth.

    Attributes:
        tips: (K,) mean distance of the five tips in the picture, palm axes.
        palm: (K,) the largest of the palm's three angles, rad.
        flexion: (K,) mean over the fifteen flexions, rad.
    """

    tips: NDArray[np.float64]
    palm: NDArray[np.float64]
    flexion: NDArray[np.float64]

    @classmethod
    def of(cls, poses: NDArray[np.float64], tips: NDArray[np.float64], target: HandTarget) -> "Errors":
        """Return the errors of poses (K, 25) whose tips (K, 15) are here, px."""
        off = (tips - target.position).reshape(len(tips), 5, 3)
        turned = np.abs(np.remainder(poses[:, PALM] - target.pose[PALM] + np.pi, 2.0 * np.pi) - np.pi)
        return cls(
            np.hypot(off[..., 0], off[..., 1]).mean(axis=1) / target.scale,
            turned.max(axis=1),
            np.abs(poses[:, FLEXIONS] - target.pose[FLEXIONS]).mean(axis=1),
        )

    @property
    def right(self) -> NDArray[np.bool_]:
        """(K,) which of them count as right."""
        return (self.tips < RIGHT_TIPS_PALMS) & (self.palm < RIGHT_PALM_RAD) & (self.flexion < RIGHT_FLEXION_RAD)


def measure(frame: Frame, state: HandState) -> Mapping[str, SeriesValue]:
    """Return the values of the series where the true pose is known."""
    if not isinstance(frame.target, HandTarget):
        return {}
    errors, best = Errors.of(np.array(state.beam.members), state.tips, frame.target), state.beam.best
    right = errors.right.astype(np.float64)
    return {
        "tip_error": float(errors.tips[best]),
        "palm_error_rad": float(errors.palm[best]),
        "flexion_error_rad": float(errors.flexion[best]),
        "best_right": float(right[best]),
        "any_right": float(right.max()),
        "mirrored": float(is_mirrored(state.estimate, frame.target.position, frame.target.scale)),
        "true_tilt": float(frame.target.pose[3]),
        "hands_right": tuple(right.tolist()),
    }


def is_mirrored(believed: NDArray[np.float64], true: NDArray[np.float64], scale: float) -> bool:
    """Whether tips (15,) are off, and much nearer to the true ones mirrored at the wrist's depth: both look alike.

    Tips near that depth are as near to one as to the other.
    """
    tips, truth = believed.reshape(5, 3), true.reshape(5, 3)
    mirror = truth * np.array([1.0, 1.0, -1.0])
    off, mirrored = (np.sqrt(np.square(tips - other).sum(axis=1)).mean() for other in (truth, mirror))
    return bool(off > OFF_PALMS * scale and mirrored < MUCH_NEARER * off)


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Say of a whole run how many frames a second it took, and how often its hands were right once all was known.

    Frame 0, in which a tracker only begins, does not count.
    """
    spent_s = 1e-3 * sum(row.step_ms for row in rows[1:])
    said: dict[str, Any] = {"frames_per_second": (len(rows) - 1) / spent_s if spent_s > 0.0 else None}
    right = [row.vector("hands_right") or () for row in rows]
    hands = [row.hypotheses("hands") for row in rows]
    if len(rows) > 1 and all(right) and None not in hands:
        known = [each for each in hands if each is not None]
        parents = [np.array(each.parents or [-1] * len(each.weights)) for each in known]
        bests = [int(np.argmax(each.weights)) for each in known]
        found = backtrack(parents, bests[-1])
        path = np.where(found < 0, bests, found)  # before a hand that has begun anew stands what was the best one then
        said["backtracked_right_share"] = float(
            np.mean([each[place] for each, place in zip(right, path, strict=True)][1:])
        )
    return said
