"""What a finder has found again: whether it is the face that was lost, and how it is turned."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.head.first_sight import EYES, is_same_face, pose_found
from pftrack.experiments.head.scene import HeadSource
from pftrack.runs.run import Run
from tests.experiments.head.moving_face import NOTHING, POINTS, begun, grey, grey_at, memory, parameters, similar

HEAD = find("head")
SIGHT = memory(begun("pf-asd", parameters())).sight


@pytest.mark.parametrize(("scale", "roll"), [(1.0, 0.0), (0.6, 0.4), (1.4, -0.3)])
def test_a_face_is_known_again_at_any_size_and_roll(scale: float, roll: float) -> None:
    """Also darker and with less contrast, and if the finder is some pixels off; not where there is something else."""
    points = similar(scale, roll, (8.0, -5.0))
    picture = grey_at(points)
    assert is_same_face(picture, SIGHT, points)
    assert is_same_face((20 + picture // 3).astype(np.uint8), SIGHT, points + 3.0 * scale)
    assert not is_same_face(grey_at(POINTS)[::-1, ::-1].copy(), SIGHT, points)
    assert not is_same_face(NOTHING, SIGHT, points)
    assert not is_same_face(picture, SIGHT, similar(0.3 * scale, roll, (0.0, 30.0)))


def test_a_face_of_which_half_is_covered_is_known_again() -> None:
    """Five features are enough, as long as they are where they should be."""
    picture = grey()
    lowest = np.sort(POINTS[:, 1])[5]
    picture[int(lowest) + 12 :] = 128
    assert is_same_face(picture, SIGHT, POINTS)
    picture[:] = 128
    assert not is_same_face(picture, SIGHT, POINTS)


@pytest.mark.parametrize(("pitch", "yaw"), [(0, 0), (0, 30), (20, -15), (-20, 45)])
def test_the_pose_is_that_which_the_picture_tells(pitch: float, yaw: float) -> None:
    """Where the picture is sure, it is the one on the grid that it was made of, and so are size and places."""
    solid = begun("pf-asd", parameters()).solid
    theta = np.deg2rad([pitch, yaw, 5.0])
    true = 1.3 * solid.points_mm @ (solid.reference[:, :3] @ rotation(theta)).T + (100.0, 90.0)

    def scores(slopes: NDArray[np.float64], positions: NDArray[np.float64]) -> NDArray[np.float64]:
        assert slopes.shape == (11, 2, 3)
        return -20.0 * np.square(positions - true[:, None]).sum(axis=2)

    found = pose_found(solid, true[EYES], theta[2], scores)
    np.testing.assert_allclose(found.theta, theta, atol=1e-6)
    assert found.scale == pytest.approx(1.3, rel=1e-6)
    np.testing.assert_allclose(found.points_px, true, atol=1e-4)
    nothing = pose_found(solid, true[EYES], theta[2], lambda _, positions: np.zeros(positions.shape[:2]))
    np.testing.assert_allclose(nothing.theta[:2], 0.0, atol=1e-9)


def test_a_turned_head_is_found_turned() -> None:
    """With templates in relief the first guess after a loss is nearer to the true pose than the front is."""
    values = {"templates": "relief", "upper_layer": "perspective", "person": 240, "image_width_px": 480, "speed": 1.5}
    run = Run(HEAD, HEAD.simulate(), seed=4, frames=2, timeline=(Change(0, values),))
    run.seek(1)
    state, given = run.current.state, run.parameters_at(0)
    known: HeadMemory = state.memory
    source = HeadSource(4, given)
    found, front = [], []
    for index in range(20, 200, 20):
        frame = source.frame(index, History(((0, given),)))
        assert frame.target is not None
        assert frame.target.landmarks is not None
        true = frame.target.position
        turned = head._judge_face(
            known, state.solid, head._grey(frame), frame.target.landmarks.points_px, true[2], given
        )
        found.append(np.abs(turned.theta - true)[:2].sum())
        front.append(np.abs(true[:2]).sum())
    assert np.mean(found) < 0.7 * np.mean(front)
