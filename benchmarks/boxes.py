"""A box on sequences of benchmarks: mean overlap of the default beside OpenCV's trackers, clip by clip.

    python benchmarks/boxes.py FOLDER

The folder has sequences in the form of OTB or VOT, which you bring. Each tracker gets the box of the first picture and
nothing after it. CSRT, KCF and MOSSE are in `opencv-contrib-python-headless` alone; what the installed OpenCV lacks has
no figure. Mean shift goes up the back-projection of a histogram of hue and saturation. Pictures that are wider than 640
px are made smaller, for all alike. Without a folder a lawn is drawn.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import sys  # noqa: E402
from collections.abc import Callable, Iterator, Sequence  # noqa: E402
from contextlib import closing  # noqa: E402
from pathlib import Path  # noqa: E402
from statistics import fmean, median  # noqa: E402
from typing import Any  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from histogram import HALF, lawn  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.analysis.evaluation import find_sequences, is_grey, within  # noqa: E402
from pftrack.core.model.measures import MEAN_IOU, EvaluatedRun  # noqa: E402
from pftrack.core.model.recipe import Change  # noqa: E402
from pftrack.core.model.source import FrameIndex, FrameSequence  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402
from pftrack.sources.sequence import open_sequence  # noqa: E402
from pftrack.sources.truth import TruthTable  # noqa: E402

Picture = NDArray[np.uint8]
Rectangle = tuple[float, float, float, float]
WIDEST_PX = 640


class Pictures(FrameSequence):
    """Given pictures."""

    def __init__(self, name: str, pictures: Sequence[Picture]) -> None:
        self.name, self._pictures = name, pictures
        height, width = pictures[0].shape[:2]
        times = tuple((np.arange(len(pictures)) / 30.0).tolist())
        self.index = FrameIndex("video", "0" * 64, width, height, 30.0, times, (0,) * len(pictures))

    def _picture(self, index: int) -> Picture:
        return self._pictures[index]


class MeanShift:
    """OpenCV's mean shift, with the methods of its trackers."""

    def init(self, picture_bgr: Picture, box: tuple[int, int, int, int]) -> None:
        """Count hue and saturation within the box."""
        self.box = box
        x, y, w, h = box
        hsv = cv2.cvtColor(picture_bgr[y : y + h, x : x + w], cv2.COLOR_BGR2HSV)
        coloured = cv2.inRange(hsv, np.array((0, 30, 30)), np.array((180, 255, 255)))
        mask = coloured if coloured.any() else None
        self.counts = cv2.calcHist([hsv], [0, 1], mask, [18, 8], [0, 180, 0, 256])
        cv2.normalize(self.counts, self.counts, 0, 255, cv2.NORM_MINMAX)

    def update(self, picture_bgr: Picture) -> tuple[bool, Any]:
        """Go up the back-projection."""
        hsv = cv2.cvtColor(picture_bgr, cv2.COLOR_BGR2HSV)
        likely = cv2.calcBackProject([hsv], [0, 1], self.counts, [0, 180, 0, 256], 1)
        _, self.box = cv2.meanShift(likely, self.box, (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 1))
        return True, self.box


def others() -> dict[str, Callable[[], Any] | None]:
    """Return how each of OpenCV's trackers is made; None for one that is not installed."""
    legacy = getattr(cv2, "legacy", None)
    return {
        "CSRT": getattr(cv2, "TrackerCSRT_create", None),
        "KCF": getattr(cv2, "TrackerKCF_create", None),
        "MIL": getattr(cv2, "TrackerMIL_create", None),
        "MOSSE": getattr(legacy, "TrackerMOSSE_create", None),
        "mean shift": MeanShift,
    }


def clips(folder: Path | None, frames: int) -> Iterator[tuple[str, list[Picture], dict[int, Rectangle]]]:
    """Yield name, pictures and true boxes of each sequence of a folder."""
    if folder is None:
        pictures, places = lawn(frames)
        width, height = 2.0 * HALF[0] + 1.0, 2.0 * HALF[1] + 1.0
        boxes = {n: (x - HALF[0], y - HALF[1], width, height) for n, (x, y) in enumerate(places.tolist())}
        yield "lawn", list(pictures), boxes
        return
    for sequence in find_sequences(folder):
        with closing(open_sequence(sequence.pictures)) as opened:
            factor = min(1.0, WIDEST_PX / opened.size[0])
            numbers = range(sequence.start, sequence.start + min(frames, sequence.frames))
            pictures = [smaller(opened.picture(number), factor) for number in numbers]
        scaled = {number: tuple(factor * side for side in box) for number, box in sequence.boxes.items()}
        yield sequence.name, pictures, {n: scaled[number] for n, number in enumerate(numbers) if number in scaled}  # type: ignore[misc]


def smaller(picture: Picture, factor: float) -> Picture:
    """Return a picture at a size, which nobody can write to."""
    if factor < 1.0:
        picture = np.asarray(cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), np.uint8)
    picture.flags.writeable = False
    return picture


def overlap(boxes: NDArray[np.float64], truth: dict[int, Rectangle]) -> float:
    """Return the mean overlap of boxes (L, 4) with the true ones, as `pftrack run` has it."""
    true = np.array([truth.get(n, (np.nan,) * 4) for n in range(len(boxes))])
    middles = [found[:, :2] + (found[:, 2:] - 1.0) / 2.0 for found in (boxes, true)]
    course = EvaluatedRun(middles[0], middles[1], np.zeros(len(boxes)), None, true[:, 2:], boxes[:, 2:])
    return float(np.nanmean(MEAN_IOU.frames(course)))


def ours(
    pictures: list[Picture], truth: dict[int, Rectangle], seeds: int, values: dict[str, float]
) -> tuple[list[float], float]:
    """Return the overlap of each seed, and frames a second, with values that are not the defaults."""
    experiment, found, step_ms = find("histogram"), [], []
    sequence, mark = Pictures("clip", pictures), within(truth[0], pictures[0].shape[1::-1])  # type: ignore[arg-type]
    setup = experiment.video.on_video(sequence, mark, truth=TruthTable(truth))
    for seed in range(seeds):
        run = Run(experiment, setup, seed=seed, frames=len(pictures), timeline=(Change(0, values),))
        run.finish()
        rows = run.diagnostics
        sizes = np.array([row.vector("box") for row in rows])
        middles = np.array([row.estimate for row in rows])
        found.append(overlap(np.column_stack([middles - (sizes - 1.0) / 2.0, sizes]), truth))
        step_ms += [row.step_ms for row in rows[1:]]
    return found, 1e3 / median(step_ms)


def of_other(make: Callable[[], Any], pictures: list[Picture], truth: dict[int, Rectangle]) -> float:
    """Return the overlap of one of OpenCV's trackers; one that loses its target stays where it was."""
    x, y, w, h = within(truth[0], pictures[0].shape[1::-1]).corner_and_size  # type: ignore[arg-type]
    begun = (round(x), round(y), max(round(w), 1), max(round(h), 1))
    tracker, boxes = make(), [begun]
    tracker.init(pictures[0][:, :, ::-1].copy(), begun)
    for picture in pictures[1:]:
        held, box = tracker.update(picture[:, :, ::-1].copy())
        boxes.append(box if held else boxes[-1])
    return overlap(np.array(boxes, np.float64), truth)


def measure(folder: Path | None, frames: int, seeds: int, chosen: Sequence[str]) -> Iterator[dict[str, object]]:
    """Yield a row of each clip."""
    for name, pictures, truth in clips(folder, frames):
        progress(name)
        found, speed = ours(pictures, truth, seeds, {})
        row: dict[str, object] = {"clip": name, "grey": is_grey(pictures[0]), "frames": len(pictures)}
        row |= {"ours": fmean(found), "worst": min(found), "median": median(found), "ours, frames/s": speed}
        row["without search"] = fmean(ours(pictures, truth, seeds, {"search_share": 0.0})[0])
        for other, make in others().items():
            row[other] = of_other(make, pictures, truth) if make and other in chosen else None
        print(*row.values(), sep="\t", file=sys.stderr, flush=True)
        yield row


def main() -> None:
    """Measure and report."""
    folder = Path(sys.argv.pop(1)) if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else None
    given = arguments(
        __doc__.splitlines()[0],
        frames=Size(120, 4, "frames of a sequence, at most"),
        seeds=Size(5, 1, "runs of ours"),
    )
    cv2.setNumThreads(1)
    rows = list(measure(folder, given.frames, given.seeds, list(others())))
    for grey in sorted({bool(row["grey"]) for row in rows}):
        kind = [row for row in rows if row["grey"] is grey]
        means = {
            name: fmean(row[name] for row in kind) if isinstance(kind[0][name], float) else None  # type: ignore[misc]
            for name in list(rows[0])[3:]
        }
        rows.append({"clip": f"mean, {'grey' if grey else 'colour'}", "grey": grey, "frames": len(kind), **means})
    report("A box on sequences: mean overlap, one pass", rows, as_json=given.json)


if __name__ == "__main__":
    main()
