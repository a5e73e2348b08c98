"""A face for tests of the head's trackers: a picture with a texture without repetitions, moved as a whole.

A face that only moves keeps its pose and its templates, so the answers of a tracker are known to the pixel: the places
of the features, their correlations, which of them are covered, and when the face counts as lost.
"""

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, Landmarks, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.head.parameters import AS_PUBLISHED, HeadTrackerParameters
from pftrack.experiments.shared.pose.methods import Method
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.face import FEATURES, fit_similarity, mean_model

WIDTH, HEIGHT = 240, 200
NOTHING = np.full((HEIGHT, WIDTH), 128, np.uint8)
PX_PER_MM = 1.1
MIDDLE = np.array([112.0, 80.0])
POINTS = mean_model().points_mm[:, :2] * PX_PER_MM + MIDDLE


SMOOTH = cv2.GaussianBlur(np.random.default_rng(4).standard_normal((2 * HEIGHT, 2 * WIDTH)), (0, 0), 2.5)
TEXTURE = (2 * np.rint(60 + 22 * SMOOTH / SMOOTH.std())).clip(0, 254).astype(np.uint8)
"""Smooth noise of even grey levels, twice the size of a picture, so that a view of it can be moved."""


def grey(dx: int = 0, dy: int = 0) -> NDArray[np.uint8]:
    """Return the picture, moved to the right and down by whole pixels."""
    top, left = HEIGHT // 2 - dy, WIDTH // 2 - dx
    return TEXTURE[top : top + HEIGHT, left : left + WIDTH].copy()


def grey_at(points_px: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the picture, turned and scaled so that the features lie at these points."""
    moved = fit_similarity(POINTS, points_px)
    turn = moved.scale * moved.rotation[:2, :2]
    # The picture is the middle of the texture.
    origin = points_px.mean(axis=0) - turn @ (POINTS.mean(axis=0) + np.array([WIDTH, HEIGHT]) // 2)
    found = cv2.warpAffine(TEXTURE, np.column_stack([turn, origin]), (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT)
    return np.asarray(found, np.uint8)


def frame(index: int, picture: NDArray[np.uint8]) -> Frame:
    return Frame(index, index / 30, image_rgb=np.repeat(picture[:, :, None], 3, axis=2))


def parameters(**values: Value) -> HeadTrackerParameters:
    usual = {"sample_count": 120, "joint_sample_count": 400, "feature_noise_px": 2.0, "initial_sd_px": 0.5}
    return revise(HeadTrackerParameters(), {**AS_PUBLISHED, **usual, **values})


def target(points_px: NDArray[np.float64] = POINTS) -> Target:
    known = Landmarks(points_px, np.ones(11, np.bool_), mean_model().points_mm, FEATURES)
    return Target(np.zeros(3), landmarks=known)


def begun(method: Method, given: HeadTrackerParameters, dx: int = 0, dy: int = 0) -> PoseState:
    start = Stream(3, 0, Purpose.START)
    return head.start(method, target(POINTS + np.array([dx, dy])), frame(0, grey(dx, dy)), given, start)


def stepped(
    state: PoseState, method: Method, given: HeadTrackerParameters, index: int, picture: NDArray[np.uint8]
) -> PoseState:
    return head.step(method, state, frame(index, picture), given, Stream(3, index, Purpose.TRACK))


def followed(method: Method, given: HeadTrackerParameters, pictures: Iterable[NDArray[np.uint8]]) -> PoseState:
    """Return the state after some pictures."""
    state = begun(method, given)
    for index, picture in enumerate(pictures, 1):
        state = stepped(state, method, given, index, picture)
    return state


def covered(picture: NDArray[np.uint8], names: tuple[str, ...]) -> NDArray[np.uint8]:
    """Return the picture with flat patches over features."""
    hidden = picture.copy()
    for name in names:
        x, y = np.rint(POINTS[FEATURES.index(name)]).astype(int)
        hidden[max(y - 26, 0) : y + 26, max(x - 26, 0) : x + 26] = 128
    return hidden


def memory(state: PoseState) -> HeadMemory:
    assert isinstance(state.memory, HeadMemory)
    return state.memory


def similar(scale: float, roll: float, shift: tuple[float, float]) -> NDArray[np.float64]:
    """Return the features of the face, scaled, rolled and shifted."""
    middle = POINTS.mean(axis=0)
    return scale * (POINTS - middle) @ rotation(np.array([0, 0, roll]))[:2, :2].T + middle + shift
