"""Whether a face can be followed: its size in the picture, its light, and whether it looks into the camera.

The limits are those at which the tracker was measured to get worse on a real clip of a turning head, made smaller,
darker and flatter step by step (`docs/reference/measures.md` has the figures). A face is as suitable as the worst of
the three.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.recipe import Footage
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.suitability import WELL, Suitability, grade
from pftrack.experiments.head.marks import FacePoints
from pftrack.experiments.head.trackers.memory import around, eye_distance
from pftrack.vision.detection.face import DetectedFace, FaceError, in_box
from pftrack.vision.geometry.face_model import FEATURES
from pftrack.vision.likelihoods.template import luma

__all__ = ["suits"]

LEAST_EYES_PX, GOOD_EYES_PX = 7.5, 15.0
"""Distance of the eyes: at 7 px the finder knows no face any more, below 12 px the error doubles."""

LEAST_CONTRAST, GOOD_CONTRAST = 3.0, 12.0
"""Standard deviation of the face's grey levels: at 2.5 the features are lost in the camera's noise, below 12 they are
tracked, but the finder does not recognise the face."""

ASIDE, ONE_EYE, UNKNOWN = 0.45, 0.35, 0.4
"""How suitable a face is that looks aside, one of which one eye is seen, one that the finder does not recognise."""

DARK, BRIGHT = 30.0, 225.0
"""Mean grey levels below and above which it is the exposure that leaves little contrast."""


class _Reason(NamedTuple):
    """One of the three: how suitable, what was found, what would help."""

    value: float
    found: str
    advice: str


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Look at the face in the first picture.

    Args:
        sequence: The pictures.
        footage: Start, and the features of the face there.
        parameters: Of frame 0.
    """
    del parameters
    marked = FacePoints.model_validate(footage.mark).points
    points = np.array([marked[name] for name in FEATURES])
    grey = luma(sequence.picture(footage.start))
    reasons = _size(points), _light(grey, points), _angle(grey, points)
    worst = min(reasons, key=lambda reason: reason.value)
    grade = Suitability(worst.value, "").grade
    found = ", ".join(reason.found for reason in reasons)
    advice = tuple(reason.advice for reason in sorted(reasons) if reason.value < WELL)
    return Suitability(worst.value, f"can be followed {grade}: {found}", advice)


def _size(points: NDArray[np.float64]) -> _Reason:
    distance = eye_distance(points)
    return _Reason(
        grade(distance, LEAST_EYES_PX, GOOD_EYES_PX),
        f"the eyes are {distance:.0f} px apart",
        f"a larger face, its eyes at least {GOOD_EYES_PX:.0f} px apart, would help",
    )


def _light(grey: NDArray[np.uint8], points: NDArray[np.float64]) -> _Reason:
    (left, top), (right, bottom) = np.floor(points.min(axis=0)).astype(int), np.ceil(points.max(axis=0)).astype(int)
    face = grey[max(top, 0) : bottom + 1, max(left, 0) : right + 1].astype(np.float64)
    spread, mean = float(face.std()), float(face.mean())
    value = grade(spread, LEAST_CONTRAST, GOOD_CONTRAST)
    if value >= WELL:
        return _Reason(value, "its light is good", "")
    if mean < DARK:
        return _Reason(value, "it is too dark", "more light on the face, or a longer exposure, would help")
    if mean > BRIGHT:
        return _Reason(value, "it is overexposed", "less light on the face, or a shorter exposure, would help")
    return _Reason(value, "it has little contrast", "light from one side, or a clearer picture, would help")


def _angle(grey: NDArray[np.uint8], points: NDArray[np.float64]) -> _Reason:
    try:
        face: DetectedFace | None = in_box(grey, around(points))
    except FaceError:
        face = None
    if face is None or not face.eyes_seen:
        missing = "the finder does not recognise it, so that it is not found again once it is lost"
        return _Reason(UNKNOWN, missing, "a picture in which the face looks into the camera, well lit, would help")
    if face.eyes_seen == 1:
        return _Reason(ONE_EYE, "one eye is seen", "a picture in which both eyes are seen would help")
    if face.aside:
        return _Reason(ASIDE, "it looks aside", "a picture in which it looks into the camera would help")
    return _Reason(1.0, "it looks into the camera", "")
