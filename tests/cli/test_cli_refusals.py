"""Failures of the command line: one clear line, nothing on standard output, and a status that says which."""

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
    ("run", "experiment"),
    ("run ball --trackr apf", "--trackr", "--tracker"),
    ("run cube", "experiment must be one of ", "ball", "sine", "got 'cube'"),
    ("show cube", "experiment must be one of ", "got 'cube'"),
    ("run ball --tracker magic", "one of", "h-spf", "got 'magic'"),
    ("run ball --preset fwe", "the preset of ball must be one of works, too-wide,", "got 'fwe'"),
    ("sweep ball --preset fwe", "the preset of ball must be one of works, too-wide,", "got 'fwe'"),
    ("run ball --seed -1", "--seed", "-1"),
    ("run ball --seed abc", "--seed", "abc"),
    (f"run ball --seed {2**64}", "--seed"),
    ("run ball --frames 0", "--frames", "0"),
    ("run ball --frames nan", "--frames", "nan"),
    (f"run ball --frames {10**12}", "--frames must be a whole number between 1 and"),
    ("run ball --frames 2.5", "--frames must be a whole number", "got '2.5'"),
    ("run ball --set sample_count", "expected name=value, got 'sample_count'"),
    ("run ball --set =3", "expected name=value, got '=3'"),
    ("run ball --set sample_cont=3", "no parameter 'sample_cont'", "did you mean sample_count"),
    ("run ball --set sample_count=0", "sample_count must be a whole number between 1 and", "got 0"),
    ("run ball --set sample_count=1e9", "sample_count", "got '1e9'"),
    ("run ball --set sample_count=nan", "sample_count", "got 'nan'"),
    ("run ball --set sample_count=abc", "sample_count", "got 'abc'"),
    ("run ball --set gamma_px=nan", "gamma_px must be a finite number between", "px"),
    ("run ball --set gamma_min_px=21", "gamma_min_px must be at most gamma_max_px (20 px)"),
    ("run ball --set ball_colour=red", "ball_colour must be a colour as #rrggbb"),
    ("run ball --set learn_dynamics=perhaps", "learn_dynamics must be true or false"),
    ("run ball --set apf_weights=x", "apf_weights must be one of sharpened, corrected"),
    ("run ball --box 1,2,3,4", "--box needs --video"),
    ("run ball --start 0", "--start needs --video"),
    ("run ball --truth truth.csv", "--truth needs --video"),
    ("run sine --video clip.mp4 --box 1,2,3,4", "sine is simulated and takes no --video"),
    ("run ball --video clip.mp4", "--video needs --mark box:x,y,w,h"),
    ("run ball --video-out film.avi", "must end in .mp4, got 'film.avi'"),
    ("run ball --out a.mp4 --video-out a.mp4", "must be different files"),
    ("run ball --frames 1 --mark-out mark.png", "--mark-out needs --video"),
    ("bench speed", "one of", "filter_step", "got 'speed'"),
    ("reproduce fusion", "a result must be one of", "one-step", "got 'fusion'"),
    ("reproduce --jobs 0", "--jobs"),
    ("doctor --port 70000", "--port"),
    # Marks that are none, or not within the picture, with both sizes.
    ("run ball --video CLIP --mark 1,2,3,4", "--mark expected KIND:..."),
    ("run ball --video CLIP --mark line:1,2", "ball takes no mark of kind 'line', only box"),
    ("run ball --video CLIP --mark box:1,2,3", "--mark expected 4 finite numbers"),
    ("run ball --video CLIP --mark box:1,2,3,4 --box 1,2,3,4", "marked once, got --mark and --box"),
    ("run ball --video CLIP --box 1,2,3", "--box expected 4 finite numbers (x,y,w,h), got '1,2,3'"),
    ("run ball --video CLIP --box 1,2,3,4,5", "--box expected 4 finite numbers (x,y,w,h), got '1,2,3,4,5'"),
    ("run ball --video CLIP --box a,b,c,d", "--box expected 4 finite numbers (x,y,w,h), got 'a,b,c,d'"),
    ("run ball --video CLIP --box nan,2,3,4", "--box expected 4 finite numbers"),
    ("run ball --video CLIP --box 1,2,0,4", "mark must be a box of at least 1 px within the picture of 120 x 80 px"),
    ("run ball --video CLIP --box=1,2,3,-4", "mark must be a box of at least 1 px within the picture of 120 x 80 px"),
    ("run ball --video CLIP --box=-1,2,3,4", "within the picture of 120 x 80 px, got 'x = -1, y = 2"),
    ("run ball --video CLIP --box 110,2,20,4", "within the picture of 120 x 80 px, got 'x = 110, y = 2"),
    ("run ball --video CLIP --box 1e300,2,3,4", "mark.x must be"),
    (
        "run ball --video CLIP --box 20,30,10,8 --start 500",
        f"start must be a frame of the recording, 0 to {FRAMES - 1}, got 500",
    ),
    # Learning, and what was learned.
    ("learn sine --out x.json", "sine takes no learn", "ball"),
    ("learn ball sine --out x.json", "name one experiment, or saved runs"),
    ("learn nothing --out x.json", "nothing"),
    ("learn ball --trials 0 --out x.json", "--trials", "between 1 and"),
    ("learn ball --tracker none --out x.json", "a tracker of ball is one of"),
    ("learn ball --axis nothing=1 --out x.json", "ball has no parameter 'nothing'"),
    ("run sine --learned x.json", "sine takes no --learned"),
    ("run ball --set learned=nonsense", "learned must be a learned motion (it is not JSON"),
    # Lessons.
    ("lessons check nothing", "lesson must be one of 1 probability", "3 bayes", "got 'nothing'"),
    ("lessons figure 99 --out a.png", "lesson must be one of ", "got '99'"),
    ("lessons figure 1 --out a.gif", ".png or .svg or .pdf or .json", "a.gif"),
    ("lessons figure 1 --out a", "expected a file", "'a'"),
    ("lessons figure 1 --out a.png --set count", "name=value", "'count'"),
    ("lessons figure 1 --out a.png --set count=many", "count must be a whole number between 10 and 20000"),
    ("lessons figure 1 --out a.png --set count=5", "count must be", "between 10 and 20000", "got 5"),
    ("lessons figure 1 --out a.png --set low=nan", "low must be a finite number between -5 and 5 m"),
    ("lessons figure 1 --out a.png --set n=5", "n must be one of bin_width, count"),
    ("lessons figure 3 --out a.png --set mode=x", "one of position, distance", "'x'"),
    ("lessons figure 1 --out a.png --seed -1", "--seed must be a whole number"),
    ("lessons figure 1", "--out"),
    ("lessons export 1 --notebook a.txt", "expected a file .ipynb", "a.txt"),
    ("lessons export nothing --notebook a.ipynb", "lesson must be one of ", "got 'nothing'"),
    ("lessons export 12 --seed 3 --notebook a.ipynb", "shows a run", "recipe in its notebook"),
    ("lessons list --lessons nowhere", "--lessons expected a folder", "nowhere"),
    ("lessons", "command"),
    ("lessons nothing", "nothing"),
    # Sweeps.
    ("sweep ball --axis sampel_count=1,2", "no parameter 'sampel_count'; did you mean sample_count"),
    ("sweep ball --axis occlusion_width_px=0:900:9", "between 0 and 640 px, got 900"),
    ("sweep ball --axis occlusion_width_px=", "is empty"),
    ("sweep ball --axis occlusion_width_px=0:640:0.00006", "at most 2,000,000 runs"),
    ("sweep ball --axis layout=1 --axis layout=2", "the axis layout can be given only once"),
    ("sweep ball --axis tracker=apf --trackers apf", "the trackers can be given only once"),
    ("sweep ball --trackers h-spf,", "a tracker of ball is one of"),
    ("sweep ball --trials 0", "--trials must be a whole number"),
    ("sweep ball --frames 0", "--frames must be a whole number"),
    ("sweep ball --seed x", "--seed must be a whole number"),
    ("sweep ball --jobs 0", "--jobs must be a whole number between 1 and 256"),
    ("sweep ball --set sample_count", "--set expected name=value"),
    ("sweep ball --set sample_count=many", "sample_count must be a whole number"),
    ("sweep ball --set sample_cout=5", "did you mean sample_count"),
    ("sweep ball --set layout=1 --set layout=2", "--set gives layout twice"),
    ("sweep ball --axis layout=1 --set layout=2", "is an axis of the sweep and cannot have a fixed value"),
    ("sweep ball --set tracker=apf", "tracker is not a fixed value"),
    ("sweep ball --jobs 1 --cluster x:1", "--cluster computes on its own workers and takes no --jobs"),
    ("sweep ball --start 3 --out a.parquet", "--start needs --video"),
    ("sweep histogram --video CLIP --box 10,20,10,10 --axis sway_px=1,2 --dry-run", "no parameter 'sway_px' on a rec"),
    ("sweep balls", "got 'balls'"),
    ("sweep", "name an experiment"),
    ("sweep ball", "--out FILE.parquet says where the result goes"),
    ("sweep ball --out x.csv", "--out must end in .parquet"),
    ("sweep ball --resume x.parquet", "--resume continues the plan of its file"),
    ("sweep --resume x.parquet --out y.parquet", "--resume continues the plan of its file"),
    ("sweep --resume x.parquet --trials 5", "--resume continues the plan of its file"),
    ("sweep --resume x.parquet --seed 5", "--resume continues the plan of its file"),
    ("sweep report x.parquet --level 2", "--level must be a number between 0 and 1"),
]
"""Status 2: what was typed wrongly is named, with what is allowed."""

NOT_DONE = [
    ("learn ball --frames 3 --trials 1 --out x.json", "got 1 in 1 track;"),
    ("learn ball --out /nowhere/x.json", "/nowhere/x.json cannot be written"),
    ("learn there_is_none.pft --out x.json", "the file there_is_none.pft does not exist"),
    ("run ball --learned there_is_none.json", "the file there_is_none.json does not exist"),
    ("run ball --set learned=@there_is_none.json", "the file there_is_none.json does not exist"),
    ("sweep --resume none.parquet", "the sweep none.parquet does not exist, neither finished nor begun"),
    ("sweep --resume text.parquet", "text.parquet is not a Parquet file, or was cut short"),
    ("sweep report none.parquet", "the file none.parquet does not exist"),
    ("sweep report text.parquet", "text.parquet is not a Parquet file, or was cut short"),
    ("sweep ball --out nowhere/a.parquet", "cannot be written: the folder"),
    ("show-recipe none.json", "does not exist"),
    ("run ball --video none.mp4 --box 1,2,3,4", "does not exist", "none.mp4"),
    ("run ball --video CLIP --box 20,30,10,8 --truth none.csv", "does not exist", "none.csv"),
    ("replay none.pft", "does not exist", "none.pft"),
    ("run ball --out nowhere/run.pft", "does not exist", "nowhere"),
    ("run ball --video-out nowhere/film.mp4", "does not exist", "nowhere"),
    ("run ball --out folder", "is a folder"),
    ("run ball --video-out folder.mp4", "is a folder"),
    ("lessons figure 1 --out missing/a.png", "missing/a.png", "cannot be written"),
    ("lessons figure 1 --out folder.png", "folder.png", "cannot be written"),
]
"""Status 1: files that are missing or wrong, places that cannot be written, noticed before anything is computed."""


@pytest.mark.parametrize(
    ("status", "said"), [(2, said) for said in WRONG_USE] + [(1, said) for said in NOT_DONE], ids=str
)
def test_what_cannot_be_is_refused_with_one_line(
    call: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: int, said: tuple[str, ...]
) -> None:
    """The line says what was wrong and what would be right; nothing is written."""
    monkeypatch.chdir(tmp_path)
    for name in ("folder", "folder.mp4", "folder.png"):
        Path(name).mkdir()
    Path("text.parquet").write_text("no result")
    there = sorted(tmp_path.rglob("*"))
    command, *parts = said
    refused(call(*(str(clip) if word == "CLIP" else word for word in shlex.split(command))), status, *parts)
    assert sorted(tmp_path.rglob("*")) == there


def test_with_json_a_failure_is_one_json_value_too(call: Call) -> None:
    """A program reads field, bound and value where a person reads the line."""
    code, out, err = call("run", "ball", "--set", "sample_count=0", "--json")
    error = json.loads(out)["error"]
    assert code == 2
    assert (error["field"], error["value"]) == ("sample_count", 0)
    assert err == f"pftrack: {error['message']}\n"
    assert error["bound"] in error["message"]


def test_files_that_are_wrong_are_named(call: Call, clip: Path, tmp_path: Path) -> None:
    """An empty or foreign file fails with status 1 and a line that names it."""
    for content in (b"", b"PK\x05\x06" + bytes(18), b"no video at all, and no run either" * 100):
        wrong = tmp_path / "wrong.mp4"
        wrong.write_bytes(content)
        refused(call("run", "ball", "--video", wrong, "--box", "1,2,3,4"), 1, "wrong.mp4")
        refused(call("replay", wrong), 1, "wrong.mp4")
    broken = tmp_path / "truth.csv"
    broken.write_text("frame,x,y,w,h\n0,a,2,3,4\n")
    refused(call(*on_clip(clip, "--truth", broken)), 1, "truth.csv: line 2: x must be a number of px, got 'a'")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a file system that takes no files, even of root")
def test_a_run_that_cannot_be_saved_is_told_by_the_name_given(call: Call) -> None:
    """What fails only when the file is written names the file that was asked for, not the one written beside it."""
    status, _, err = call("run", "ball", "--frames", 2, "--out", "/proc/run.pft")
    assert (status, "/proc/run.pft cannot be written" in err, ".part" in err) == (1, True, False), err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_refused(call: Call, tmp_path: Path) -> None:
    """A folder that may not be written to is said to be read-only."""
    tmp_path.chmod(0o500)
    refused(call("run", "ball", "--out", tmp_path / "run.pft"), 1, "read-only")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_one_line() -> None:
    """A result that cannot be written does not end in a traceback."""
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "pftrack", "list", "--json"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=100)
    assert (done.returncode, done.stderr) == (1, "pftrack: No space left on device\n")


def test_a_reader_that_goes_away_is_no_drama() -> None:
    """`pftrack show | head -1` ends quietly when the reader has had enough."""
    command = [sys.executable, "-m", "pftrack", "show", "ball", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        writer.stdout.close()
        writer.stdout = None
        _, said = writer.communicate(timeout=100)
    assert (writer.returncode, said) == (1, b"")


def test_an_interrupted_run_says_so_and_leaves_no_files(tmp_path: Path) -> None:
    """Ctrl-C ends with one line and status 1, and neither a film nor half of one is left."""
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


def test_a_fault_of_our_own_is_one_line_as_well(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that nobody foresaw is owned up to in one line, and a developer can ask for more."""

    def fail(_name: str) -> None:
        raise TypeError("that\nshould not happen")

    monkeypatch.setattr("pftrack.cli.experiments.find_experiment", fail)
    refused(call("show", "ball"), 1, "a fault of pftrack", "TypeError: that should not happen", "PFTRACK_DEBUG=1")
    monkeypatch.setenv("PFTRACK_DEBUG", "1")
    with pytest.raises(TypeError):
        main(["show", "ball"])
