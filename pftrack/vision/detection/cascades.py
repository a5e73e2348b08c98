"""Viola and Jones' boosted cascades: boxes around faces and eyes (Bando 2007, ch. 4 section 4; OpenCV's stock files).

A face is looked for in a picture made small, an eye in a face brought to one size, so that the time taken does not
depend on the size of the picture.
"""

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["CLOSE", "NEARBY", "QUICK", "Box", "Effort", "eyes", "faces"]

Box: TypeAlias = tuple[float, float, float, float]
"""x and y of the left top corner, width and height, px."""

CASCADES = Path(cv2.__file__).parent / "data"

LEAST_FACE_PX = 24
"""The cascade's own window, in the picture made small."""

EYE_REGION = 0.62
"""The upper share of a face in which its eyes are."""

FACE_NEIGHBOURS, EYE_NEIGHBOURS = 4, 3


@dataclass(frozen=True, slots=True)
class Effort:
    """How closely to look.

    Attributes:
        picture_side_px: Longer side of the picture in which faces are looked for.
        face_step: Factor from one size of face to the next.
        face_side_px: Side of the face in which eyes are looked for.
        eye_step: Factor from one size of eye to the next.
    """

    picture_side_px: int
    face_step: float
    face_side_px: int
    eye_step: float


CLOSE = Effort(400, 1.1, 240, 1.05)
"""For the first picture: some 60 ms."""

QUICK = Effort(400, 1.2, 128, 1.1)
"""For a picture among others: some 30 ms."""

NEARBY = Effort(200, 1.2, 128, 1.1)
"""For a part of a picture, of twice the size of the face that is looked for: some 15 ms."""

Cascade: TypeAlias = Literal["frontalface_alt2", "eye_tree_eyeglasses", "eye"]

_of_thread = threading.local()
"""A cascade keeps its work in itself, so that no two threads may share one."""


def faces(grey: NDArray[np.uint8], effort: Effort = CLOSE) -> list[Box]:
    """Return the boxes of all upright frontal faces in a picture, the largest first.

    Args:
        grey: (height, width).
        effort: How closely to look.
    """
    height, width = grey.shape
    if min(height, width) < LEAST_FACE_PX:
        return []
    scale = min(1.0, effort.picture_side_px / max(height, width))
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else grey
    if min(small.shape[:2]) < LEAST_FACE_PX:
        return []
    found = _detect("frontalface_alt2", np.asarray(small, np.uint8), effort.face_step, FACE_NEIGHBOURS, LEAST_FACE_PX)
    boxes = [(x / scale, y / scale, w / scale, h / scale) for x, y, w, h in found]
    return sorted(boxes, key=lambda box: -box[2])


def eyes(grey: NDArray[np.uint8], face: Box, effort: Effort = CLOSE) -> list[Box]:
    """Return the boxes of what look like eyes in the upper part of a face.

    Args:
        grey: (height, width).
        face: The box of the face.
        effort: How closely to look.
    """
    height, width = grey.shape
    x, y, w, h = face
    left, top = max(round(x), 0), max(round(y), 0)
    right, bottom = min(round(x + w), width), min(round(y + EYE_REGION * h), height)
    if right - left < LEAST_FACE_PX // 2 or bottom - top < LEAST_FACE_PX // 4:
        return []
    scale = effort.face_side_px / w
    part = cv2.resize(grey[top:bottom, left:right], None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)
    found: list[Box] = []
    cascades: tuple[Cascade, ...] = ("eye_tree_eyeglasses", "eye")
    for cascade in cascades:
        boxes = _detect(cascade, np.asarray(part, np.uint8), effort.eye_step, EYE_NEIGHBOURS, effort.face_side_px // 8)
        # The centre of a pixel of the small picture is half a pixel from its corner, in either scale.
        found += [(left + a / scale, top + b / scale, c / scale, d / scale) for a, b, c, d in boxes]
        if len(found) >= 2:
            break
    return found


def _detect(cascade: Cascade, grey: NDArray[np.uint8], step: float, neighbours: int, least_px: int) -> list[Box]:
    detector = getattr(_of_thread, cascade, None)
    if detector is None:
        detector = cv2.CascadeClassifier(str(CASCADES / f"haarcascade_{cascade}.xml"))
        if detector.empty():
            raise RuntimeError(f"expected OpenCV's cascade {cascade} beside OpenCV itself, found none")
        setattr(_of_thread, cascade, detector)
    boxes = detector.detectMultiScale(grey, step, neighbours, minSize=(least_px, least_px))
    return [(float(x), float(y), float(w), float(h)) for x, y, w, h in boxes]
