"""A recording of a face, wired for tracking its pose.

The face is found by detection, unless a person has drawn a box around it or marked its features. Nothing is known of
the camera or the person: the focal length is taken to be the picture's width, and the face to be the mean one, or on
request the mean one stretched over the features of the first picture. All lengths in px follow the size of the face, so
that a large picture of a face is tracked as a small one is, and what may happen between two pictures follows the time
between them.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Landmarks, Target
from pftrack.core.model.marks import Box, Mark
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.truth import Truth
from pftrack.experiments.experiment import Setup
from pftrack.experiments.head.marks import FacePoints
from pftrack.experiments.head.start import first_face
from pftrack.experiments.head.trackers.first_sight import camera_of
from pftrack.experiments.head.trackers.memory import around, eye_distance
from pftrack.experiments.head.trackers.parameters import HeadTrackerParameters
from pftrack.experiments.head.trackers.templates import EYE_DISTANCE_PX
from pftrack.experiments.head.truth import PoseTable
from pftrack.sources.recording import RecordingParameters, RecordingSource, check_start
from pftrack.vision.detection.face import in_box
from pftrack.vision.geometry.face_model import FEATURES, FaceModel, fit_similarity, mean_model, place
from pftrack.vision.likelihoods.template import luma

__all__ = ["RecordedHeadParameters", "defaults", "face_at", "on_video"]

FRAME_RATE_HZ = 30.0
"""Of Bando's pictures, for which its noise of motion was chosen."""


class RecordedHeadParameters(RecordingParameters, HeadTrackerParameters):
    """A recording with an overlay, and its trackers."""


def on_video(sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None) -> Setup:
    """Wire a recording.

    Args:
        sequence: The pictures.
        mark: In the picture `start`: a box around the face, or at least two of its features, of which the others are
            placed by the model; None to have the face found.
        start: Number of the picture to start at; if the face has to be found, to look for it from.
        truth: True poses by number of the picture, where they are known.

    Raises:
        ParameterError: The mark or the start is not within the recording, or a point is unknown.
        ValueError: There is no face, or the points make none.
    """
    check_start(start, sequence)
    if mark is not None:
        mark.check(sequence.size)
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

    # The face where it was found: it is not looked for again when the run is made again.
    footage = Footage.of(sequence, FacePoints.model_validate({"points": _points_by_name(found)}), first, truth)
    return Setup(open_source, defaults(found, sequence.frame_rate_hz), footage)


def defaults(points: NDArray[np.float64], frame_rate_hz: float) -> RecordedHeadParameters:
    """Return the defaults for a recording of so many pictures a second, in the first of which a face is here.

    Args:
        points: (11, 2) its features, px; they say how large it is, relative to Bando's.
        frame_rate_hz: Of the recording.
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


def _points_by_name(points: NDArray[np.float64]) -> dict[str, list[float]]:
    return {name: position.tolist() for name, position in zip(FEATURES, points, strict=True)}


def _check_points(points: NDArray[np.float64], size: tuple[int, int]) -> None:
    for name, (x, y) in zip(FEATURES, points, strict=True):
        if not (-0.5 <= x < size[0] - 0.5 and -0.5 <= y < size[1] - 0.5):
            raise ValueError(
                f"all features must lie within the picture of {size[0]} x {size[1]} px, got {name} at {x:.1f}, {y:.1f}"
            )


def face_at(points: NDArray[np.float64]) -> Target:
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


def _clip(points: NDArray[np.float64], size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the box around a face, cut to the picture."""
    x, y, w, h = around(points)
    left, top = min(max(x, 0.0), size[0] - 1.0), min(max(y, 0.0), size[1] - 1.0)
    return left, top, max(min(x + w, size[0]) - left, 1.0), max(min(y + h, size[1]) - top, 1.0)
