"""`pftrack open`: results of any tracker with their clip and their truth."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.sources.results.writing import read_results_file
from pftrack.sources.sequence import open_sequence
from pftrack.vision.film import FilmWriter
from tests.cli.commands import Ask, Call, refused

FRAMES = 8


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a clip, a tracker's results on two targets, and the truth."""
    with FilmWriter(tmp_path / "clip.mp4", 25.0) as film:
        for _ in range(FRAMES):
            film.write(np.zeros((96, 128, 3), dtype=np.uint8))
    results = truth = ""
    for t in range(FRAMES):
        for true in (1, 2):
            box = f"{20 * true + t + 1},{11},{12},{12}"
            results += f"{t + 1},{true if t < 5 else 3 - true},{box},0.9,-1,-1,-1\n"
            truth += f"{t + 1},{true},{box},1,1,1.0\n"
    (tmp_path / "results.txt").write_text(results)
    (tmp_path / "gt.txt").write_text(truth)
    return tmp_path


def boxes(path: Path, **options: Any) -> list[tuple[float, ...]]:
    return [box[:6] for box in read_results_file(path, **options).boxes]


def measured(folder: Path) -> tuple[object, ...]:
    return "open", folder / "results.txt", "--video", folder / "clip.mp4", "--truth", folder / "gt.txt", "--json"


def test_results_are_measured_on_their_clip(call: Call, folder: Path) -> None:
    """There are overlap and switches, every guess is reported, and the recording has all that the page needs."""
    out, more = folder / "mine.pft", ("--set", "selected_target=1", "--export", folder / "again.cvat.xml")
    status, out_text, err = call(*measured(folder), "--out", out, *more)
    assert status == 0, err
    summary = json.loads(out_text)
    assert summary["frames"] == FRAMES
    assert summary["mean_iou"] == pytest.approx(5 / 8, abs=0.01)
    assert summary["frames_with_switches"] == 1
    assert "pftrack: Its first frame was taken as 1" in err
    assert "Of the truth: Its first frame was taken as 1" in err
    assert open_sequence(out).size == (128, 96)
    assert boxes(folder / "again.cvat.xml") == boxes(folder / "results.txt")


def test_the_measured_target_is_named(call: Call, folder: Path) -> None:
    """The result has the number of targets and the chosen one, and a note explains how to choose."""
    _, out, err = call(*measured(folder))
    assert (json.loads(out)["targets"], json.loads(out)["measured_target"]) == (2, 1)
    (folder / "gt.txt").write_text("1,1,90,80,9,9,1,1,1\n")
    assert "never overlaps a true box by half, so no error is measured" in call(*measured(folder))[2]
    assert "it has 2 targets, and target 1 is measured; --set selected_target=NUMBER chooses another" in err


def test_other_files_are_refused(call: Call, folder: Path) -> None:
    """A clip has no results, and a form must be known."""
    refused(call("open", folder / "clip.mp4", "--no-show"), 1, "holds no results")
    (folder / "own.csv").write_text("bild;links;oben;breit;hoch\n0;1;2;3;4\n")
    columns = "own.csv: expected columns such as frame, id, x, y, w, h, got bild, links"
    refused(call("open", folder / "own.csv", "--video", folder / "clip.mp4"), 1, columns)
    refused(call("open", folder / "results.txt", "--form", "kitti"), 2, "--form must be one of mot")


@pytest.mark.filterwarnings("ignore:The file lists a frame after the last")
def test_a_truth_may_begin_at_frame_1(call: Call, folder: Path) -> None:
    """`--truth-first-frame 1` resolves the doubt, for results and for runs; Python warns, too."""
    rows = [f"{frame + 1},{20 + frame},10,12,12\n" for frame in range(FRAMES)]
    (folder / "true.csv").write_text("frame,x,y,w,h\n" + "".join(rows))
    known = "--video", folder / "clip.mp4", "--truth", folder / "true.csv", "--json"
    doubt = "Its frames were taken to count from 0, and begin at 1; say so if the first frame is 1."
    opened = "open", folder / "results.txt", *known
    assert doubt in call(*opened)[2]
    status, out, err = call(*opened, "--truth-first-frame", "1")
    assert (status, doubt in err) == (0, False)
    assert json.loads(out)["mean_iou"] == pytest.approx(5 / 8, abs=0.01)
    tracked = "run", "histogram", *known, "--box", "20,10,12,12", "--start", "0"
    assert doubt in call(*tracked)[2]
    status, out, err = call(*tracked, "--truth-first-frame", "1")
    assert (status, doubt in err, json.loads(out)["labelled_frames"]) == (0, False, FRAMES)
    asked: dict[str, Any] = {"recording": folder / "clip.mp4", "truth": folder / "true.csv"}
    with pytest.warns(UserWarning, match=re.escape(doubt)):
        pftrack.run("histogram", **asked, box=(20, 10, 12, 12), start=0, finish=False)


@pytest.mark.filterwarnings("ignore:(Records of frames beyond|Its first frame)")
def test_results_of_a_large_clip_can_be_opened(call: Call, ask: Ask, folder: Path) -> None:
    """A 4K clip is refused with the remedy, which works on the command line and in Python."""
    clip, results = folder / "clip.mp4", folder / "results.txt"
    with FilmWriter(clip, 25.0) as film:
        film.write(np.zeros((2160, 3840, 3), dtype=np.uint8))
    arguments = "open", results, "--video", clip
    refused(call(*arguments, "--no-show"), 1, "allow it with --large, in Python large=True")
    ask(*arguments, "--large", "--form", "mot")
    assert pftrack.load(results, recording=clip, large=True).source.size == (3840, 2160)


def test_truth_may_come_in_the_form_of_others(ask: Ask, folder: Path) -> None:
    """An experiment that takes true boxes takes them in every known form."""
    with pytest.warns(UserWarning, match="Its first frame was taken as 1"):
        run = pftrack.load(folder / "results.txt")
    run.export(folder / "boxes.coco.json")
    tracked = "run", "histogram", "--video", folder / "clip.mp4", "--truth", folder / "boxes.coco.json", "--frames", 3
    exports = "--export", folder / "clicked.truth.mot.txt", "--export", folder / "believed.otb.txt"
    ask(*tracked, "--mark", "box:21,10,12,12", *exports)
    assert read_results_file(folder / "clicked.truth.mot.txt").frames == 3
    assert len(boxes(folder / "believed.otb.txt", form="otb")) == 3
