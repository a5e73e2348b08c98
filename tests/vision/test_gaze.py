import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import rotation
from pftrack.vision.face import gaze, theta_of

right_angles = st.floats(-1.5, 1.5)


@given(right_angles, right_angles, st.floats(-3.0, 3.0))
def test_gaze_is_the_direction_in_which_the_face_looks(x: float, y: float, z: float) -> None:
    """Yaw and pitch are those of R (0, 0, -1), the roll is that of R (1, 0, 0) in the picture."""
    theta = np.array([x, y, z])
    ahead, across = rotation(theta) @ [0.0, 0.0, -1.0], rotation(theta) @ [1.0, 0.0, 0.0]
    yaw, pitch, roll = gaze(theta)
    assert yaw == pytest.approx(np.arctan2(ahead[0], -ahead[2]), abs=1e-9)
    assert pitch == pytest.approx(np.arcsin(-ahead[1]), abs=1e-9)
    assert np.cos(roll - np.arctan2(across[1], across[0])) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("theta", "seen"),
    [((0.0, -0.3, 0.0), (0.3, 0, 0)), ((-0.2, 0.0, 0.0), (0, 0.2, 0)), ((0.0, 0.0, 0.1), (0, 0, 0.1))],
)
def test_signs(theta: tuple[float, ...], seen: tuple[float, ...]) -> None:
    """Looking to the right of the picture, up, and turned clockwise are positive."""
    assert gaze(np.array(theta)) == pytest.approx(seen)
    nose = rotation(np.array(theta)) @ [0.0, 0.0, -10.0]
    assert np.sign(np.round(nose[0], 9)) == np.sign(seen[0])
    assert np.sign(np.round(-nose[1], 9)) == np.sign(seen[1])


@given(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(-1.4, 1.4))
def test_theta_is_found_again(yaw: float, pitch: float, roll: float) -> None:
    """The two ways of writing a pose are inverse to each other within a quarter of a turn."""
    assert gaze(theta_of(np.array([yaw, pitch, roll]))) == pytest.approx([yaw, pitch, roll], abs=1e-9)
