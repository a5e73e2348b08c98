"""One-pass evaluation (OPE) by Wu, Lim and Yang, "Online object tracking: a benchmark" (2013).

A tracker is given the true box of the first picture and nothing after it. The success curve says in what share of the
frames the box of the tracker overlaps the true one by more than a threshold; the figure that trackers are ranked by is
the area under it, the mean over the 21 thresholds 0, 0.05, ..., 1. Precision is the share of frames whose centre is
within 20 px of the true one. The first frame counts, as it does there.
"""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.evaluation.sequences import BenchmarkError, BenchmarkSequence
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES, EvaluatedRun, Measure, evaluate
from pftrack.core.model.parameters import Value
from pftrack.core.model.timeline import Change
from pftrack.experiments.experiment import Experiment, Setup
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run, extent_series
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable

__all__ = ["PRECISION", "SUCCESS", "Score", "evaluate_sequence", "follows_boxes"]

THRESHOLDS = np.arange(21) / 20.0
GREY_LEVELS = 3.0
"""Channels of a picture that differ by less on average are those of a grey one, after compression."""


def _success(course: EvaluatedRun) -> NDArray[np.float64]:
    """Return at what share of the thresholds a frame is a success, (L,)."""
    overlap = MEAN_IOU.frames(course)
    shares = (overlap[:, None] > THRESHOLDS).mean(axis=1)
    return np.where(np.isnan(overlap), np.nan, shares)


SUCCESS = Measure(
    "success_auc",
    "Success",
    "Area under the curve of the share of labelled frames whose overlap is above a threshold, at 21 from 0 to 1.",
    "mean",
    _success,
    source="Wu, Lim, Yang, Online object tracking: a benchmark, 2013",
)

PRECISION = next(measure for measure in PICTURE_MEASURES if measure.name == "precision_20px")


@dataclass(frozen=True, slots=True)
class Score:
    """What a tracker came to on a sequence, over all seeds.

    Attributes:
        name: Of the sequence.
        frames: How many there are.
        grey: Whether its pictures have no colours.
        success: Area under the success curve, of each seed.
        precision: Share of frames within 20 px, of each seed.
        frames_per_second: Of the tracker alone, the first frames left out: the median over all.
    """

    name: str
    frames: int
    grey: bool
    success: tuple[float, ...]
    precision: tuple[float, ...]
    frames_per_second: float

    def as_dict(self) -> dict[str, object]:
        """Return the score as JSON values."""
        return {
            "name": self.name,
            "frames": self.frames,
            "grey": self.grey,
            "success": list(self.success),
            "precision": list(self.precision),
            "success_mean": fmean(self.success),
            "precision_mean": fmean(self.precision),
            "frames_per_second": self.frames_per_second,
        }


def follows_boxes(experiment: Experiment) -> bool:
    """Return whether an experiment takes a box on a recording and believes in one, which overlap needs."""
    believed = extent_series(experiment.all_series()) is not None
    return experiment.on_video is not None and Box in experiment.marks and believed


def evaluate_sequence(
    experiment: Experiment,
    sequence: BenchmarkSequence,
    *,
    tracker: str | None = None,
    seeds: int = 1,
    values: Callable[[Setup], Mapping[str, Value]] = lambda _: {},
    on_run: Callable[[], None] = lambda: None,
) -> Score:
    """Track through a sequence from its first box on, once for each seed.

    Args:
        experiment: Of a target with a box.
        sequence: The sequence.
        tracker: By name; the experiment's own if not given.
        seeds: How many; they are 0, 1, 2, ...
        values: Setup -> values of parameters that are not those with which a recording begins.
        on_run: Called after each run.

    Raises:
        BenchmarkError: The tracker believes in no box, or the pictures do not fit the boxes.
        SourceError: The pictures cannot be read.
        ParameterError: The experiment refuses the box or a value.
    """
    if experiment.on_video is None or Box not in experiment.marks:
        raise BenchmarkError(f"{experiment.id} follows no box on recordings")
    with closing(open_sequence(sequence.pictures)) as pictures:
        last = sequence.start + sequence.frames
        if pictures.frame_count < last:
            raise BenchmarkError(f"{sequence.name} has boxes for {last} pictures, got {pictures.frame_count} pictures")
        mark = _within(sequence.boxes[sequence.start], pictures.size)
        setup = experiment.on_video(pictures, mark, start=sequence.start, truth=TruthTable(sequence.boxes))
        changes = (Change(0, dict(values(setup))),)
        success, precision, step_ms = [], [], []
        for seed in range(seeds):
            run = Run(experiment, setup, tracker=tracker, seed=seed, frames=sequence.frames, timeline=changes)
            run.finish()
            course = evaluated_run(experiment, run.diagnostics)
            found = evaluate((SUCCESS, PRECISION), course)
            if SUCCESS.name not in found:
                raise BenchmarkError(f"{run.tracker} of {experiment.id} believes in no box, which overlap needs")
            success.append(float(found[SUCCESS.name]))
            precision.append(float(found[PRECISION.name]))
            step_ms += [row.step_ms for row in run.diagnostics[1:]]
            on_run()
        grey = _is_grey(pictures.picture(sequence.start))
    speed = 1e3 / float(np.median(step_ms)) if step_ms else float("nan")
    return Score(sequence.name, sequence.frames, grey, tuple(success), tuple(precision), speed)


def _within(box: tuple[float, float, float, float], size: tuple[int, int]) -> Box:
    """Return the part of a box that lies within a picture."""
    x, y, w, h = box
    left, top = max(x, 0.0), max(y, 0.0)
    return Box.of(left, top, min(x + w, size[0]) - left, min(y + h, size[1]) - top)


def _is_grey(picture_rgb: NDArray[np.uint8]) -> bool:
    channels = picture_rgb.astype(np.float64)
    return bool((channels.max(axis=2) - channels.min(axis=2)).mean() < GREY_LEVELS)
