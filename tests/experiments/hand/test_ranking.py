"""How parts and wholes are compared with a silhouette, and moved nearer to it."""

import numpy as np
import pytest

from pftrack.core.geometry import convex_hull, fill
from pftrack.experiments.hand.beams import differences, improve, log_score
from pftrack.experiments.hand.candidates import HIDDEN
from pftrack.experiments.hand.likelihood import contour_of, finger_fit, x_p
from pftrack.experiments.hand.model import HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points
from tests.experiments.hand.seen import SCALE, SIDE, sight

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
POSE = open_pose((100.0, 137.0))
POSE[3] = 0.4
EXPECTED = Predictions(POSE[None], np.zeros(1))
NO_MOVES, NO_IDEALS = np.empty((0, 4, 2)), np.empty(0)


def test_x_p_is_the_area_outside_by_the_contour_inside() -> None:
    """Counted in a drawn mask it is the same."""
    seen = sight(POSE)
    moved = POSE.copy()
    moved[0] += 6.0
    hull = convex_hull(palm_points(moved, SCALE, MODEL))
    drawn = fill(hull[None], np.array([len(hull)]), SIDE, SIDE)
    outside = np.count_nonzero(drawn & ~seen.silhouette)
    touching = np.count_nonzero(drawn & contour_of(seen.silhouette))
    assert x_p(hull, seen, SCALE) == pytest.approx(50.0 * outside / (SCALE * touching))
    assert outside > 50
    assert x_p(convex_hull(palm_points(POSE, SCALE, MODEL)), seen, SCALE) == 0.0


def test_a_finger_along_its_protrusion_fits_wholly() -> None:
    """One that ends 3.5 px beside it loses half, and one whose tip is hidden pays for that alone."""
    seen, places = sight(POSE, fingers=(2,)), joints(POSE, SCALE, MODEL)[2]
    radii = MODEL.radii[2]
    assert finger_fit(places, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -np.inf) == pytest.approx(0.0, abs=1e-3)
    beside = places + np.array([3.5, 0.0, 0.0])
    assert finger_fit(beside, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -np.inf) == pytest.approx(-0.5, abs=1e-3)
    assert finger_fit(beside, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -0.4) == -np.inf
    from_joint = seen._replace(axes=seen.axes[:, 11:], lengths=seen.lengths - 11)
    assert -1.7 < finger_fit(places, NO_MOVES, NO_IDEALS, radii, 0, from_joint, TASK, -np.inf) <= -1.5


def test_a_hidden_finger_within_the_silhouette_pays_its_price_only() -> None:
    """Outside it pays for sticking out as well."""
    seen, places = sight(POSE), joints(POSE, SCALE, MODEL)[2]
    assert finger_fit(places, NO_MOVES, NO_IDEALS, MODEL.radii[2], HIDDEN, seen, TASK, -np.inf) == pytest.approx(
        -2.0, abs=0.05
    )
    assert (
        finger_fit(places - (0.0, 40.0, 0.0), NO_MOVES, NO_IDEALS, MODEL.radii[2], HIDDEN, seen, TASK, -np.inf) < -10.0
    )


def test_moving_uphill_mends_a_pose_that_is_beside() -> None:
    """The score that is returned is that of the pose, though fingers were drawn by themselves; the fit gets better."""
    seen, assignment = sight(POSE), np.arange(5)
    begin = POSE.copy()
    begin[[0, 3, 5, 10, 11, 12]] += 2.0, -0.2, 0.1, 0.2, 0.2, 0.2
    pose, score = improve(begin, 0, EXPECTED, assignment, seen, TASK)
    assert score == pytest.approx(log_score(pose, 0, EXPECTED, assignment, seen, TASK), abs=1e-9)
    assert score > log_score(begin, 0, EXPECTED, assignment, seen, TASK) + 10.0
    before, after = differences(np.array([begin, pose]), seen, TASK)
    assert after < 0.3 * before
    assert score <= log_score(POSE, 0, EXPECTED, assignment, seen, TASK) + 1e-9
