import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.experiments.trajectories.corners import Detector, DetectorParameters, find_corners

DETECTORS: list[Detector] = ["eigenvalue", "orientation"]


def picture(seed: int = 0) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    grey = np.full((120, 160), 128, np.uint8)
    for x, y, level in rng.integers(0, [150, 110, 256], (40, 3)):
        cv2.rectangle(grey, (int(x), int(y)), (int(x) + 12, int(y) + 8), int(level), -1)
    return np.clip(grey + rng.normal(0, 2, grey.shape), 0, 255).astype(np.uint8)


def with_values(**values: object) -> DetectorParameters:
    return revise(DetectorParameters(), values)


def test_the_eigenvalue_finds_what_opencv_finds() -> None:
    """Where single precision does not matter, the list is that of OpenCV's detector, in its order."""
    grey = picture()
    peer = cv2.goodFeaturesToTrack(grey, 60, 0.05, 9, blockSize=5).reshape(-1, 2)
    assert (find_corners(grey, with_values(corner_margin_px=1)) == peer).all()


@pytest.mark.parametrize("detector", DETECTORS)
def test_the_corners_of_a_rectangle_are_found(detector: Detector) -> None:
    """A bright rectangle has four corners, each found within two pixels; a flat picture has none."""
    grey = np.full((80, 100), 40, np.uint8)
    assert find_corners(grey, with_values(corner_detector=detector)).shape == (0, 2)
    grey[25:55, 30:70] = 200
    found = find_corners(grey, with_values(corner_detector=detector, corner_quality=0.3))
    truth = np.array([[29.5, 24.5], [69.5, 24.5], [29.5, 54.5], [69.5, 54.5]])
    assert len(found) == 4
    assert np.abs(found[:, None] - truth).max(axis=2).min(axis=0).max() <= 2.0


def test_the_documents_detector_takes_points_of_a_slanted_line() -> None:
    """Ichimura and Ikoma 2000 report false corners on a slanted line: the steps of the line have little direction."""
    grey = np.full((90, 90), 120, np.uint8)
    cv2.line(grey, (-20, 75), (110, 15), 225, 3)
    counts = {
        name: len(find_corners(grey, with_values(corner_detector=name, corner_window_px=3))) for name in DETECTORS
    }
    assert counts["orientation"] >= 3


@pytest.mark.parametrize("detector", DETECTORS)
def test_corners_keep_their_distance(detector: Detector) -> None:
    """From each other, from the edge, and to the number and the places that are allowed."""
    grey = picture(1)
    parameters = with_values(corner_detector=detector, corner_distance_px=15, corner_margin_px=20, corner_count=10)
    found = find_corners(grey, parameters)
    apart = np.hypot(*(found[:, None] - found[None]).transpose(2, 0, 1)) + 1e9 * np.eye(len(found))
    assert 0 < len(found) <= 10
    assert apart.min() >= 15
    assert (found >= 20).all()
    assert (found <= np.array([160, 120]) - 21).all()
    among = np.zeros(grey.shape, np.bool_)
    among[:, 80:] = True
    assert (find_corners(grey, parameters, among)[:, 0] >= 80).all()


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (24, 24), (25, 25)])
def test_a_picture_without_room_has_no_corner(size: tuple[int, int]) -> None:
    """A picture of nothing but margin has no corner, whatever it shows."""
    grey = np.random.default_rng(0).integers(0, 256, size).astype(np.uint8)
    found = find_corners(grey, with_values())
    assert found.shape == (min(len(found), 1), 2)
