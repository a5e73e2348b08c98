"""Courses of the simulated driver's head, and what is measured of them.

Bando's protocol: the same video again and again, and only the tracker's random numbers differ.
So one picture is drawn and given to all trials before the next is drawn. The trackers are those of the
experiment `head`, with templates of exactly Bando's sizes. Errors are mean absolute errors of the angles,
wrapped, over all frames after the first.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.angles import wrap
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.experiments.head.scene.motion import SCRIPT_FRAMES
from pftrack.experiments.head.trackers import step as head
from pftrack.experiments.head.trackers.memory import eye_distance
from pftrack.experiments.head.trackers.parameters import AS_PUBLISHED, HeadTrackerParameters
from pftrack.experiments.head.trackers.templates import EYE_DISTANCE_PX
from pftrack.experiments.shared.pose.methods import Method
from pftrack.vision.geometry.face_model import fit_similarity, mean_model, person

__all__ = ["Model", "Trial", "TrialResult", "VideoTrials", "distance_mm", "run_trials"]

Model: TypeAlias = Literal["mean", "individual", "growing"]
"""Which face is assumed: the mean of other people, the driver's own, or one that grows from the mean to that."""

VIDEO_SEED = 0
TURNED_DEG = 20.0
"""The head counts as turned with an axis beyond this (fig. 4.15)."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What is run on a video.

    Attributes:
        method: How to track.
        model: The face that is assumed.
        seed: Of the tracker.
    """

    method: Method
    model: Model
    seed: int


@dataclass(frozen=True, slots=True)
class VideoTrials:
    """A video and all that is run on it.

    Attributes:
        driver: The person's seed.
        trials: What is run.
        frames: How many the script of motions is given; with fewer the head is faster.
    """

    driver: int
    trials: tuple[Trial, ...]
    frames: int = SCRIPT_FRAMES


@dataclass(frozen=True, slots=True)
class TrialResult:
    """What was measured in a trial.

    Attributes:
        trial: What was run.
        errors_deg: (3,) mean absolute error of nod, turn and roll.
        feature_px: Mean distance of the features from the truth.
        ratios: (frames - 1, 11) alpha by which each feature's particles were drawn.
        turned: (frames - 1,) whether the head was turned.
    """

    trial: Trial
    errors_deg: NDArray[np.float64]
    feature_px: float
    ratios: NDArray[np.float64]
    turned: NDArray[np.bool_]

    @property
    def error_deg(self) -> float:
        """Mean of the three angles' errors."""
        return float(self.errors_deg.mean())


def run_trials(work: VideoTrials) -> list[TrialResult]:
    """Show the video once, to all trials at the same time, and measure."""
    scene = revise(HeadSceneParameters(), {"person": work.driver, "speed": SCRIPT_FRAMES / work.frames})
    source, history = HeadSource(VIDEO_SEED, scene), History(((0, scene),))
    first = source.frame(0, history)
    runs = [_Run(trial, source, first) for trial in work.trials]
    angles = []
    for index in range(1, work.frames):
        frame = source.frame(index, history)
        angles.append(_angles(frame))
        for run in runs:
            run.step(frame)
    turned = np.rad2deg(np.abs(angles)).max(axis=1) > TURNED_DEG
    return [run.course(turned) for run in runs]


def distance_mm(driver: int) -> float:
    """Return how far a driver's points are from the mean model's after alignment, root mean square, mm."""
    own, mean = person(driver).points_mm, mean_model().points_mm
    apart = fit_similarity(own, mean)(own) - mean
    return float(np.sqrt(np.square(apart).sum(axis=1).mean()))


class _Run:
    """A trial under way."""

    def __init__(self, trial: Trial, source: HeadSource, first: Frame) -> None:
        landmarks = source.start.landmarks
        if landmarks is None:
            raise RuntimeError("the simulated head knows its features")
        self._trial = trial
        self._parameters = revise(
            HeadTrackerParameters(),
            {
                **AS_PUBLISHED,
                "face_model": "personal" if trial.model == "individual" else trial.model,
                "template_scale": EYE_DISTANCE_PX / eye_distance(landmarks.points_px),
            },
        )
        start = Stream(trial.seed, 0, Purpose.START)
        self._state = head.start(trial.method, source.start, first, self._parameters, start)
        self._errors: list[NDArray[np.float64]] = []
        self._distances_px: list[float] = []
        self._ratios: list[NDArray[np.float64]] = []

    def step(self, frame: Frame) -> None:
        """Take a picture and note how far off the tracker is."""
        missing = (np.nan,) * len(self._state.recognised)
        self._ratios.append(np.asarray(self._state.belief.own_series().get("alpha", missing), dtype=np.float64))
        rng = Stream(self._trial.seed, frame.index, Purpose.TRACK)
        self._state = head.step(self._trial.method, self._state, frame, self._parameters, rng)
        self._errors.append(np.abs(wrap(self._state.estimate - _angles(frame))))
        apart = self._state.feature_means - _features_px(frame)
        self._distances_px.append(float(np.hypot(*apart.T).mean()))

    def course(self, turned: NDArray[np.bool_]) -> TrialResult:
        """Return what was measured."""
        errors = np.rad2deg(np.mean(self._errors, axis=0))
        return TrialResult(self._trial, errors, float(np.mean(self._distances_px)), np.array(self._ratios), turned)


def _angles(frame: Frame) -> NDArray[np.float64]:
    if frame.target is None:
        raise RuntimeError("the simulated head knows its pose")
    return frame.target.position


def _features_px(frame: Frame) -> NDArray[np.float64]:
    if frame.target is None or frame.target.landmarks is None:
        raise RuntimeError("the simulated head knows its features")
    return frame.target.landmarks.points_px
