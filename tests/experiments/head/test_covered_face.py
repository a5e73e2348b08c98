"""A face of which half is covered for seconds: painted over a real clip, where the rest of it says how it stands."""

import csv
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.runs.run import Run
from tests.experiments.head.heads import Picture, Pictures
from tests.making import whole_run

HEAD = find("head")
CLIP = Path(__file__).parents[3] / ".." / "shared" / "data" / "face_turning"
NEEDS_CLIP = pytest.mark.skipif(not CLIP.exists(), reason="the real clip of a turning face is not here")
FRAMES = 210
COVERED = range(40, 190)
"""While a cover is there; it comes up and goes down in ten frames."""


@cache
def reference() -> tuple[dict[str, float], ...]:
    """What another program says of each frame: angles in degrees, points in px."""
    with (CLIP / "reference_pose.csv").open(encoding="utf-8") as file:
        return tuple({name: float(value) for name, value in row.items()} for row in csv.DictReader(file))


def clip() -> Iterator[Picture]:
    capture = cv2.VideoCapture(str(CLIP / "clip.mp4"))
    for _ in range(FRAMES):
        found, picture = capture.read()
        assert found
        yield np.ascontiguousarray(picture[:, :, ::-1])
    capture.release()


def point(row: dict[str, float], name: str) -> NDArray[np.float64]:
    return np.array([row[f"{name}_x"], row[f"{name}_y"]])


def scarf(picture: Picture, row: dict[str, float], up: float) -> Picture:
    """Cover everything below the nose."""
    nose, chin = point(row, "nose_tip"), point(row, "chin")
    wide = np.linalg.norm(point(row, "subj_right_eye_outer") - point(row, "subj_left_eye_outer"))
    top = nose + (chin - nose) * (0.1 + 1.1 * (1.0 - up))
    across, hem = np.array([wide, 0.0]), np.array([0.0, 45.0])
    corners = np.stack([top - across, top + across, chin + hem + 0.9 * across, chin + hem - 0.9 * across])
    return cv2.fillPoly(picture.copy(), [corners.astype(np.int32)], (60, 70, 130))


def watch(seed: int) -> tuple[float, float]:
    """Return the mean error of the yaw, degrees, and the share of frames in which the face is tracked to 15 degrees."""
    shown = []
    for index, (picture, row) in enumerate(zip(clip(), reference(), strict=False)):
        up = min(1.0, (index - COVERED.start) / 10, (COVERED.stop - index) / 10)
        shown.append(scarf(picture, row, up) if up > 0.0 else picture)
    run = Run(HEAD, HEAD.video.on_video(Pictures(shown, frame_rate_hz=25.0), None), seed=seed, frames=FRAMES)
    run.finish()
    rows, names = run.diagnostics, ("yaw_deg", "pitch_deg", "roll_deg")
    off = np.array(
        [[row.number(name) - known[name] for name in names] for row, known in zip(rows, reference(), strict=False)]
    )
    errors, searching = np.abs(off - off[0]), np.array([row.searching for row in rows])
    return float(errors[:, 0].mean()), float(np.mean(~searching & (errors.mean(axis=1) < 15.0)))


@NEEDS_CLIP
def test_a_cover_does_not_pull_the_pose() -> None:
    """While mouth and chin are covered the eyes tell the pose."""
    yaw_deg, tracked = watch(seed=10)
    assert yaw_deg < 4.0
    assert tracked > 0.9


def test_a_face_unlike_the_mean_is_not_taken_for_a_covered_one() -> None:
    """This person's first turn misfits the mean face, which was taken for a cover: the yaw was not followed at all."""
    run = whole_run(HEAD, seed=1, frames=110, values={"person": 400})
    yaw, true = (np.array([getattr(row, name)[1] for row in run.diagnostics]) for name in ("estimate", "truth"))
    assert np.abs(true).max() > 30.0
    assert np.abs(yaw - true).max() < 12.0
