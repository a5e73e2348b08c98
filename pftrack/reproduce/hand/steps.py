"""How much of a silhouette a step of a finger's angle changes: by the integral that sets the step, and measured.

The integral of eq. 2.3 is compared with what becomes of the finger's own pixels when the angle is turned a little. It
leaves out the disc at the finger's root, which is why it is a little low; the reference allows 20 %.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import fill
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, parts
from pftrack.experiments.hand.trackers.candidates import chain_rate
from pftrack.reproduce.finding import PROTOCOL, Finding, compare
from pftrack.reproduce.pool import Pool

__all__ = ["steps"]

SCALE_PX, TURN_RAD = 312.0, 0.03
SIDE_PX = 1000
SOURCE = "Shimada 1997, eq. 2.3; reference implementation"
MIDDLE = 2
BENT = 0.3
"""Of every joint of the finger: a straight one that faces the camera hardly moves in the picture as it bends."""


def steps(pool: Pool, full: bool) -> list[Finding]:
    """The rate of change of a middle finger's silhouette as it is spread and bent, facing the camera and turned."""
    del pool, full
    findings = []
    for view, turned in (("facing the camera", 0.0), ("turned by 1 rad", 1.0)):
        pose = open_pose((0.5 * SIDE_PX, 0.75 * SIDE_PX))
        pose[3] = turned
        pose[6 + 4 * MIDDLE : 9 + 4 * MIDDLE] = BENT
        for way, angle in (("spread", 5 + 4 * MIDDLE), ("bent", 6 + 4 * MIDDLE)):
            ratio = _predict(pose, angle) / _measure(pose, angle)
            what = f"hand: step of a finger that is {way}, {view}, predicted by measured change"
            findings.append(compare(what, ratio, 1.0, 0.2, SOURCE, ground=PROTOCOL))
    return findings


def _predict(pose: NDArray[np.float64], angle: int) -> float:
    """Return D of the middle finger for a turn of one angle, px^2/rad."""
    small, moved = 1e-6, pose.copy()
    moved[angle] += small
    before, after = (joints(one, SCALE_PX, MODEL)[MIDDLE] for one in (pose, moved))
    return float(chain_rate(before, (after - before) / small, SCALE_PX * MODEL.radii[MIDDLE, 3]))


def _measure(pose: NDArray[np.float64], angle: int) -> float:
    """Return how many of the finger's pixels come or go with a turn, px^2/rad."""
    masks = []
    for sign in (-0.5, 0.5):
        moved = pose.copy()
        moved[angle] += sign * TURN_RAD
        corners, counts = parts(moved, SCALE_PX, MODEL)
        own = slice(2 + 3 * MIDDLE, 5 + 3 * MIDDLE)
        masks.append(fill(corners[own], counts[own], SIDE_PX, SIDE_PX))
    return float(np.count_nonzero(masks[0] != masks[1])) / TURN_RAD
