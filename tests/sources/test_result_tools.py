"""Results beside the tools of others: they read what is written here, and count the same switches."""

import json
from pathlib import Path

import numpy as np
import pytest

import pftrack
from pftrack.sources.results.table import Box
from pftrack.sources.results.writing import write_results
from tests.sources.films import rows_of

FRAMES = 40

pytestmark = [pytest.mark.filterwarnings(f"ignore::{kind}Warning") for kind in ("Deprecation", "Future", "User")]


def boxes(confused: bool) -> list[Box]:
    """Three targets apart from each other, whose numbers change hands now and then, and which are missed at times."""
    rng = np.random.default_rng(4)
    found = []
    order = [1, 2, 3]
    for frame in range(FRAMES):
        if confused and frame % 9 == 8:
            order = [order[1], order[2], order[0]]
        found += [
            Box(frame, order[place], 60.0 * place + frame, 20.0, 20.0, 30.0, score=0.9)
            for place in range(3)
            if not confused or rng.random() < 0.9
        ]
    return found


def test_motmetrics_counts_the_same_switches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It reads the text of MOTChallenge that is written here, and finds as many identity switches."""
    tool = pytest.importorskip("motmetrics", reason="motmetrics is not installed")
    monkeypatch.setattr(np, "asfarray", np.asarray, raising=False)  # it was written for NumPy 1
    read = []
    for confused in (False, True):
        data = write_results("mot", boxes(confused), frames=FRAMES, size=(320, 240), rate_hz=25.0)
        (tmp_path / "boxes.txt").write_bytes(data)
        read.append(tool.io.loadtxt(tmp_path / "boxes.txt", fmt="mot15-2D"))
    found = tool.utils.compare_to_groundtruth(*read, "iou", distth=0.5)
    counted = tool.metrics.create().compute(found, metrics=["num_switches"])["num_switches"].item()
    with pftrack.record(tmp_path / "mine.pft") as rec:
        for box in boxes(confused=True):
            rec(box.frame, box=box[2:6], target=box.target)
        for box in boxes(confused=False):
            rec.truth(box.frame, box=box[2:6], target=box.target)
    assert counted > 0
    assert sum(row.number("identity_switches") for row in rows_of(tmp_path / "mine.pft")) == counted


def test_pycocotools_reads_what_is_written(tmp_path: Path) -> None:
    """It indexes images and annotations, and finds each box where it was."""
    tool = pytest.importorskip("pycocotools.coco", reason="pycocotools is not installed")
    path = tmp_path / "boxes.json"
    path.write_bytes(write_results("coco", boxes(confused=False), frames=FRAMES, size=(320, 240), rate_hz=25.0))
    coco = tool.COCO(str(path))
    assert len(coco.getImgIds()) == json.loads(path.read_text())["videos"][0]["length"] == FRAMES
    assert coco.loadAnns(coco.getAnnIds(imgIds=[1]))[0]["bbox"] == [0.0, 20.0, 20.0, 30.0]
