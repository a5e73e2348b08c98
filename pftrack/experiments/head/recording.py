"""A recording of a face, wired for tracking its pose: mark, detection and suitability of the face, and its truth.

The face is found by detection, unless the user has drawn a box around it or marked its features. The camera and the
person are unknown: the focal length is taken to be the picture's width, and the face to be the mean one, or on request
the mean one stretched over the features of the first picture. All lengths in px follow the size of the face, so large
and small pictures of a face are tracked alike, and the motion between two pictures follows the time between them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.marks import Box, FeaturePoints, Mark
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import WELL, Finder, Setup, Sighting, Suitability, grade
from pftrack.core.model.source import FrameSequence, Landmarks, Target, Truth
from pftrack.core.numerics.elementary import wrap
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.head.appearance import EYE_DISTANCE_PX, around
from pftrack.experiments.head.detection import DetectedFace, by_proportion, detect, eye_distance, in_box, spot
from pftrack.experiments.head.first_sight import camera_of
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource, frames_to_search
from pftrack.sources.truth import Form, TruthKind, read_table
from pftrack.vision.face import FEATURES, LINKS, TITLES, FaceModel, fit_similarity, mean_model, place, theta_of
from pftrack.vision.likelihoods.template import luma


class FacePoints(FeaturePoints):
    """The eleven features of a face, or some of them; the others are placed by the model."""

    title: ClassVar[str] = "Features of the face"
    features: ClassVar[Mapping[str, str]] = TITLES
    joined: ClassVar[tuple[tuple[str, str], ...]] = LINKS


class FaceBox(Box):
    """A box around a face."""

    title: ClassVar[str] = "Box around the face"
    instruction: ClassVar[str] = "Draw a box from the hair to the chin and from ear to ear."

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the box around the whole face: its features leave out hair, chin and ears."""
        if target.landmarks is None:
            return None
        x, y, width, height = around(target.landmarks.points_px)
        return cls.of(x, y, width, height)


LOOKS_A_SECOND = 10
"""Number of pictures searched for a frontal face, within a second of the first one from the side."""

MOST_SEARCHED = 200
"""Pictures in all, of 0.1 s each."""

to_search = partial(frames_to_search, closely=50, most=MOST_SEARCHED)


def search(sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
    """Search for a face in one picture after the other; the error explains the first picture's problem."""
    for index, frame in enumerate(frames):
        grey = luma(sequence.picture(frame))
        if index == 0 or spot(grey) is not None:
            try:
                yield _sighting(frame, detect(grey))
            except RefusedError as error:
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
    except RefusedError:
        points = _points(by_proportion(box).clip(0.0, np.array(sequence.size) - 1.0))
        remark = "no face was recognised in the box; drag the points of a mean face to where they belong"
        return Sighting(frame, points, placed=_handles(FEATURES), remarks=(remark,))


def first_face(sequence: FrameSequence, start: int) -> tuple[int, Floats]:
    """Return the number of the first picture with a face from one on, and its features (11, 2) px.

    It is the first one, or a better start soon after it.

    Raises:
        RefusedError: No picture shows one; the sentence explains the problem of the picture `start`.
    """
    refused = "expected a face with two eyes, found none"
    for sighting in search(sequence, to_search(start, sequence.frame_count - 1)):
        if sighting.sure:
            found = better(sequence, sighting)
            assert isinstance(found.mark, FacePoints)  # noqa: S101 - no other kind is found
            return found.frame, np.array([found.mark.points[name] for name in FEATURES])
        if sighting.frame == start and sighting.mark is None:
            refused = sighting.remarks[0]
    raise RefusedError(f"{refused}; mark its features or its box")


def _sighting(frame: int, face: DetectedFace) -> Sighting:
    aside = "the face looks aside; a picture in which it looks into the camera is a better start"
    remarks = (*face.warnings, aside) if face.eyes_seen == 2 and face.aside else face.warnings
    sure = len(face.placed) < len(FEATURES)
    return Sighting(frame, _points(face.points_px), sure, _handles(face.placed), remarks)


def _points(points: Floats) -> FacePoints:
    return FacePoints(points={name: (float(x), float(y)) for name, (x, y) in zip(FEATURES, points, strict=True)})


def _handles(names: Sequence[str]) -> tuple[str, ...]:
    """Return what an editor calls the handles of these points."""
    return tuple(f"points.{name}" for name in names)


FINDER = Finder(to_search, search, better, FacePoints, within, hints=(FaceBox,))

# The truth is a table of poses, one a frame, with the columns `frame, yaw_deg, pitch_deg, roll_deg` and the signs of
# `pftrack.vision.face.gaze`.

POSE_FORM = Form(("frame", "yaw_deg", "pitch_deg", "roll_deg"), "pose", "poses", 360.0, "degrees")


@dataclass(frozen=True)
class PoseTable:
    """The true poses of a clip.

    Attributes:
        poses: Yaw, pitch and roll in degrees by frame number; a frame without truth is missing.
        warnings: What was skipped in reading, one sentence each.
        zero: Frame whose pose counts as none: what is estimated is relative to a frame, and so is the truth.
    """

    poses: Mapping[int, tuple[float, float, float]]
    warnings: tuple[str, ...] = field(default=())
    zero: int | None = None

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The poses."""
        return self.poses

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame, its pose less that of frame `zero`, or None without a truth."""
        pose = self.poses.get(frame)
        if pose is None:
            return None
        first = (0.0, 0.0, 0.0) if self.zero is None else self.poses[self.zero]
        return Target(position=theta_of(wrap(np.deg2rad(np.subtract(pose, first)))))


def read_poses(path: Path, first_frame: int | None = None) -> PoseTable:
    """Read a table of true poses.

    Args:
        path: A comma-separated file with the columns frame, yaw_deg, pitch_deg, roll_deg and any others.
        first_frame: Number of its first frame; 0 if not given.

    Raises:
        RefusedError: The file is missing, is not such a table, or has a wrong line.
    """
    rows, warnings = read_table(path, POSE_FORM, first_frame)
    poses = {frame: (yaw, pitch, roll) for frame, (yaw, pitch, roll) in rows.items()}
    return PoseTable(MappingProxyType(poses), warnings)


POSES = TruthKind(POSE_FORM, read_poses, PoseTable)

FRAME_RATE_HZ = 30.0
"""Frame rate of Bando's pictures, for which the noise of motion was chosen."""


class RecordedHeadParameters(RecordingParameters, HeadTrackerParameters):
    """A recording with an overlay, and its trackers."""


def wire(sequence: FrameSequence, mark: Mark | None, start: int, truth: Truth | None) -> Setup:
    """Wire a recording.

    Args:
        sequence: The pictures.
        mark: Mark in the picture `start`: a box around the face, or at least two of its features; the model places the
            others; None to have the face found.
        start: Number of the picture to start at; if the face has to be found, to look for it from.
        truth: True poses by number of the picture, where they are known.

    Raises:
        ValueError: The frame has no face, or the points do not form one.
    """
    first = start
    if isinstance(mark, FacePoints):
        found = place(mean_model(), mark.points)
        for name, position in mark.points.items():
            found[FEATURES.index(name)] = position
    elif isinstance(mark, Box):
        found = in_box(luma(sequence.picture(start)), mark.corner_and_size).points_px
    else:
        first, found = first_face(sequence, start)
    _check_points(found, sequence.size)
    size = eye_distance(found) / EYE_DISTANCE_PX
    if size <= 0.0:
        raise ValueError("the two eyes must be marked at different places")
    camera_of(mean_model(), found)
    target = face_at(found)
    known = _relative(truth, first, sequence.frame_count)

    def open_source(seed: int, parameters: RecordedHeadParameters) -> RecordingSource:
        del seed, parameters
        return RecordingSource(sequence, _clip(found, sequence.size), first, known.at if known else None, start=target)

    # The place of the found face, so repeating the run does not search again.
    footage = Footage.of(sequence, _points(found), first, truth)
    return Setup(open_source, defaults(found, sequence.frame_rate_hz), footage)


def defaults(points: Floats, frame_rate_hz: float) -> RecordedHeadParameters:
    """Return the defaults for a recording with this frame rate and a face at these points in its first picture.

    Args:
        points: (11, 2) its features, px, which give its size relative to Bando's.
        frame_rate_hz: Frame rate of the recording.
    """
    size = eye_distance(points) / EYE_DISTANCE_PX
    motion = size * min(max(FRAME_RATE_HZ / frame_rate_hz, 0.5), 3.0)
    return revise(
        RecordedHeadParameters(),
        {
            "focal_widths": 1.0,
            "feature_noise_px": min(max(5.0 * motion, 0.5), 50.0),
            "sd_floor_px": min(max(0.5 * size, 0.2), 20.0),
            "initial_sd_px": min(max(size, 0.2), 50.0),
            "camera_noise": min(max(motion, 0.05), 20.0),
            # A change of speed between two pictures grows with the square of the time between them; degrees and mm do
            # not follow the size of the face.
            "pose_change_noise": min(max((FRAME_RATE_HZ / frame_rate_hz) ** 2, 0.25), 20.0),
            "slack_px": min(max(8.0 * size, 0.5), 100.0),
            "initial_speed_px": min(8.0 * motion, 100.0),
            "find_again": True,
        },
    )


def _check_points(points: Floats, size: tuple[int, int]) -> None:
    for name, (x, y) in zip(FEATURES, points, strict=True):
        if not (-0.5 <= x < size[0] - 0.5 and -0.5 <= y < size[1] - 0.5):
            raise ValueError(
                f"all features must lie within the picture of {size[0]} x {size[1]} px, got {name} at {x:.1f}, {y:.1f}"
            )


def face_at(points: Floats) -> Target:
    """Return a face whose features (11, 2) px are here, with the mean face stretched over them as its own."""
    model = mean_model().points_mm
    flat = fit_similarity(points, model[:, :2])(points)
    own = FaceModel(np.column_stack([flat, model[:, 2]])).points_mm
    landmarks = Landmarks(points, np.ones(len(points), np.bool_), own, FEATURES)
    return Target(np.zeros(3), float(np.ptp(points, axis=0).max()), landmarks=landmarks)


def _relative(truth: Truth | None, first: int, count: int) -> PoseTable | None:
    """Return the truth less that of the first picture used, or of the first later one that has any."""
    if truth is None:
        return None
    if not isinstance(truth, PoseTable):
        raise ValueError(  # noqa: TRY004 - a person has given it
            "expected the truth of a head as a table of poses, got a table of boxes"
        )
    zero = min((frame for frame in truth.poses if first <= frame < count), default=None)
    return replace(truth, zero=zero)


def _clip(points: Floats, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the box around a face, cut to the picture."""
    x, y, w, h = around(points)
    left, top = min(max(x, 0.0), size[0] - 1.0), min(max(y, 0.0), size[1] - 1.0)
    return left, top, max(min(x + w, size[0]) - left, 1.0), max(min(y + h, size[1]) - top, 1.0)


# The limits are those at which the tracker was measured to get worse on a real clip of a turning head, made smaller,
# darker and flatter step by step (`docs/reference/measures.md` has the figures). A face is as suitable as the worst of
# its size, its light and its angle.

LEAST_EYES_PX, GOOD_EYES_PX = 7.5, 15.0
"""Distance of the eyes: at 7 px the finder no longer finds a face, below 12 px the error doubles."""

LEAST_CONTRAST, GOOD_CONTRAST = 3.0, 12.0
"""Standard deviation of the face's grey levels: at 2.5 the features are lost in the camera's noise, below 12 they are
tracked, but the finder does not recognise the face."""

ASIDE, ONE_EYE, UNKNOWN = 0.45, 0.35, 0.4
"""Suitability of a face that looks aside, of one with one visible eye, and of one that the finder does not
recognise."""

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
        parameters: Parameters of frame 0.
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


def _size(points: Floats) -> _Reason:
    distance = eye_distance(points)
    return _Reason(
        grade(distance, LEAST_EYES_PX, GOOD_EYES_PX),
        f"the eyes are {distance:.0f} px apart",
        f"a larger face, its eyes at least {GOOD_EYES_PX:.0f} px apart, would help",
    )


def _light(grey: NDArray[np.uint8], points: Floats) -> _Reason:
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


def _angle(grey: NDArray[np.uint8], points: Floats) -> _Reason:
    try:
        face: DetectedFace | None = in_box(grey, around(points))
    except RefusedError:
        face = None
    if face is None or not face.eyes_seen:
        missing = "the finder does not recognise it, so it cannot be found again once lost"
        return _Reason(UNKNOWN, missing, "a picture in which the face looks into the camera, well lit, would help")
    if face.eyes_seen == 1:
        return _Reason(ONE_EYE, "one eye is seen", "a picture in which both eyes are seen would help")
    if face.aside:
        return _Reason(ASIDE, "it looks aside", "a picture in which it looks into the camera would help")
    return _Reason(1.0, "it looks into the camera", "")
