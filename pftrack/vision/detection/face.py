"""Where the eleven features of a face are in a first picture, and where a lost face is again.

Cascades find the face and its eyes; all other points are placed by the mean model, by the similarity that brings its
eyes onto those found, and then looked for nearby (`refinement`). What is found is a proposal: a person may drag any
point to where it belongs, so a doubtful one comes with warnings rather than not at all. Nothing is proposed for
a picture without a face, or with one that is cut off or not upright.
"""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.vision.detection import cascades
from pftrack.vision.detection.cascades import CLOSE, NEARBY, QUICK, Box, Effort
from pftrack.vision.detection.refinement import PLACED, refine_points
from pftrack.vision.geometry.face_model import FEATURES, FaceModel, mean_model, place

__all__ = ["DetectedFace", "FaceError", "by_proportion", "detect", "find_again", "in_box", "spot"]

EYES_IN_FACE = ((0.315, 0.40), (0.685, 0.40))
"""Where the eyes are in a face's box, as shares of its sides; the person's right eye first, left in the picture."""

NEAR_FACTOR = 2.2
"""Side of the square in which a lost face is looked for first, in sizes of the face."""

SIMILAR_SIZE = 0.5
"""A second face counts as such if it is at least so large relative to the largest."""

ASIDE = 0.06
"""The eyes of a face that looks aside are further than this off the middle of its box, in distances of the eyes: about
10 degrees of yaw on real faces, where it grows by 0.006 a degree."""

BOX_MARGIN = 0.3
"""A box around a face is made larger by this share on each side: the cascades want some of what is around it."""


class FaceError(ValueError):
    """A picture in which no face can be tracked; the message says what was expected and what was found.

    Attributes:
        kind: What is wrong.
    """

    def __init__(self, kind: Literal["too small", "no face", "not upright", "cut off"], message: str) -> None:
        super().__init__(message)
        self.kind = kind


@dataclass(frozen=True, slots=True, eq=False)
class DetectedFace:
    """A face found in a picture.

    Attributes:
        points_px: (11, 2) the features, in the order of `pftrack.vision.geometry.face_model.FEATURES`.
        box: Of the whole face, px.
        eyes_seen: How many of the two eyes the cascades saw; the others are placed by proportion.
        warnings: What a person should look at, one sentence each.
    """

    points_px: NDArray[np.float64]
    box: Box
    eyes_seen: int
    warnings: tuple[str, ...] = ()

    @property
    def eye_distance_px(self) -> float:
        """Between the centres of the eyes."""
        left, right = (self.points_px[FEATURES.index(name)] for name in ("leye", "reye"))
        return float(np.hypot(*(left - right)))

    @property
    def aside(self) -> bool:
        """Whether it looks aside, so that its points are not where those of a face from the front would be."""
        middle = sum(float(self.points_px[FEATURES.index(name), 0]) for name in ("leye", "reye")) / 2.0
        return abs(self.box[0] + self.box[2] / 2.0 - middle) > ASIDE * self.eye_distance_px

    @property
    def placed(self) -> tuple[str, ...]:
        """Names of the points that the model has placed rather than the picture shown."""
        return PLACED if self.eyes_seen == 2 else FEATURES


def detect(grey: NDArray[np.uint8], model: FaceModel | None = None, *, refine: bool = True) -> DetectedFace:
    """Find the face to be tracked: the largest of those with two eyes, or else the largest.

    Args:
        grey: (height, width), 8 bit.
        model: By which the points are placed; the mean model if not given.
        refine: Whether points are looked for near their places.

    Raises:
        FaceError: There is no upright frontal face that is wholly in the picture.
    """
    height, width = grey.shape
    if min(height, width) < cascades.LEAST_FACE_PX:
        least = cascades.LEAST_FACE_PX
        raise FaceError(
            "too small",
            f"expected a picture of at least {least} x {least} px to find a face in, got {width} x {height}",
        )
    faces = _all_faces(grey, model or mean_model(), refine=refine)
    face = max(faces, key=_merit, default=None)
    if face is None or face.eyes_seen < 2:
        # An inverted face looks a little like an upright one, with one eye at most.
        turned = _turn(grey)
        if turned:
            raise FaceError("not upright", f"expected an upright face, found one {turned}; turn the picture first")
    if face is None:
        raise FaceError("no face", "expected a whole face that looks into the camera, found none in the picture")
    beyond = [name for name, (x, y) in zip(FEATURES, face.points_px, strict=True) if not _within(x, y, width, height)]
    if beyond:
        raise FaceError("cut off", f"expected the whole face in the picture, but {', '.join(beyond)} would be outside")
    several = sum(other.eyes_seen > 0 and other.box[2] >= SIMILAR_SIZE * face.box[2] for other in faces)
    if several > 1:
        crowd = f"{several} faces were found; the largest was taken, draw a box around another one to have that"
        face = replace(face, warnings=(crowd, *face.warnings))
    return face


def spot(grey: NDArray[np.uint8]) -> DetectedFace | None:
    """Return what `detect` would find if it is a whole face with two eyes, without asking what else there may be.

    Args:
        grey: (height, width), 8 bit.
    """
    height, width = grey.shape
    face = max(_all_faces(grey, mean_model(), refine=True), key=_merit, default=None)
    sure = face is not None and face.eyes_seen == 2 and all(_within(x, y, width, height) for x, y in face.points_px)
    return face if sure else None


def in_box(grey: NDArray[np.uint8], box: Box) -> DetectedFace:
    """Return the face in a box that a person has drawn.

    Args:
        grey: (height, width), 8 bit.
        box: Around the face, px.

    Raises:
        FaceError: There is no such face in the box.
    """
    height, width = grey.shape
    x, y, w, h = box
    left, top = max(int(x - BOX_MARGIN * w), 0), max(int(y - BOX_MARGIN * h), 0)
    right, bottom = min(int(x + (1 + BOX_MARGIN) * w), width), min(int(y + (1 + BOX_MARGIN) * h), height)
    face = detect(np.ascontiguousarray(grey[top:bottom, left:right]))
    fx, fy, fw, fh = face.box
    return replace(face, points_px=face.points_px + np.array([left, top]), box=(fx + left, fy + top, fw, fh))


def by_proportion(box: Box) -> NDArray[np.float64]:
    """Return where a mean face that fills a box has its features, (11, 2) px.

    Args:
        box: Around the face, px.
    """
    eyes, _ = _eye_centres(box, [])
    return place(mean_model(), {"reye": eyes[0], "leye": eyes[1]})


def find_again(
    grey: NDArray[np.uint8], last_seen: Box | None = None, model: FaceModel | None = None
) -> DetectedFace | None:
    """Look for a lost face near where it was, then everywhere; None if it is not to be seen.

    Two eyes are asked for, so that a map on the wall is not taken for the driver. It takes 15 to 30 ms, near
    or everywhere: too long for every frame while the face is lost.

    Args:
        grey: (height, width), 8 bit.
        last_seen: The face's box where it was last, px.
        model: By which the points are placed; the mean model if not given.
    """
    height, width = grey.shape
    regions = [((0, 0, width, height), QUICK)]
    if last_seen is not None:
        x, y, w, h = last_seen
        half = NEAR_FACTOR * max(w, h) / 2
        left, top = (min(max(int(edge - half), 0), side) for edge, side in ((x + w / 2, width), (y + h / 2, height)))
        right, bottom = (min(max(int(e + half), 0), side) for e, side in ((x + w / 2, width), (y + h / 2, height)))
        regions.insert(0, ((left, top, right, bottom), NEARBY))
    for (left, top, right, bottom), effort in regions:
        part = np.ascontiguousarray(grey[top:bottom, left:right])
        for x, y, w, h in cascades.faces(part, effort):
            face = _locate(grey, (x + left, y + top, w, h), model or mean_model(), effort, refine=True)
            if face.eyes_seen == 2 and all(_within(u, v, width, height) for u, v in face.points_px):
                return face
    return None


def _all_faces(grey: NDArray[np.uint8], model: FaceModel, *, refine: bool) -> list[DetectedFace]:
    return [_locate(grey, box, model, CLOSE, refine=refine) for box in cascades.faces(grey)]


def _merit(face: DetectedFace) -> tuple[bool, float]:
    """Return by what one face is preferred to another: two eyes, then its size."""
    return face.eyes_seen == 2, face.box[2]


def _locate(grey: NDArray[np.uint8], box: Box, model: FaceModel, effort: Effort, *, refine: bool) -> DetectedFace:
    """Place all points of a face whose box is known."""
    eyes, seen = _eye_centres(box, cascades.eyes(grey, box, effort))
    if seen < 2 and effort is not CLOSE:
        # A quick look misses an eye now and then; a face is worth a second one.
        eyes, seen = _eye_centres(box, cascades.eyes(grey, box, CLOSE))
    warnings: tuple[str, ...] = ()
    if seen < 2:
        what = "one eye was found" if seen else "no eyes were found"
        warnings = (f"{what}, so that the points are placed by proportion; drag them to where they belong",)
    points = place(model, {"reye": eyes[0], "leye": eyes[1]})
    if refine and seen == 2:
        points = refine_points(grey, points, model)
    return DetectedFace(points, box, seen, warnings)


def _eye_centres(face: Box, boxes: list[Box]) -> tuple[list[tuple[float, float]], int]:
    """Return the centres of the right and the left eye, px, and how many of them are among the boxes.

    Of all pairs the one that is most like the eyes of a face is taken; if there is no such pair, the eye that is, and
    the other by the face's proportions.
    """
    x, y, w, h = face
    usual = [(x + across * w, y + down * h) for across, down in EYES_IN_FACE]
    centres = [(a + (c - 1) / 2, b + (d - 1) / 2) for a, b, c, d in boxes]

    def strangeness(found: tuple[float, float], place: tuple[float, float]) -> float:
        return float(np.hypot(found[0] - place[0], found[1] - place[1])) / w

    pairs = [sorted(pair) for pair in combinations(centres, 2)]
    level = [pair for pair in pairs if abs(pair[1][1] - pair[0][1]) < 0.4 * (pair[1][0] - pair[0][0])]
    fitting = [(max(map(strangeness, pair, usual)), pair) for pair in level]
    best = min(fitting, default=None)
    if best is not None and best[0] < 0.16:
        return best[1], 2
    for side in (0, 1):
        near = [centre for centre in centres if strangeness(centre, usual[side]) < 0.12]
        if near:
            off = np.subtract(near[0], usual[side])
            other = (float(usual[1 - side][0] + off[0]), float(usual[1 - side][1] + off[1]))
            return ([near[0], other] if side == 0 else [other, near[0]]), 1
    return usual, 0


def _turn(grey: NDArray[np.uint8]) -> str:
    """Return how a face in the picture has been turned, in words, or nothing if there is none with two eyes."""
    turns = ((cv2.ROTATE_180, "upside down"), (cv2.ROTATE_90_CLOCKWISE, "on its side"))
    for turn, how in (*turns, (cv2.ROTATE_90_COUNTERCLOCKWISE, "on its side")):
        turned = np.asarray(cv2.rotate(grey, turn), np.uint8)
        if any(_eye_centres(box, cascades.eyes(turned, box))[1] == 2 for box in cascades.faces(turned)):
            return how
    return ""


def _within(x: float, y: float, width: int, height: int) -> bool:
    return -0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5
