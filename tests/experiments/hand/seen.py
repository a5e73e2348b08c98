"""Pictures of a hand whose pose is known."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.hand.likelihood import PictureTables, tables_of
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource
from pftrack.experiments.hand.shape import MODEL, joints, silhouette

SCALE, SIDE = 52.0, 200


def simulated(index: int = 0, seed: int = 0, **values: object) -> Any:
    """Return a frame of the simulated hand."""
    parameters = revise(HandSceneParameters(), values)
    return HandSource(seed, parameters).frame(index, History(((0, parameters),)))


def axis(joints_px: NDArray[np.float64], length: float = np.inf) -> NDArray[np.float64]:
    """Return points 1 px apart along the joints (4, 3) of a finger, from its tip on."""
    places = joints_px[::-1, :2]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    steps = np.arange(min(length, along[-1]))
    return np.column_stack([np.interp(steps, along, places[:, i]) for i in range(2)])


def sight(
    pose: NDArray[np.float64], *more: NDArray[np.float64], fingers: tuple[int, ...] = (0, 1, 2, 3, 4), length: int = 40
) -> PictureTables:
    """Return the tables of a pose: its silhouette, with the ends of these fingers and some more as protrusions."""
    axes = [axis(joints(pose, SCALE, MODEL)[finger], length) for finger in fingers]
    return tables_of(silhouette(pose, SCALE, MODEL, (SIDE, SIDE)), [*axes, *more])
