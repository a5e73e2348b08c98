"""A frame as the search sees it: in px of the silhouette's mask, which is smaller than the picture if that is large."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.trigonometry import sines_cosines
from pftrack.experiments.hand.detection.protrusions import HandFeatures
from pftrack.experiments.hand.trackers.likelihood import PictureTables
from pftrack.experiments.hand.trackers.parameters import HandTrackerParameters
from pftrack.experiments.hand.trackers.picture_tables import tables_of
from pftrack.experiments.hand.trackers.settings import Task, settings
from pftrack.experiments.hand.trackers.state import HandState

__all__ = ["View", "fingers", "wrist_offset"]

THICKEST = 0.25
"""Largest radius of a finger, palm axes: twice that of a thumb."""

UNSEEN = 3.0
"""How many times as far from where it is expected a wrist may be that is not seen."""


class View:
    """A frame and the hand that is looked for in it.

    Attributes:
        task: The hand, and how it is looked for.
        seen: What is looked up in the picture.
    """

    def __init__(self, state: HandState, found: HandFeatures, parameters: HandTrackerParameters) -> None:
        """Look at what was found in a frame for the hand of a state."""
        self._found, self._state = found, state
        scale = state.scale / found.silhouette.reduction
        given = settings(parameters, scale)
        if found.wrist is None:
            given = given._replace(wrist_sd=UNSEEN * given.wrist_sd)
        self.task = Task(scale, state.shape, given)
        self.seen: PictureTables = tables_of(found.silhouette.mask, fingers(found, state.scale))

    def into(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses (K, 25) of the picture in px of the mask."""
        moved = poses.copy()
        moved[:, :2] = self._found.silhouette.in_mask(poses[:, :2])
        return moved

    def back(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses (K, 25) of the mask in px of the picture."""
        moved = poses.copy()
        moved[:, :2] = self._found.silhouette.in_picture(poses[:, :2])
        return moved

    def with_wrists(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses (K, 25) of the mask whose wrists are where one is seen, if one is."""
        if self._found.wrist is None:
            return poses
        moved = poses.copy()
        across, up = _forearm(poses[:, 2])
        offset = self._state.wrist_offset / self._found.silhouette.reduction
        moved[:, :2] = self._found.wrist - offset[0] * across - offset[1] * up
        return moved


def fingers(found: HandFeatures, scale: float) -> list[NDArray[np.float64]]:
    """Return the axes (k, 2) of the protrusions that are as thin as fingers, px of the mask; a fist on its arm is none.

    Args:
        found: In a frame.
        scale: Length of the palm axis, px of the picture.
    """
    thickest = THICKEST * scale / found.silhouette.reduction
    return [each.axis for each in found.protrusions if np.sort(each.radii)[len(each.radii) // 2] <= thickest]


def wrist_offset(pose: NDArray[np.float64], found: HandFeatures) -> NDArray[np.float64]:
    """Return how far the wrist that is seen is from that of a pose (25,), (2,) across the forearm and along it, px."""
    if found.wrist is None:
        return np.zeros(2)
    across, up = _forearm(pose[2:3])
    apart = found.silhouette.in_picture(found.wrist) - pose[:2]
    return np.array([(axis[0] * apart).sum() for axis in (across, up)])


def _forearm(turns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit vectors (n, 2) across forearms that are turned by a (n,), and along them to the hand."""
    sines, cosines = sines_cosines(np.ascontiguousarray(turns))
    return np.column_stack([cosines, -sines]), np.column_stack([-sines, -cosines])
