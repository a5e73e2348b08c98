"""What a finder of faces has found again: whether it is the face that was lost, and how it is turned.

A finder takes a mouth and a chin for a small face now and then, mostly while the true one is turned away. Enough
features of the lost face must look there as they did at first sight.

It tells where the eyes are, and nothing of the pose except that it is not from the side. Taken for a face from the
front, one that is turned gets its features beside their places, and what templates follow is beside them. Templates in
relief tell poses apart: several are tried, each of which predicts where the features are when the eyes are where they
were found, and what they look like. Flat templates look alike from everywhere, and gained nothing by it.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import rotation
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import product
from pftrack.experiments.head.trackers.memory import FirstSight
from pftrack.experiments.shared.pose.solid import Solid
from pftrack.vision.geometry.face_model import FEATURES, fit_similarity
from pftrack.vision.likelihoods import template

__all__ = ["EYES", "Found", "Scores", "is_same_face", "pose_found"]

ALIKE = 0.6
FEWEST_ALIKE = 5
"""So many features must correlate with their templates by so much. On six simulated people, 220 to 225, in two sizes,
650 of 655 faces have them that were found where the face is, and none of 9 that were found elsewhere."""

ALIKE_REACH, ALIKE_STEPS = 0.15, 9
"""Within which each is looked for, as a share of the distance between the eyes, and in how many steps along a side."""

YAWS_RAD = np.deg2rad(np.arange(-45.0, 46.0, 15.0))
PITCHES_RAD = np.deg2rad(np.arange(-20.0, 21.0, 20.0))
TURNED_SD_RAD = float(np.deg2rad(25.0))
"""Of the angles of faces that are found, about those of one from the front."""

REACH, STEPS = 0.12, 5
"""The same for a feature that is looked for where a pose would have it."""

SHARED = 0.2
"""By how much the features' log likelihood counts: they are off together, as the eyes are that all of them hang on. Of
0, 0.05, 0.2 and 0.5, tried on four people, 226 to 229, this was best."""

EYES = [FEATURES.index("reye"), FEATURES.index("leye")]

Scores: TypeAlias = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""From slopes (F, 2, 3), px/mm, and positions (F, N, 2) px to log likelihoods (F, N)."""


class Found(NamedTuple):
    """A face that was found again.

    Attributes:
        theta: (3,) angles of the solid, rad.
        scale: How many times as large it is seen as the solid's camera has it.
        points_px: (F, 2) its features.
    """

    theta: NDArray[np.float64]
    scale: float
    points_px: NDArray[np.float64]


def is_same_face(grey: NDArray[np.uint8], sight: FirstSight, points_px: NDArray[np.float64]) -> bool:
    """Tell whether features that were found look as those of a face did at first sight, seen as large and as upright.

    Args:
        grey: (height, width), 8 bit.
        sight: Of the face that was lost.
        points_px: (F, 2) where its features would be.
    """
    moved = fit_similarity(sight.points_px, points_px)
    turn = moved.scale * moved.rotation[:2, :2]
    there = np.column_stack([turn, points_px.mean(axis=0) - product(turn, sight.points_px.mean(axis=0))])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    as_then = np.empty_like(sight.grey)
    cv2.warpAffine(grey, there, as_then.shape[::-1], as_then, flags=how, borderMode=cv2.BORDER_REPLICATE)
    around = sight.points_px[:, None] + _offsets(ALIKE_REACH * sight.eye_distance_px, ALIKE_STEPS)
    alike = template.correlations(as_then, around, sight.templates(1.0)).max(axis=1)
    return int((alike >= ALIKE).sum()) >= FEWEST_ALIKE


def pose_found(solid: Solid, eyes_px: NDArray[np.float64], roll_rad: float, scores: Scores) -> Found:
    """Return how a face stands on average over the hypotheses.

    Args:
        solid: The head, before an affine camera that sees it about as large as it is now.
        eyes_px: (2, 2) where the right and the left eye were found.
        roll_rad: By how much the head is rolled, as its eyes tell.
        scores: What the picture says.
    """
    thetas = np.array([(pitch, yaw, roll_rad) for pitch, yaw in itertools.product(PITCHES_RAD, YAWS_RAD)])
    told = np.array([_judge(solid, eyes_px, theta, scores)[1] for theta in thetas])
    log_weights = SHARED * told - 0.5 * np.square(thetas[:, :2] / TURNED_SD_RAD).sum(axis=1)
    weights = exponentials(log_weights - log_weights.max())
    return _judge(solid, eyes_px, (weights[:, None] * thetas).sum(axis=0) / weights.sum(), scores)[0]


def _judge(
    solid: Solid, eyes_px: NDArray[np.float64], theta: NDArray[np.float64], scores: Scores
) -> tuple[Found, float]:
    """Return where the features are by a pose, and its log likelihood."""
    slopes = product(solid.reference[:, :3], rotation(theta))
    seen = product(solid.points_mm, slopes.T)
    apart, across = (float(np.hypot(*(eyes[1] - eyes[0]))) for eyes in (seen[EYES], eyes_px))
    scale = across / apart
    places = scale * (seen - seen[EYES].mean(axis=0)) + eyes_px.mean(axis=0)
    around = places[:, None] + _offsets(REACH * across, STEPS)
    told = scores(np.tile(scale * slopes, (len(places), 1, 1)), around)
    best, each = told.argmax(axis=1), np.arange(len(places))
    return Found(theta, scale, around[each, best]), float(told[each, best].sum())


def _offsets(reach_px: float, steps: int) -> NDArray[np.float64]:
    """Return the points (steps * steps, 2) of a grid about 0."""
    along = np.linspace(-reach_px, reach_px, steps)
    return np.stack(np.meshgrid(along, along), axis=2).reshape(-1, 2)
