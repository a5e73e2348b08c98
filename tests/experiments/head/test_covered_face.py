"""A real face whose lower half is covered for seconds, and a face that only looks covered."""

import csv
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.sources.sequence import open_sequence
from tests.experiments.head.heads import Pictures
from tests.making import whole_run

HEAD = find("head")
CLIP = Path(__file__).parents[3] / ".." / "shared" / "data" / "face_turning"
FRAMES, COVERED = 210, range(40, 190)


@pytest.mark.skipif(not CLIP.exists(), reason="the real clip of a turning face is not here")
def test_a_cover_does_not_pull_the_pose() -> None:
    """With a scarf below the nose the eyes tell the pose: yaw to 4 degrees, tracked to 15 in 90 % of the frames."""
    with (CLIP / "reference_pose.csv").open(encoding="utf-8") as file:
        known = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)][:FRAMES]
    with closing(open_sequence(CLIP / "clip.mp4")) as clip:
        shown = [clip.picture(index).copy() for index in range(FRAMES)]
    for index in COVERED:
        nose, chin, right, left = (
            np.array([known[index][f"{name}_x"], known[index][f"{name}_y"]])
            for name in ("nose_tip", "chin", "subj_right_eye_outer", "subj_left_eye_outer")
        )
        up = min(1.0, (index - COVERED.start) / 10, (COVERED.stop - index) / 10)
        top, hem = nose + (chin - nose) * (0.1 + 1.1 * (1.0 - up)), chin + np.array([0.0, 45.0])
        across = np.array([np.linalg.norm(right - left), 0.0])
        corners = np.array([top - across, top + across, hem + 0.9 * across, hem - 0.9 * across])
        if up > 0.0:
            cv2.fillPoly(shown[index], [corners.astype(np.int32)], (60, 70, 130))
    run = whole_run(HEAD, HEAD.video.on_video(Pictures(shown, frame_rate_hz=25.0), None), seed=10, frames=FRAMES)
    names = ("yaw_deg", "pitch_deg", "roll_deg")
    off = np.array(
        [[row.number(name) - true[name] for name in names] for row, true in zip(run.diagnostics, known, strict=True)]
    )
    errors, searching = np.abs(off - off[0]), np.array([row.searching for row in run.diagnostics])
    assert errors[:, 0].mean() < 4.0
    assert np.mean(~searching & (errors.mean(axis=1) < 15.0)) > 0.9


def test_a_face_unlike_the_mean_is_not_taken_for_covered() -> None:
    """The first turn of this person misfits the mean face as a cover does, and its yaw is followed."""
    run = whole_run(HEAD, seed=1, frames=110, values={"person": 400})
    yaw, true = (np.array([getattr(row, name)[1] for row in run.diagnostics]) for name in ("estimate", "truth"))
    assert np.abs(true).max() > 30.0
    assert np.abs(yaw - true).max() < 12.0
