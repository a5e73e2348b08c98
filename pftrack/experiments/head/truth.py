"""Truth for recordings of heads: a table of poses, one a frame.

Its columns are `frame, yaw_deg, pitch_deg, roll_deg`, with the signs of `geometry.gaze`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np

from pftrack.core.model.frame import Target
from pftrack.core.numerics.angles import wrap
from pftrack.sources.truth import Form, TruthKind, read_table
from pftrack.vision.geometry.gaze import theta_of

__all__ = ["POSES", "PoseTable", "read_poses"]

POSE_FORM = Form(("frame", "yaw_deg", "pitch_deg", "roll_deg"), "pose", "poses", 360.0, "degrees")


@dataclass(frozen=True)
class PoseTable:
    """The true poses of a clip.

    Attributes:
        poses: Yaw, pitch and roll in degrees by frame number; a frame without truth is missing.
        warnings: What was passed over in reading, one sentence each.
        zero: Frame whose pose counts as none: what is estimated is relative to a frame, and so is the truth.
    """

    poses: Mapping[int, tuple[float, float, float]]
    warnings: tuple[str, ...] = field(default=())
    zero: int | None = None

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The poses."""
        return self.poses

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame, its pose less that of frame `zero`, or None where there is no truth."""
        pose = self.poses.get(frame)
        if pose is None:
            return None
        first = (0.0, 0.0, 0.0) if self.zero is None else self.poses[self.zero]
        return Target(position=theta_of(wrap(np.deg2rad(np.subtract(pose, first)))))


def read_poses(path: Path) -> PoseTable:
    """Read a table of true poses.

    Args:
        path: A comma-separated file with the columns frame, yaw_deg, pitch_deg, roll_deg and any others.

    Raises:
        TruthError: The file is missing, is no such table, or a line of it is wrong.
    """
    rows, warnings = read_table(path, POSE_FORM)
    poses = {frame: (yaw, pitch, roll) for frame, (yaw, pitch, roll) in rows.items()}
    return PoseTable(MappingProxyType(poses), warnings)


POSES = TruthKind(POSE_FORM, read_poses, PoseTable)
