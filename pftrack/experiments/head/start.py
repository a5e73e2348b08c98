"""Where a face is when a recording of it begins: found by looking through the pictures, or in a box around it.

Only so many pictures are looked into, however long the recording is: the first ones one by one, since most recordings
begin with the face, and the others spread evenly, since who enters late stays for a while.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.finder import Finder, Sighting
from pftrack.core.model.marks import Box, Mark
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.sequence import FrameSequence
from pftrack.experiments.head.marks import FaceBox, FacePoints
from pftrack.vision.detection.face import DetectedFace, FaceError, by_proportion, detect, in_box, spot
from pftrack.vision.geometry.face_model import FEATURES
from pftrack.vision.likelihoods.template import luma

__all__ = ["FINDER", "first_face"]

CLOSELY_SEARCHED, THEN_EVERY = 50, 5
"""So many pictures are looked at one by one for a first face, and of later ones at most every so-many-th."""

LOOKS_A_SECOND = 10
"""Pictures that are looked at for a face from the front, within a second of the first one from the side."""

MOST_SEARCHED = 200
"""Pictures in all, of 0.1 s each."""


def frames_to_search(first: int, last: int) -> Sequence[int]:
    """Return the numbers of the pictures to look for a first face in.

    Args:
        first: Number of the first picture.
        last: Number of the last picture.
    """
    near = range(first, min(first + CLOSELY_SEARCHED, last + 1))
    rest = last + 1 - near.stop
    every = max(THEN_EVERY, -(-rest // (MOST_SEARCHED - CLOSELY_SEARCHED)))
    return [*near, *range(near.stop, last + 1, every)]


def search(sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
    """Look for a face into one picture after the other; of the first it is said why there is none."""
    for index, frame in enumerate(frames):
        grey = luma(sequence.picture(frame))
        if index == 0 or spot(grey) is not None:
            try:
                yield _sighting(frame, detect(grey))
            except FaceError as error:
                yield Sighting(frame, remarks=(str(error),))
        else:
            yield Sighting(frame)


def better(sequence: FrameSequence, first: Sighting) -> Sighting:
    """Return the first face within a second of a sighting that looks into the camera; the sighting, if none does.

    A pose is relative to the picture at which it begins, and the points of that are those of a face from the front.
    """
    last = min(first.frame + round(sequence.frame_rate_hz), sequence.frame_count - 1)
    for frame in range(first.frame, last + 1, max(1, round(sequence.frame_rate_hz / LOOKS_A_SECOND))):
        grey = luma(sequence.picture(frame))
        face = spot(grey)
        if face is not None and not face.aside:
            if frame == first.frame:
                break
            found = _sighting(frame, detect(grey))
            return replace(found, remarks=(f"in frame {first.frame} the face looks aside", *found.remarks))
    return first


def within(sequence: FrameSequence, frame: int, mark: Mark) -> Sighting:
    """Return the face in a box that a person has drawn; if none is recognised there, a mean face that fills it.

    Raises:
        ParameterError: The box is not within the picture, or is none.
    """
    if not isinstance(mark, Box):
        raise ParameterError("mark", mark.kind, "a box around the face")
    mark.check(sequence.size)
    box = mark.corner_and_size
    try:
        return _sighting(frame, in_box(luma(sequence.picture(frame)), box))
    except FaceError:
        points = _points(by_proportion(box).clip(0.0, np.array(sequence.size) - 1.0))
        remark = "no face was recognised in the box; drag the points of a mean face to where they belong"
        return Sighting(frame, points, placed=_handles(FEATURES), remarks=(remark,))


def first_face(sequence: FrameSequence, start: int) -> tuple[int, NDArray[np.float64]]:
    """Return the number of the first picture with a face from one on, and its features (11, 2) px.

    It is the first one, or a better start soon after it.

    Raises:
        FaceError: There is none; it says what is wrong with the picture `start`.
    """
    refused = "expected a face with two eyes, found none"
    for sighting in search(sequence, frames_to_search(start, sequence.frame_count - 1)):
        if sighting.sure:
            found = better(sequence, sighting)
            assert isinstance(found.mark, FacePoints)  # noqa: S101 - no other kind is found
            return found.frame, np.array([found.mark.points[name] for name in FEATURES])
        if sighting.frame == start and sighting.mark is None:
            refused = sighting.remarks[0]
    raise FaceError("no face", f"{refused}; mark its features or its box")


def _sighting(frame: int, face: DetectedFace) -> Sighting:
    aside = "the face looks aside; a picture in which it looks into the camera is a better start"
    remarks = (*face.warnings, aside) if face.eyes_seen == 2 and face.aside else face.warnings
    sure = len(face.placed) < len(FEATURES)
    return Sighting(frame, _points(face.points_px), sure, _handles(face.placed), remarks)


def _points(points: NDArray[np.float64]) -> FacePoints:
    return FacePoints(points={name: (float(x), float(y)) for name, (x, y) in zip(FEATURES, points, strict=True)})


def _handles(names: Sequence[str]) -> tuple[str, ...]:
    """Return what an editor calls the handles of these points."""
    return tuple(f"points.{name}" for name in names)


FINDER = Finder(frames_to_search, search, better, FacePoints, within, hints=(FaceBox,))
