"""Detection of a face's eleven features in a first picture, and of a lost face.

Cascades find the face and its eyes; all other points are placed by the mean model, by the similarity that brings its
eyes onto those found, and then refined nearby. The result is a proposal: a user may drag any point to its place, so a
doubtful result has warnings rather than being refused. A picture without a face, or with one that is cut off or not
upright, gives no proposal.
"""

import threading
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.refusal import RefusedError
from pftrack.vision.face import FEATURES, FaceModel, Similarity, fit_similarity, mean_model, place

# The cascades are those of Viola and Jones (Bando 2007, ch. 4 section 4; OpenCV's stock files). A face is searched in a
# reduced picture, an eye in a face of standard size, so the time does not depend on the size of the picture.

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
    """The effort of the search.

    Attributes:
        picture_side_px: Longer side of the picture in which faces are searched.
        face_step: Factor from one size of face to the next.
        face_side_px: Side of the face in which eyes are searched.
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
"""For a part of a picture, twice the size of the face: some 15 ms."""

Cascade: TypeAlias = Literal["frontalface_alt2", "eye_tree_eyeglasses", "eye"]

_of_thread = threading.local()
"""A cascade stores its work in itself, so two threads may not share one."""


def faces(grey: NDArray[np.uint8], effort: Effort = CLOSE) -> list[Box]:
    """Return the boxes of all upright frontal faces in a picture, the largest first.

    Args:
        grey: (height, width).
        effort: The effort of the search.
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


def find_eyes(grey: NDArray[np.uint8], face: Box, effort: Effort = CLOSE) -> list[Box]:
    """Return the boxes of what look like eyes in the upper part of a face.

    Args:
        grey: (height, width).
        face: The box of the face.
        effort: The effort of the search.
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


# To refine the points, the face is brought upright and to one scale, so that all lengths below are mm on the mean face.
# Then each feature is searched within the variation of people, by its look on any face: the irises are dark discs; the
# mouth is a dark line, and its corners are the line's ends; the nostrils are a pair of dark spots, which show the lower
# end of the nose; the outer corner of an eye is the end of the upper lid's dark arc, and a brow ends in brighter skin.
# Inner corners of the eyes stay where the model puts them, which is as near as anything found there.
#
# Over simulated frontal faces of 23 people the mean distance from the truth falls, in per cent of the distance between
# the eyes, from 3 to 1 at the irises, from 6 to 2 at the nose, from 7 to 2 at the mouth, from 4 to 2 at the outer
# corners and from 5 to 2 at the brows.

PLACED = ("lmc", "rmc")
"""The inner corners of the eyes are not searched."""

PX_PER_MM = 1.6
LEFT_MM, TOP_MM, WIDTH_MM, HEIGHT_MM = -75.0, -50.0, 150.0, 160.0

NOSTRILS_BELOW_TIP_MM, NOSTRILS_ABOVE_MOUTH_MM = 9.0, 10.0
NOSE_SHARE = np.array([1.0, 0.7])
"""Share of the nostrils' displacement that the tip follows: on a face seen from below they are higher, the tip less
so."""

DISTANCE_COST = 0.3
"""Weight lost by a response at the rim of the region, relative to its middle."""

Map = NDArray[np.float32]
Grid = Floats
Point = Floats


def refine_points(grey: NDArray[np.uint8], points: Floats, model: FaceModel) -> Floats:
    """Return points (11, 2) moved to their features, px.

    Args:
        grey: (height, width).
        points: (11, 2) as the model puts them, px.
        model: The face.
    """
    face, to_picture = _upright(grey, points, model)
    eyes = {name: _nearest(face, model[name][:2], _iris(), (4.5, 3.5)) for name in ("leye", "reye")}
    points = place(model, {name: tuple(to_picture(at[None])[0]) for name, at in eyes.items()})
    face, to_picture = _upright(grey, points, model)
    local = {name: model[name][:2] for name in FEATURES}
    middle = (local["lmou"] + local["rmou"]) / 2.0
    shift = _nearest(face, middle, _mouth(), (3.0, 10.0)) - middle
    for prefix, side in (("l", 1.0), ("r", -1.0)):
        mouth, outer, brow = (prefix + name for name in ("mou", "lc", "bro"))
        local[mouth] = _nearest(face, local[mouth] + shift, _corner(side), (5.0, 5.0))
        local[outer] = _nearest(face, local[outer], _lid(side), (7.0, 4.0))
        local[brow] = _nearest(face, local[brow], _brow(side), (5.0, 6.0))
    # The line of the mouth is as dark as the nostrils, but they are well above it.
    nostrils = local["nose"] + (0.0, NOSTRILS_BELOW_TIP_MM)
    room = (local["lmou"][1] + local["rmou"][1]) / 2.0 - NOSTRILS_ABOVE_MOUTH_MM
    moved = _nearest(face, nostrils, _nostrils(), (8.0, 16.0), lowest_mm=room)
    local["nose"] = local["nose"] + NOSE_SHARE * (moved - nostrils)
    return to_picture(np.array([local[name] for name in FEATURES]))


def _upright(grey: NDArray[np.uint8], points: Floats, model: FaceModel) -> tuple[Map, Similarity]:
    """Return the face at PX_PER_MM in the model's frame, and the map from mm to the picture's px."""
    to_picture = fit_similarity(model.points_mm[:, :2], points)
    step = to_picture.scale * to_picture.rotation / PX_PER_MM
    origin = to_picture(np.array([[LEFT_MM, TOP_MM]]))[0]
    size = (round(WIDTH_MM * PX_PER_MM), round(HEIGHT_MM * PX_PER_MM))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    face = cv2.warpAffine(grey, np.column_stack([step, origin]), size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(face, np.float32), to_picture


def _nearest(
    face: Map, start: Point, kernel: Map, reach_mm: tuple[float, float], *, lowest_mm: float = np.inf
) -> Point:
    """Return the place of a kernel's largest response within an ellipse, mm; distant responses count less.

    Args:
        face: Result of `_upright`.
        start: (2,) in mm.
        kernel: Pattern to find.
        reach_mm: Half axes of the ellipse.
        lowest_mm: Largest y of the search.
    """
    half = kernel.shape[0] // 2
    middle = (start - (LEFT_MM, TOP_MM)) * PX_PER_MM
    most = np.array(face.shape)[::-1] - 1 - half
    left, top = np.clip(np.rint(middle - np.array(reach_mm) * PX_PER_MM).astype(int), half, most)
    right, bottom = np.clip(np.rint(middle + np.array(reach_mm) * PX_PER_MM).astype(int), half, most)
    # Correlation where the kernel lies wholly within the part: one answer a pixel of the region.
    part = face[top - half : bottom + half + 1, left - half : right + half + 1]
    response = cv2.matchTemplate(part, kernel, cv2.TM_CCORR)
    rows, columns = np.indices(response.shape)
    x, y = LEFT_MM + (left + columns) / PX_PER_MM, TOP_MM + (top + rows) / PX_PER_MM
    away = ((x - start[0]) / reach_mm[0]) ** 2 + ((y - start[1]) / reach_mm[1]) ** 2
    allowed = (away <= 1.0) & (y <= lowest_mm)
    if not allowed.any():
        return start
    score = np.where(allowed, response * (1.0 - DISTANCE_COST * away), -np.inf)
    row, column = np.unravel_index(int(np.argmax(score)), score.shape)
    return np.array([x[row, column], y[row, column]])


@cache
def _iris() -> Map:
    """Return a kernel that answers to a dark disc in a brighter ring, flat as the opening of an eye."""
    x, y = _grid(9.0)
    return _kernel(np.hypot(x, y) < 5.5, np.hypot(x, 1.6 * y) < 9.0)


@cache
def _nostrils() -> Map:
    """Return a kernel that answers to two dark spots side by side."""
    x, y = _grid(14.0)
    return _kernel(np.hypot(np.abs(x) - 7.0, y) < 2.4, (np.abs(x) < 13.0) & (np.abs(y) < 5.5))


@cache
def _mouth() -> Map:
    """Return a kernel that answers to a dark horizontal line."""
    x, y = _grid(20.0)
    near, beside = np.abs(x) < 17.0, (np.abs(y) > 3.0) & (np.abs(y) < 7.0)
    return _kernel(near & (np.abs(y) < 1.2), near & beside)


@cache
def _corner(side: float) -> Map:
    """Return a kernel that answers to the end of a dark horizontal line, outwards on the side of x's sign."""
    x, y = _grid(10.0)
    out = side * x
    line = (out > -8.0) & (out < 0.5) & (np.abs(y) < 1.3)
    return _kernel(line, (np.hypot(x, y) < 8.0) & ((np.abs(y) > 2.5) | (out > 2.0)))


@cache
def _lid(side: float) -> Map:
    """Return a kernel that answers to the outer end of the upper lid's dark arc."""
    x, y = _grid(10.0)
    out = side * x
    off = np.abs(y + 5.0 * np.sqrt(1.0 - np.clip(1.0 + out / 14.0, 0.0, 1.0) ** 2))
    beside = (out > -9.0) & (out < 5.0) & (off > 2.0) & (off < 5.0)
    beyond = (np.abs(y) < 2.0) & (out > 1.0) & (out < 6.0)
    return _kernel((out > -9.0) & (out < 0.5) & (off < 1.2), beside | beyond)


@cache
def _brow(side: float) -> Map:
    """Return a kernel that answers to the inner end of a brow; the eye's shadow below it is left out."""
    x, y = _grid(12.0)
    out, off = side * x, y + 0.25 * side * x
    around = (out > -6.0) & (out < 11.0) & (np.abs(y) < 9.0)
    return _kernel((out > 0.5) & (out < 11.0) & (np.abs(off) < 3.0), around & ((off < -5.0) | (out < -1.0)) & (y < 5.0))


def _grid(reach_mm: float) -> tuple[Grid, Grid]:
    """Return x and y of a kernel's elements, mm."""
    half = int(np.ceil(reach_mm * PX_PER_MM))
    steps = np.arange(-half, half + 1) / PX_PER_MM
    x, y = np.meshgrid(steps, steps)
    return x, y


def _kernel(dark: Bools, bright: Bools) -> Map:
    """Return the mean over a bright region less the mean over a dark one, as a kernel."""
    around = bright & ~dark
    return np.asarray(around / around.sum() - dark / dark.sum(), np.float32)


EYES_IN_FACE = ((0.315, 0.40), (0.685, 0.40))
"""Places of the eyes in a face's box, as shares of its sides; the person's right eye first, left in the picture."""

NEAR_FACTOR = 2.2
"""Side of the square in which a lost face is first searched, in sizes of the face."""

SIMILAR_SIZE = 0.5
"""A second face counts as such if it is at least so large relative to the largest."""

ASIDE = 0.06
"""The eyes of a face that looks aside are further than this off the middle of its box, in distances of the eyes: about
10 degrees of yaw on real faces, where it grows by 0.006 a degree."""

BOX_MARGIN = 0.3
"""A box around a face is made larger by this share on each side: the cascades want some of what is around it."""


@dataclass(frozen=True, slots=True, eq=False)
class DetectedFace:
    """A face found in a picture.

    Attributes:
        points_px: (11, 2) the features, in the order of `pftrack.vision.face.FEATURES`.
        box: Box of the whole face, px.
        eyes_seen: Number of eyes that the cascades found; the others are placed by proportion.
        warnings: Points to check, one sentence each.
    """

    points_px: Floats
    box: Box
    eyes_seen: int
    warnings: tuple[str, ...] = ()

    @property
    def aside(self) -> bool:
        """Whether it looks aside, so its points differ from those of a frontal face."""
        middle = sum(float(self.points_px[FEATURES.index(name), 0]) for name in ("leye", "reye")) / 2.0
        return abs(self.box[0] + self.box[2] / 2.0 - middle) > ASIDE * eye_distance(self.points_px)

    @property
    def placed(self) -> tuple[str, ...]:
        """Names of the points that the model has placed rather than the picture shown."""
        return PLACED if self.eyes_seen == 2 else FEATURES


def eye_distance(points_px: Floats) -> float:
    """Return the distance between the eyes among points (11, 2), px."""
    left, right = (points_px[FEATURES.index(name)] for name in ("leye", "reye"))
    return float(np.hypot(*(left - right)))


def detect(grey: NDArray[np.uint8]) -> DetectedFace:
    """Find the face to be tracked: the largest of those with two eyes, or else the largest.

    Args:
        grey: (height, width), 8 bit.

    Raises:
        RefusedError: The picture does not show a whole upright face from the front.
    """
    height, width = grey.shape
    if min(height, width) < LEAST_FACE_PX:
        least = LEAST_FACE_PX
        raise RefusedError(
            f"expected a picture of at least {least} x {least} px to find a face in, got {width} x {height}",
        )
    faces = _all_faces(grey)
    face = max(faces, key=_merit, default=None)
    if face is None or face.eyes_seen < 2:
        # An inverted face looks a little like an upright one, with one eye at most.
        turned = _turn(grey)
        if turned:
            raise RefusedError(f"expected an upright face, found one {turned}; turn the picture first")
    if face is None:
        raise RefusedError("expected a whole face that looks into the camera, found none in the picture")
    beyond = [name for name, (x, y) in zip(FEATURES, face.points_px, strict=True) if not _within(x, y, width, height)]
    if beyond:
        raise RefusedError(f"expected the whole face in the picture, but {', '.join(beyond)} would be outside")
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
    face = max(_all_faces(grey), key=_merit, default=None)
    sure = face is not None and face.eyes_seen == 2 and all(_within(x, y, width, height) for x, y in face.points_px)
    return face if sure else None


def in_box(grey: NDArray[np.uint8], box: Box) -> DetectedFace:
    """Return the face in a box that a person has drawn.

    Args:
        grey: (height, width), 8 bit.
        box: Around the face, px.

    Raises:
        RefusedError: The box does not hold such a face.
    """
    height, width = grey.shape
    x, y, w, h = box
    left, top = max(int(x - BOX_MARGIN * w), 0), max(int(y - BOX_MARGIN * h), 0)
    right, bottom = min(int(x + (1 + BOX_MARGIN) * w), width), min(int(y + (1 + BOX_MARGIN) * h), height)
    face = detect(np.ascontiguousarray(grey[top:bottom, left:right]))
    fx, fy, fw, fh = face.box
    return replace(face, points_px=face.points_px + np.array([left, top]), box=(fx + left, fy + top, fw, fh))


def by_proportion(box: Box) -> Floats:
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

    Two eyes are required, so a map on the wall is not taken for the driver. It takes 15 to 30 ms, near or everywhere:
    too long for every frame while the face is lost.

    Args:
        grey: (height, width), 8 bit.
        last_seen: The face's box where it was last, px.
        model: Model that places the points; by default the mean model.
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
        for x, y, w, h in faces(part, effort):
            face = _locate(grey, (x + left, y + top, w, h), model or mean_model(), effort)
            if face.eyes_seen == 2 and all(_within(u, v, width, height) for u, v in face.points_px):
                return face
    return None


def _all_faces(grey: NDArray[np.uint8]) -> list[DetectedFace]:
    return [_locate(grey, box, mean_model(), CLOSE) for box in faces(grey)]


def _merit(face: DetectedFace) -> tuple[bool, float]:
    """Return by what one face is preferred to another: two eyes, then its size."""
    return face.eyes_seen == 2, face.box[2]


def _locate(grey: NDArray[np.uint8], box: Box, model: FaceModel, effort: Effort) -> DetectedFace:
    """Place all points of a face whose box is known."""
    eyes, seen = _eye_centres(box, find_eyes(grey, box, effort))
    if seen < 2 and effort is not CLOSE:
        # A quick look misses an eye now and then; a face is worth a second one.
        eyes, seen = _eye_centres(box, find_eyes(grey, box, CLOSE))
    warnings: tuple[str, ...] = ()
    if seen < 2:
        what = "one eye was found" if seen else "no eyes were found"
        warnings = (f"{what}, so the points are placed by proportion; drag them to where they belong",)
    points = place(model, {"reye": eyes[0], "leye": eyes[1]})
    if seen == 2:
        points = refine_points(grey, points, model)
    return DetectedFace(points, box, seen, warnings)


def _eye_centres(face: Box, boxes: list[Box]) -> tuple[list[tuple[float, float]], int]:
    """Return the centres of the right and the left eye, px, and the number of eyes among the boxes.

    The pair most similar to the eyes of a face is chosen; without such a pair, a single eye, and the other one by the
    face's proportions.
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
        if any(_eye_centres(box, find_eyes(turned, box))[1] == 2 for box in faces(turned)):
            return how
    return ""


def _within(x: float, y: float, width: int, height: int) -> bool:
    return -0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5
