"""Failures of the command line: one clear line, nothing on standard output, and a status."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pftrack.cli.app import main
from tests.cli.commands import FRAMES, Call, on_clip, refused

WRONG_USE = [
    ("", "name a command"),
    ("dance", "dance"),
    ("run cube", "experiment must be one of ", "ball", "sine", "got 'cube'"),
    ("run ball --tracker magic", "one of", "h-spf", "got 'magic'"),
    ("run ball --preset fwe", "the preset of ball must be one of works, too-wide,", "got 'fwe'"),
    (f"run ball --frames {10**12}", "--frames must be a whole number between 1 and"),
    ("run ball --set sample_cont=3", "no parameter 'sample_cont'", "did you mean sample_count"),
    ("run ball --box 1,2,3,4", "--box needs --video"),
    ("run sine --video clip.mp4 --box 1,2,3,4", "sine is simulated and takes no --video"),
    ("run ball --video CLIP", "--video needs --mark box:x,y,w,h"),
    ("run ball --video-out film.avi", "must end in .mp4, got 'film.avi'"),
    ("run ball --out a.mp4 --video-out a.mp4", "must be different files"),
    ("bench speed", "one of", "filter_step", "got 'speed'"),
    ("reproduce fusion", "a result must be one of", "one-step", "got 'fusion'"),
    ("doctor --port 70000", "--port"),
    ("serve --port 70000", "--port must be a whole number between 0 and 65535, got '70000'"),
    # Marks.
    ("run ball --video CLIP --mark 1,2,3,4", "--mark expected KIND:..."),
    ("run ball --video CLIP --mark box:1,2,3,4 --box 1,2,3,4", "mark the target only once, got --mark and --box"),
    ("run ball --video CLIP --box 1,2,3", "--box expected 4 finite numbers (x,y,w,h), got '1,2,3'"),
    (
        "run ball --video CLIP --box 20,30,10,8 --start 500",
        f"start must be a frame of the recording, 0 to {FRAMES - 1}, got 500",
    ),
    ("run fish --video CLIP", "--video needs --mark body:head x,y,root x,y,tip x,y,half width"),
    ("run hand --video CLIP --mark box:20,30,10,8", "hand takes no mark of kind 'box', only points"),
    # Learning.
    ("learn sine --out x.json", "sine takes no learn", "ball"),
    ("run sine --learned x.json", "sine takes no --learned"),
    # Lessons.
    ("lessons check nothing", "lesson must be one of 1 probability", "3 bayes", "got 'nothing'"),
    ("lessons figure 1 --out a.gif", ".png or .svg or .pdf or .json", "a.gif"),
    ("lessons export 1 --notebook a.txt", "expected a file .ipynb", "a.txt"),
    ("lessons export 12 --seed 3 --notebook a.ipynb", "shows a run", "recipe in its notebook"),
    ("lessons list --lessons nowhere", "--lessons expected a folder", "nowhere"),
    # Sweeps.
    ("sweep ball --axis sampel_count=1,2", "no parameter 'sampel_count'; did you mean sample_count"),
    ("sweep ball --jobs 0", "--jobs must be a whole number between 1 and 256"),
    ("sweep ball --set layout=1 --set layout=2", "--set gives layout twice"),
    ("sweep ball --jobs 1 --cluster x:1", "--cluster computes on its own workers and takes no --jobs"),
    ("sweep ball --start 3 --out a.parquet", "--start needs --video"),
    ("sweep", "name an experiment"),
    ("sweep ball", "--out FILE.parquet says where the result goes"),
    ("sweep ball --out x.csv", "--out must end in .parquet"),
    ("sweep ball --resume x.parquet", "--resume continues the plan of its file"),
    ("sweep report x.parquet --level 2", "--level must be a number between 0 and 1"),
]
"""Status 2: wrong use; the line has the wrong word and what is allowed."""

NOT_DONE = [
    ("run hand --video CLIP", "mark the tips of its fingers"),
    ("learn ball --frames 3 --trials 1 --out x.json", "got 1 in 1 track;"),
    ("learn ball --out /nowhere/x.json", "/nowhere/x.json cannot be written"),
    ("sweep --resume text.parquet", "text.parquet is not a Parquet file, or was cut short"),
    ("run ball --video none.mp4", "does not exist", "none.mp4"),
    ("run ball --video CLIP --box 20,30,10,8 --truth none.csv", "does not exist", "none.csv"),
    ("replay none.pft", "does not exist", "none.pft"),
    ("run ball --out nowhere/run.pft", "does not exist", "nowhere"),
    ("run ball --out folder", "is a folder"),
]
"""Status 1: missing or wrong files, and places that cannot be written, found before anything is computed."""


@pytest.mark.parametrize(("status", "said"), [(2, it) for it in WRONG_USE] + [(1, it) for it in NOT_DONE], ids=str)
def test_a_wrong_call_is_refused_with_one_line(
    call: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int, said: tuple[str, ...]
) -> None:
    """The line names the mistake and the remedy; nothing is written."""
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("text.parquet").write_text("no result")
    there = sorted(tmp_path.rglob("*"))
    command, *parts = said
    refused(call(*(str(clip) if word == "CLIP" else word for word in shlex.split(command))), status, *parts)
    assert sorted(tmp_path.rglob("*")) == there


def test_with_json_a_failure_is_one_json_value_too(call: Call) -> None:
    """A program reads field, bound and value from it."""
    code, out, err = call("run", "ball", "--set", "sample_count=0", "--json")
    error = json.loads(out)["error"]
    assert code == 2
    assert (error["field"], error["value"]) == ("sample_count", 0)
    assert err == f"pftrack: {error['message']}\n"
    assert error["bound"] in error["message"]


def test_wrong_files_are_named(call: Call, clip: Path, tmp_path: Path) -> None:
    """An empty or foreign file gives status 1 and a line with its name."""
    for content in (b"", b"PK\x05\x06" + bytes(18), b"no video at all, and no run either" * 100):
        wrong = tmp_path / "wrong.mp4"
        wrong.write_bytes(content)
        refused(call("run", "ball", "--video", wrong, "--box", "1,2,3,4"), 1, "wrong.mp4")
        refused(call("replay", wrong), 1, "wrong.mp4")
    broken = tmp_path / "truth.csv"
    broken.write_text("frame,x,y,w,h\n0,a,2,3,4\n")
    refused(call(*on_clip(clip, "--truth", broken)), 1, "truth.csv: line 2: x must be a number of px, got 'a'")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a file system that takes no files, even of root")
def test_a_run_that_cannot_be_saved_is_reported_by_its_name(call: Call) -> None:
    """A failure while writing names the requested file, not the temporary one."""
    status, _, err = call("run", "ball", "--frames", 2, "--out", "/proc/run.pft")
    assert (status, "/proc/run.pft cannot be written" in err, ".part" in err) == (1, True, False), err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_an_output_that_takes_nothing(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk is one line; a closed pipe, as in `pftrack show | head -1`, ends a command quietly.

    What is left in the buffer is dropped: closing the output does not raise the error again.
    """
    reading, closed = os.pipe()
    os.close(reading)
    for output, said in (("/dev/full", "pftrack: No space left on device\n"), (closed, "")):
        with open(output, "w") as stream:  # noqa: PTH123 - a descriptor is not a path
            monkeypatch.setattr(sys, "stdout", stream)
            status, _, err = call("show", "sine", "--json")
        assert (status, err) == (1, said)


def test_an_interrupted_run_leaves_no_files(tmp_path: Path) -> None:
    """Ctrl-C ends it with one line and status 1; not even half a film is left."""
    film = tmp_path / "film.mp4"
    command = [sys.executable, "-m", "pftrack", "run", "ball", "--frames", "100000", "--video-out", str(film)]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        while not any(it.stat().st_size for it in tmp_path.iterdir()):
            assert run.poll() is None
            time.sleep(0.05)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=60)
    finally:
        run.kill()
    assert (run.returncode, out, err) == (1, "", "pftrack: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_a_fault_of_pftrack_is_one_line(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unforeseen error gives one line, and a traceback with PFTRACK_DEBUG."""

    def fail(_name: str) -> None:
        raise TypeError("that\nshould not happen")

    monkeypatch.setattr("pftrack.cli.experiments.find_experiment", fail)
    refused(call("show", "ball"), 1, "internal error", "TypeError: that should not happen", "PFTRACK_DEBUG=1")
    monkeypatch.setenv("PFTRACK_DEBUG", "1")
    with pytest.raises(TypeError):
        main(["show", "ball"])
