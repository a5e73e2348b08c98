"""Pictures that together are no larger than they may be: encoded again, coarser and if need be smaller."""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np

FORMS = ((960, 80), (960, 70), (800, 65), (720, 55), (640, 50), (560, 45), (480, 40), (400, 35), (320, 30))
"""Longest side of a picture, px, and quality, from fine to coarse."""
SAMPLE = 12
"""So many pictures tell how large all of them will be."""


def shrink(pictures: Sequence[bytes], most_bytes: int) -> list[bytes]:
    """Return JPEG files that together are no larger than that, or as small as they get.

    Args:
        pictures: JPEG files.
        most_bytes: That they may take.
    """
    made = list(pictures)
    sample = pictures[:: max(1, len(pictures) // SAMPLE)]
    for form in FORMS:
        if _size(made) <= most_bytes:
            break
        likely = _size(_encode(file, *form) for file in sample) / len(sample) * len(pictures)
        if likely <= most_bytes or form == FORMS[-1]:
            made = [_encode(file, *form) for file in pictures]
    return made


def _size(files: Iterable[bytes]) -> int:
    return sum(map(len, files))


def _encode(file: bytes, side: int, quality: int) -> bytes:
    image = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError("a picture of a recording is no JPEG file")
    scale = side / max(image.shape[:2])
    if scale < 1.0:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    options = (cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
    return cv2.imencode(".jpg", image, options)[1].tobytes()
