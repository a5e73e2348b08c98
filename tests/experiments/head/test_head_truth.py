"""Tables of true poses are read whole or refused, and taken relative to a frame."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.experiments.head.recording import read_poses
from pftrack.vision.face import gaze
from tests.making import truth_file


def test_poses_are_read_and_taken_relative_to_a_frame(tmp_path: Path) -> None:
    """A table of poses gives the angles of the rotation, less those of the frame that counts as zero."""
    poses = read_poses(truth_file(tmp_path, "frame,yaw_deg,pitch_deg,roll_deg,x\n3,10,-5,2,\n4,20,-8,1,\n5,,,,\n"))
    assert poses.rows == {3: (10.0, -5.0, 2.0), 4: (20.0, -8.0, 1.0)}
    assert poses.at(5) is None
    known = poses.at(4)
    assert known is not None
    assert np.rad2deg(gaze(known.position)) == pytest.approx((20, -8, 1))
    moved = replace(poses, zero=3).at(4)
    assert moved is not None
    assert np.rad2deg(gaze(moved.position)) == pytest.approx((10, -3, -1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frame,x,y,w,h\n0,1,2,3,4\n", "expected the columns frame, yaw_deg, pitch_deg, roll_deg, got frame, x"),
        ("frame,yaw_deg,pitch_deg,roll_deg\n0,1,2,400\n", "roll_deg must be a number of degrees, got '400'"),
        ("frame,yaw_deg,pitch_deg,roll_deg\n0,1,2,3\n0,1,2,3\n", "frame 0 is listed twice; one pose a frame"),
    ],
)
def test_a_wrong_table_of_poses_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """The message says what was expected of poses."""
    with pytest.raises(RefusedError, match=message):
        read_poses(truth_file(tmp_path, text))
