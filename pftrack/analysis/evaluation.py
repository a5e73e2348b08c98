"""Trackers on the sequences of public benchmarks, which the user provides, by the benchmark's own protocol.

The pictures of these benchmarks have no licence, so pftrack does not include them.
"""

import csv
import json
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES, EvaluatedRun, Measure, evaluate
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import Setup
from pftrack.core.refusal import RefusedError
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run, extent_series
from pftrack.sources.results.table import Form
from pftrack.sources.results.writing import read_results_file
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable

# Sequences of benchmarks as they lie on a disk: a folder each, with pictures and a text of true boxes.
#
# | form | pictures | boxes | a line |
# |---|---|---|---|
# | OTB (Wu, Lim, Yang 2013) | `img/` | `groundtruth_rect.txt`, or `groundtruth_rect.1.txt` and so on, a target each |
# |   |   |   | x, y, w, h; first pixel 1; commas, tabs or spaces |
# | VOT (Kristan et al. 2016) | the folder, or `color/` | `groundtruth.txt` | x, y, w, h, or x and y of four corners |
#
# Of four corners the smallest upright box around them is taken. A line whose numbers are not finite, or whose box has
# no area, is a frame without truth. An empty text is skipped (one of Human4's is empty). Where there are not as many
# lines as pictures, lines begin with the picture that `cfg.json` names as `startFrame`, as in jwlim/tracker_benchmark,
# or that the authors of OTB name for this sequence; otherwise the sequence is refused.

Rectangle = tuple[float, float, float, float]

OTB_STARTS = {"BlurCar1": 247, "BlurCar3": 3, "BlurCar4": 18, "David": 300, "Freeman3": 1, "Freeman4": 1}
"""Number of the first picture with a box, of sequences of OTB with more pictures than boxes (`vot/dataset/otb.py` of
votchallenge/toolkit has the list)."""


@dataclass(frozen=True, slots=True)
class BenchmarkSequence:
    """A sequence of a benchmark.

    Attributes:
        name: Name of its folder, and the number of the target if it has several.
        pictures: The folder of its pictures.
        start: Number of the picture of the first line, from 0.
        frames: Number of lines.
        boxes: (x, y, w, h) in px by number of the picture, the first pixel being 0; frames without truth are missing.
    """

    name: str
    pictures: Path
    start: int
    frames: int
    boxes: Mapping[int, Rectangle]


def find_sequences(folder: Path) -> list[BenchmarkSequence]:
    """Return the sequence that a folder is, or those of the folders in it, by name.

    Raises:
        RefusedError: It holds no sequence, or one cannot be read.
    """
    if not folder.is_dir():
        raise RefusedError(f"the folder {folder} does not exist")
    texts = _texts_in(folder) or [each for place in sorted(folder.iterdir()) for each in _texts_in(place)]
    if not texts:
        raise RefusedError(
            f"{folder.name} is not a sequence and holds none: expected img/ with groundtruth_rect.txt (OTB), or "
            "pictures with groundtruth.txt (VOT)"
        )
    return [_read(text) for text in texts]


def _texts_in(folder: Path) -> list[Path]:
    """Return the texts of true boxes of a folder that is a sequence, one of each of its targets."""
    if (folder / "img").is_dir():
        return sorted(text for text in folder.glob("groundtruth_rect*.txt") if text.stat().st_size)
    return [text for text in (folder / "groundtruth.txt",) if text.is_file()]


def _read(text: Path) -> BenchmarkSequence:
    folder, (_, *targets) = text.parent, text.stem.split(".")
    form: Form = "vot" if text.stem == "groundtruth" else "otb"
    pictures = next((place for name in ("img", "color") if (place := folder / name).is_dir()), folder)
    try:
        found = read_results_file(text, form=form, first_pixel=int(form == "otb"))
    except RefusedError as error:
        raise RefusedError(f"{folder.name}/{error}") from None
    start = _start(folder, pictures, text.name, found.frames)
    boxes = {start + box.frame: (box.x, box.y, box.w, box.h) for box in found.boxes}
    if start not in boxes:
        raise RefusedError(f"{folder.name}/{text.name}, line 1: a tracker begins there, so it must have a box")
    name = "-".join([folder.resolve().name, *targets])
    return BenchmarkSequence(name, pictures, start, found.frames, boxes)


def _start(folder: Path, pictures: Path, text: str, lines: int) -> int:
    """Return the picture of the first line: its name is the number in `cfg.json` or in the list of OTB.

    Raises:
        RefusedError: The numbers of lines and pictures differ, and neither names the first picture.
    """
    numbers = sorted(int(path.stem) for path in pictures.iterdir() if path.stem.isdecimal())
    try:
        wanted: int | None = int(json.loads((folder / "cfg.json").read_text(encoding="utf-8"))["startFrame"])
    except (OSError, ValueError, KeyError, TypeError):
        wanted = OTB_STARTS.get(folder.name) if lines != len(numbers) else None
    if wanted in numbers:
        return numbers.index(wanted)
    if numbers and lines != len(numbers):
        raise RefusedError(
            f"{folder.name} has {len(numbers):,} pictures, and {text} has {lines:,} lines: write the number of the "
            'picture of the first line into cfg.json, such as {"startFrame": 1}'
        )
    return 0


# A tracker is given the true box of the first picture and nothing after it (one-pass evaluation, OPE, by Wu, Lim and
# Yang, "Online object tracking: a benchmark", 2013). The success curve is the share of the frames in which the box of
# the tracker overlaps the true one by more than a threshold; trackers are ranked by the area under it, the mean over
# the 21 thresholds 0, 0.05, ..., 1. Precision is the share of frames whose centre is within 20 px of the true one. The
# first frame counts, as it does there.

THRESHOLDS = np.arange(21) / 20.0
GREY_LEVELS = 3.0
"""Channels of a picture that differ by less on average are those of a grey one, after compression."""


def _success(course: EvaluatedRun) -> Floats:
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
    """Score of a tracker on a sequence, over all seeds.

    Attributes:
        name: Name of the sequence.
        frames: Number of frames.
        grey: Whether its pictures have no colours.
        success: Area under the success curve, of each seed.
        precision: Share of frames within 20 px, of each seed.
        frames_per_second: Speed of the tracker alone, without the first frames: the median over all.
    """

    name: str
    frames: int
    grey: bool
    success: tuple[float, ...]
    precision: tuple[float, ...]
    frames_per_second: float

    def as_dict(self) -> dict[str, object]:
        """Return the score as JSON values."""
        means = {"success_mean": fmean(self.success), "precision_mean": fmean(self.precision)}
        return {**asdict(self), **means}


def follows_boxes(experiment: Experiment) -> bool:
    """Return whether an experiment takes a box on a recording and believes in one, which overlap needs."""
    believed = extent_series(experiment.all_series()) is not None
    return experiment.accepts_video and Box in experiment.video.marks and believed


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
        experiment: An experiment for a target with a box.
        sequence: The sequence.
        tracker: By name; the experiment's own if not given.
        seeds: Number of seeds; they are 0, 1, 2, ...
        values: Setup -> values of parameters that are not those with which a recording begins.
        on_run: Called after each run.

    Raises:
        RefusedError: The tracker believes in no box, or the pictures cannot be read or do not fit the boxes.
        ParameterError: The experiment refuses the box or a value.
    """
    if not experiment.accepts_video or Box not in experiment.video.marks:
        raise RefusedError(f"{experiment.id} follows no box on recordings")
    with closing(open_sequence(sequence.pictures)) as pictures:
        last = sequence.start + sequence.frames
        if pictures.frame_count < last:
            raise RefusedError(f"{sequence.name} has boxes for {last} pictures, got {pictures.frame_count} pictures")
        mark = within(sequence.boxes[sequence.start], pictures.size)
        setup = experiment.video.on_video(pictures, mark, start=sequence.start, truth=TruthTable(sequence.boxes))
        changes = (Change(0, dict(values(setup))),)
        success, precision, step_ms = [], [], []
        for seed in range(seeds):
            run = Run(experiment, setup, tracker=tracker, seed=seed, frames=sequence.frames, timeline=changes)
            run.finish()
            course = evaluated_run(experiment, run.diagnostics)
            found = evaluate((SUCCESS, PRECISION), course)
            if SUCCESS.name not in found:
                raise RefusedError(f"{run.tracker} of {experiment.id} believes in no box, which overlap needs")
            success.append(float(found[SUCCESS.name]))
            precision.append(float(found[PRECISION.name]))
            step_ms += [row.step_ms for row in run.diagnostics[1:]]
            on_run()
        grey = is_grey(pictures.picture(sequence.start))
    speed = 1e3 / float(np.median(step_ms)) if step_ms else float("nan")
    return Score(sequence.name, sequence.frames, grey, tuple(success), tuple(precision), speed)


def within(box: tuple[float, float, float, float], size: tuple[int, int]) -> Box:
    """Return the part of a box that lies within a picture."""
    x, y, w, h = box
    left, top = max(x, 0.0), max(y, 0.0)
    return Box.of(left, top, min(x + w, size[0]) - left, min(y + h, size[1]) - top)


def is_grey(picture_rgb: NDArray[np.uint8]) -> bool:
    """Return whether a picture (height, width, 3) has no colours."""
    channels = picture_rgb.astype(np.float64)
    return bool((channels.max(axis=2) - channels.min(axis=2)).mean() < GREY_LEVELS)


# The table of classical trackers holds areas under the success curve, one pass, of the file
# `results/OPE/<tracker>/scores_cvpr13/ALL.json` of the repository jwlim/tracker_benchmark at commit 5e1029c. CPF is the
# particle filter of Pérez et al. (2002), KMS and MS are mean shift (Comaniciu, Ramesh, Meer 2003; Collins 2003), the
# others are not colour trackers.

PUBLISHED_SOURCE = "Wu, Lim, Yang, Online object tracking: a benchmark, 2013; jwlim/tracker_benchmark, results/OPE"


def published(name: str) -> Mapping[str, float]:
    """Return the area under the success curve by tracker on a sequence; empty for one that the table does not have."""
    return _table().get(name.lower(), {})


@cache
def _table() -> Mapping[str, Mapping[str, float]]:
    with Path(__file__).with_name("published.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {row.pop("sequence").lower(): {name: float(text) for name, text in row.items()} for row in rows}
