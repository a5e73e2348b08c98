"""`pftrack export`: a saved run becomes files of other kinds, by suffix."""

import json
from pathlib import Path
from shutil import copy

import cv2
import pandas as pd
import pytest
from PIL import Image

from pftrack.experiments import find
from pftrack.runs.record import save
from pftrack.runs.run import Run
from tests.cli.commands import Call, on_clip, refused


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run of the sinusoid, saved at frame 9 of 60."""
    sine = find("sine")
    run = Run(sine, sine.simulate(), seed=3, frames=60)
    run.seek(9)
    place = tmp_path_factory.mktemp("saved") / "run.pft"
    save(run, place)
    return place


def test_a_saved_run_is_written_as_several_files(saved: Path, tmp_path: Path, call: Call) -> None:
    """A message reports that the run is not finished, with its number of frames."""
    names = ["numbers.csv", "film.mp4", "run.ipynb", "again.json"]
    wanted = [part for name in names for part in ("--to", tmp_path / name)]
    status, out, err = call("export", saved, *wanted, "--json")
    assert status == 0, err
    assert "the run is not finished; frames 0 to 9, 10 of 60 are exported" in " ".join(err.split())
    said = json.loads(out)
    assert [Path(file).name for file in said["files"]] == ["numbers.csv", "numbers.csv.manifest.json", *names[1:]]
    assert (said["frames"], said["of"]) == (10, 60)
    assert pd.read_csv(tmp_path / "numbers.csv")["frame"].tolist() == list(range(10))
    assert cv2.VideoCapture(str(tmp_path / "film.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) == 10
    assert call("run", tmp_path / "again.json", "--frames", 10, "--json")[0] == 0


def test_one_plot_is_written_as_a_picture(saved: Path, tmp_path: Path, call: Call) -> None:
    """The picture of one plot is smaller than that of all."""
    assert call("export", saved, "--to", tmp_path / "all.png")[0] == 0
    beside = ("--to", tmp_path / "beside.jsonl")
    assert call("export", saved, "--to", tmp_path / "one.png", *beside, "--plot", "ess")[0] == 0
    with Image.open(tmp_path / "all.png") as every, Image.open(tmp_path / "one.png") as one:
        assert every.size[1] > one.size[1]


def test_other_suffixes_and_files_are_refused(saved: Path, tmp_path: Path, call: Call) -> None:
    """So are missing runs, and files of another kind."""
    (tmp_path / "none.pft").write_text("none")
    for run, name, status, words in (
        (saved, "run.docx", 2, "a run of sine can be exported as .csv, .parquet"),
        (tmp_path / "none.pft", "x.csv", 1, "none.pft is not a saved run"),
        (tmp_path / "gone.pft", "x.csv", 1, "does not exist"),
    ):
        refused(call("export", run, "--to", tmp_path / name), status, words)


def test_the_recording_of_a_run_is_looked_for(clip: Path, tmp_path: Path, call: Call) -> None:
    """It is next to the run or at `--video`; a missing one is reported."""
    moved, run = Path(copy(clip, tmp_path / "moved.mp4")), tmp_path / "run.pft"
    assert call(*on_clip(moved, "--tracker", "condensation", "--frames", 5, "--out", run))[0] == 0
    assert call("export", run, "--to", tmp_path / "x.parquet")[0] == 0
    moved = moved.rename(tmp_path / "again.mp4")
    refused(call("export", run, "--to", tmp_path / "y.parquet"), 1, "which does not exist; give its path with --video")
    assert call("export", run, "--to", tmp_path / "y.parquet", "--video", moved)[0] == 0
    first, second = (pd.read_parquet(tmp_path / f"{name}.parquet").drop(columns="step_ms") for name in "xy")
    pd.testing.assert_frame_equal(first, second)
