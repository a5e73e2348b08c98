"""Fingers whose tips are hidden: a protrusion may end at any joint (Shimada 1997, section 2.6.3)."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.experiments.hand.fingers import features_in
from pftrack.experiments.hand.likelihood import PictureTables, finger_fit, tables_of
from pftrack.experiments.hand.model import JOINT_COST, HandTrackerParameters, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.silhouette import Finding, Silhouette

SCALE, SIDE = 52.0, 200
INDEX, TIP = 1, 3
NO_MOVES, NO_IDEALS = np.empty((0, 4, 2)), np.empty(0)


def half_hidden() -> NDArray[np.float64]:
    """Return a pose whose index finger is bent back from its middle joint, which is all that is seen of it."""
    pose = open_pose((100.0, 137.0))
    pose[10:13] = 0.3, 1.75, 1.0
    return pose


def seen_of(pose: NDArray[np.float64]) -> PictureTables:
    mask = silhouette(pose, SCALE, MODEL, (SIDE, SIDE))
    found = features_in(Silhouette(mask, 1, Finding.CLEAR))
    return tables_of(mask, [each.axis for each in found.protrusions])


def test_a_finger_of_which_the_middle_joint_is_seen_fits_its_protrusion() -> None:
    """With all joints as ends it pays the price of a hidden tip and little more; with the last one it is far off."""
    pose, task = half_hidden(), Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
    seen, places = seen_of(pose), joints(pose, SCALE, MODEL)[INDEX]
    assert len(seen.lengths) == 5
    ends = seen.axes[:, 0]
    nearest = int(np.argmin(np.hypot(*(ends - places[1, :2]).T)))
    assert np.hypot(*(ends[nearest] - places[1, :2])) < 3.0
    assert np.hypot(*(ends[nearest] - places[TIP, :2])) > 10.0
    fits = {
        reference: finger_fit(
            places,
            NO_MOVES,
            NO_IDEALS,
            MODEL.radii[INDEX],
            nearest,
            seen,
            task._replace(settings=task.settings._replace(reference=reference)),
            -np.inf,
        )
        for reference in (False, True)
    }
    assert fits[False] == pytest.approx(-JOINT_COST, abs=0.8)
    assert fits[False] > fits[True] + 1.0
