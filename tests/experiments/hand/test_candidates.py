"""Which palms and fingers are tried, and how far apart."""

import numpy as np
import pytest

from pftrack.core.geometry import convex_hull, fill
from pftrack.experiments.hand.candidates import (
    chain_rate,
    contour_rate,
    finger_candidates,
    flexion_rates,
    palm_candidates,
)
from pftrack.experiments.hand.model import HandTrackerParameters, Task, settings
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, open_pose, palm_points, parts

SCALE, SIDE, TURN = 312.0, 1200, 0.03
INDEX = 1


def posed(b: float) -> np.ndarray:
    """Return a pose with all fingers bent by 0.5 rad, turned about the forearm."""
    pose = open_pose((600.0, 1000.0))
    pose[3] = b
    pose[10:13] = 0.5
    return pose


def index_finger(pose: np.ndarray) -> np.ndarray:
    corners, counts = parts(pose, SCALE, MODEL)
    return fill(corners[5:8], counts[5:8], SIDE, SIDE)


@pytest.mark.parametrize("b", [0.0, 1.0])
@pytest.mark.parametrize("angle", [9, 10])
def test_the_predicted_change_of_area_is_the_measured_one(b: float, angle: int) -> None:
    """D dtheta is the area by which the finger's silhouette changes, within 20 %, for spread and for flexion."""
    pose = posed(b)
    moved = pose.copy()
    moved[angle] += TURN
    measured = np.count_nonzero(index_finger(moved) ^ index_finger(pose)) / TURN
    velocities = (joints(moved, SCALE, MODEL) - joints(pose, SCALE, MODEL))[INDEX] / TURN
    rate = chain_rate(joints(pose, SCALE, MODEL)[INDEX], velocities, SCALE * MODEL.radii[INDEX, 3])
    assert rate == pytest.approx(measured, rel=0.2)
    if angle == 10:
        assert flexion_rates(pose, SCALE, MODEL)[INDEX] == pytest.approx(rate, rel=0.05)


@pytest.mark.parametrize("angle", [2, 3, 4])
def test_a_palms_change_of_area_is_the_measured_one(angle: int) -> None:
    """The same for the palm's three angles, within 5 %."""
    pose, moved = posed(0.6), posed(0.6)
    moved[angle] += TURN
    before, after = (palm_points(each, SCALE, MODEL) for each in (pose, moved))
    masks = [fill(hull[None], np.array([len(hull)]), SIDE, SIDE) for hull in map(convex_hull, (before, after))]
    measured = np.count_nonzero(masks[0] ^ masks[1]) / TURN
    assert contour_rate(before, (after - before) / TURN) == pytest.approx(measured, rel=0.05)


def test_candidates_are_within_limits_and_the_most_probable_come_first() -> None:
    """The prediction is among the fingers that are tried, with a prior of 0; so is that of the palm."""
    task = Task(52.0, MODEL, settings(HandTrackerParameters(wrist_prior=False), 52.0))
    predicted = np.clip(posed(0.3), LOW, HIGH)
    angles, log_priors, counts = finger_candidates(predicted, task)
    for finger in range(5):
        size, at = counts[finger], 5 + 4 * finger
        assert (np.diff(log_priors[finger, :size]) <= 0.0).all()
        assert log_priors[finger, 0] == 0.0
        assert (angles[finger, :size] >= LOW[at : at + 4]).all()
        assert (angles[finger, :size] <= HIGH[at : at + 4]).all()
        assert any((each == predicted[at : at + 4]).all() for each in angles[finger, :size])
        assert angles[finger, :size, 1].max() > 0.95  # as far as it goes from 0.5
    poses, priors = palm_candidates(predicted, task)
    assert poses.shape == (175, 25)
    assert (poses[np.argmax(priors)] == predicted).all()
    assert priors.max() == 0.0
