"""Does suitability predict loss? Real clips, marked by their truth in frames drawn at random.

Each start is graded as on the upload page, then the default tracker follows it. A start is lost if a loss lasts
(`pftrack.runs.loss`) or reaches the last frame. The grades were set on the clips called *seen*; those kept *aside* were
measured afterwards, once. The clips are in `shared/data` next to the checkout.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

import csv  # noqa: E402
from collections.abc import Iterator, Mapping  # noqa: E402
from itertools import islice  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

from pftrack.core.model.marks import Box  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.experiments.experiment import Experiment  # noqa: E402
from pftrack.runs.loss import LASTING_FRAMES, Loss  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402
from pftrack.sources.sequence import open_sequence  # noqa: E402
from pftrack.sources.truth import TruthTable, read_truth  # noqa: E402

CLIPS = Path(__file__).parents[2] / "shared" / "data"
FEWEST = 10
"""Least number of labelled frames after a start."""

Boxes = Mapping[int, tuple[float, float, float, float]]


def targets() -> Iterator[tuple[str, str, str, Boxes]]:
    """Yield half ("seen" or "aside"), name, clip and true boxes of each target."""
    yield "seen", "ball", "ball_green_hand/clip.mp4", boxes_in("ball_green_hand")
    cups = boxes_in("cups_red")
    yield "seen", "cups", "cups_red/clip.mp4", {frame: cups[frame] for frame in range(26)}
    yield "seen", "cups end", "cups_red/clip.mp4", {frame: cups[frame] for frame in range(285, 300)}
    profile = {int(row["frame"]): around(row) for row in rows_of("face_turning/head_turn_short_reference_pose.csv")}
    yield "seen", "face gif", "face_turning/head_turn_short.gif", profile
    yield "seen", "person", "occlusion_person/clip.mp4", boxes_in("occlusion_person")
    yield "aside", "carton", "corners_moving_camera/img", boxes_in("corners_moving_camera")
    front = {int(row["frame"]): around(row) for row in rows_of("face_turning/reference_pose.csv")}
    yield "aside", "face", "face_turning/clip.mp4", front
    places = [row for row in rows_of("fish_above/gt.csv") if row["fish"] == "0" and row["merged_blob"] == "0"]
    fish = {int(row["frame"]): (float(row["x"]) - 8, float(row["y"]) - 8, 16.0, 16.0) for row in places}
    yield "aside", "fish 0", "fish_above/clip.mp4", fish


def boxes_in(folder: str) -> Boxes:
    """Return the true boxes of a clip."""
    return read_truth(CLIPS / folder / "gt.csv").boxes


def rows_of(table: str) -> list[dict[str, str]]:
    """Return the rows of a table of a clip."""
    with (CLIPS / table).open(newline="") as file:
        return list(csv.DictReader(file))


def around(row: Mapping[str, str]) -> tuple[float, float, float, float]:
    """Return the box around the points of a face."""
    xs, ys = ([float(value) for name, value in row.items() if name.endswith(axis)] for axis in ("_x", "_y"))
    return min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)


def measure(experiment: Experiment, name: str, clip: str, boxes: Boxes, starts: int, follow: int) -> dict[str, object]:
    """Grade a target at some starts with each of two seeds, follow it, and count the losses."""
    sequence = open_sequence(CLIPS / clip)
    width, height = sequence.size
    able = [
        start
        for start, (x, y, w, h) in boxes.items()
        if min(x, y) >= 0 and x + w <= width and y + h <= height
        if sum(frame in boxes for frame in range(start + 1, start + 1 + follow)) >= min(FEWEST, follow)
    ]
    values, grades, lost = [], [], 0
    for seed in (0, 1):
        rng = np.random.default_rng([seed, *map(ord, name)])
        for start in rng.choice(able, min(starts, len(able)), replace=False).tolist():
            setup = experiment.video.on_video(sequence, Box.of(*boxes[start]), start=start, truth=TruthTable(boxes))
            found = experiment.video.suits(sequence, setup.footage, setup.parameters)  # type: ignore[arg-type,misc]
            values.append(found.value)
            grades.append(found.grade)
            loss = Loss.of([step.diagnostics for step in islice(Run(experiment, setup, seed=seed), follow + 1)])
            end = len(loss.lost) - 1
            lost += any(last + 1 - first >= LASTING_FRAMES or last == end for first, last in loss.spans)
    said = ", ".join(sorted(set(grades)))
    return {"value, from": min(values), "to": max(values), "said": said, "starts": len(values), "lost": lost}


if __name__ == "__main__":
    given = arguments(
        __doc__.splitlines()[0],
        starts=Size(6, 1, "starts of each target, with each of two seeds"),
        follow=Size(40, 2, "frames to follow"),
        targets=Size(8, 1, "targets"),
    )
    table = []
    for half, name, clip, boxes in islice(targets(), given.targets):
        for tracker in ("ball", "histogram"):
            progress(f"{name}, {tracker}")
            counted = measure(find(tracker), name, clip, boxes, given.starts, given.follow)
            table.append({"half": half, "target": name, "experiment": tracker, **counted})
    report("Suitability and losses", table, as_json=given.json)
