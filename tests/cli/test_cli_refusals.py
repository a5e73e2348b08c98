"""Failures of the command line: one clear line, nothing on standard output, and a status that says which."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pftrack.cli.app import main
from tests.cli.commands import FRAMES, Call, on_clip, refused


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ((), ("name a command",)),
        (("dance",), ("dance",)),
        (("run",), ("experiment",)),
        (("run", "ball", "--trackr", "apf"), ("--trackr", "--tracker")),
        (("run", "cube"), ("experiment must be one of ", "ball", "sine", "got 'cube'")),
        (("show", "cube"), ("experiment must be one of ", "got 'cube'")),
        (("run", "ball", "--tracker", "magic"), ("one of", "h-spf", "got 'magic'")),
        (("run", "ball", "--preset", "fwe"), ("the preset of ball must be one of works, too-wide,", "got 'fwe'")),
        (("sweep", "ball", "--preset", "fwe"), ("the preset of ball must be one of works, too-wide,", "got 'fwe'")),
        (("run", "ball", "--seed", "-1"), ("--seed", "-1")),
        (("run", "ball", "--seed", "abc"), ("--seed", "abc")),
        (("run", "ball", "--seed", str(2**64)), ("--seed",)),
        (("run", "ball", "--frames", "0"), ("--frames", "0")),
        (("run", "ball", "--frames", "nan"), ("--frames", "nan")),
        (("run", "ball", "--frames", str(10**12)), ("--frames must be a whole number between 1 and",)),
        (("run", "ball", "--frames", "2.5"), ("--frames must be a whole number", "got '2.5'")),
        (("run", "ball", "--set", "sample_count"), ("expected name=value, got 'sample_count'",)),
        (("run", "ball", "--set", "=3"), ("expected name=value, got '=3'",)),
        (("run", "ball", "--set", "sample_cont=3"), ("no parameter 'sample_cont'", "did you mean sample_count")),
        (("run", "ball", "--set", "sample_count=0"), ("sample_count must be a whole number between 1 and", "got 0")),
        (("run", "ball", "--set", "sample_count=1e9"), ("sample_count", "got '1e9'")),
        (("run", "ball", "--set", "sample_count=nan"), ("sample_count", "got 'nan'")),
        (("run", "ball", "--set", "sample_count=abc"), ("sample_count", "got 'abc'")),
        (("run", "ball", "--set", "gamma_px=nan"), ("gamma_px must be a finite number between", "px")),
        (("run", "ball", "--set", "gamma_min_px=21"), ("gamma_min_px must be at most gamma_max_px (20 px)",)),
        (("run", "ball", "--set", "ball_colour=red"), ("ball_colour must be a colour as #rrggbb",)),
        (("run", "ball", "--set", "learn_dynamics=perhaps"), ("learn_dynamics must be true or false",)),
        (("run", "ball", "--set", "apf_weights=x"), ("apf_weights must be one of sharpened, corrected",)),
        (("run", "ball", "--box", "1,2,3,4"), ("--box needs --video",)),
        (("run", "ball", "--start", "0"), ("--start needs --video",)),
        (("run", "ball", "--truth", "truth.csv"), ("--truth needs --video",)),
        (("run", "sine", "--video", "clip.mp4", "--box", "1,2,3,4"), ("sine is simulated and takes no --video",)),
        (("run", "ball", "--video", "clip.mp4"), ("--video needs --mark box:x,y,w,h",)),
        (("run", "ball", "--video-out", "film.avi"), ("must end in .mp4, got 'film.avi'",)),
        (("run", "ball", "--out", "a.mp4", "--video-out", "a.mp4"), ("must be different files",)),
        (("bench", "speed"), ("one of", "filter_step", "got 'speed'")),
        (("reproduce", "fusion"), ("a result must be one of", "one-step", "got 'fusion'")),
        (("reproduce", "--jobs", "0"), ("--jobs",)),
        (("doctor", "--port", "70000"), ("--port",)),
    ],
)
def test_wrong_use_is_refused_with_one_line_and_status_2(
    call: Call, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    """What was typed wrongly is named, with what is allowed."""
    refused(call(*arguments), 2, *parts)


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ("1,2,3", "--box expected 4 finite numbers (x,y,w,h), got '1,2,3'"),
        ("1,2,3,4,5", "--box expected 4 finite numbers (x,y,w,h), got '1,2,3,4,5'"),
        ("a,b,c,d", "--box expected 4 finite numbers (x,y,w,h), got 'a,b,c,d'"),
        ("nan,2,3,4", "--box expected 4 finite numbers"),
        ("1,2,0,4", "mark must be a box of at least 1 px within the picture of 120 x 80 px"),
        ("1,2,3,-4", "mark must be a box of at least 1 px within the picture of 120 x 80 px"),
        ("-1,2,3,4", "within the picture of 120 x 80 px, got 'x = -1, y = 2"),
        ("110,2,20,4", "within the picture of 120 x 80 px, got 'x = 110, y = 2"),
        ("1e300,2,3,4", "mark.x must be"),
    ],
)
def test_an_impossible_box_is_refused(call: Call, clip: Path, box: str, message: str) -> None:
    """A box that is no box, or not inside the picture, is refused with both sizes."""
    refused(call("run", "ball", "--video", clip, f"--box={box}"), 2, message)


def test_a_start_behind_the_end_is_refused(call: Call, clip: Path) -> None:
    """The message names the number of frames that there are."""
    refused(
        call(*on_clip(clip, "--start", 500)), 2, f"start must be a frame of the recording, 0 to {FRAMES - 1}, got 500"
    )


def test_with_json_a_failure_is_one_json_value_too(call: Call) -> None:
    """A program reads field, bound and value where a person reads the line."""
    code, out, err = call("run", "ball", "--set", "sample_count=0", "--json")
    error = json.loads(out)["error"]
    assert code == 2
    assert (error["field"], error["value"]) == ("sample_count", 0)
    assert err == f"pftrack: {error['message']}\n"
    assert error["bound"] in error["message"]


def test_files_that_are_missing_or_wrong_are_named(call: Call, clip: Path, tmp_path: Path) -> None:
    """A missing, empty or foreign file fails with status 1 and a line that names it."""
    refused(
        call("run", "ball", "--video", tmp_path / "none.mp4", "--box", "1,2,3,4"),
        1,
        "does not exist",
        "none.mp4",
    )
    refused(call(*on_clip(clip, "--truth", tmp_path / "none.csv")), 1, "does not exist", "none.csv")
    refused(call("replay", tmp_path / "none.pft"), 1, "does not exist", "none.pft")
    for content in (b"", b"PK\x05\x06" + bytes(18), b"no video at all, and no run either" * 100):
        wrong = tmp_path / "wrong.mp4"
        wrong.write_bytes(content)
        refused(call("run", "ball", "--video", wrong, "--box", "1,2,3,4"), 1, "wrong.mp4")
        refused(call("replay", wrong), 1, "wrong.mp4")
    broken = tmp_path / "truth.csv"
    broken.write_text("frame,x,y,w,h\n0,a,2,3,4\n")
    refused(call(*on_clip(clip, "--truth", broken)), 1, "truth.csv: line 2: x must be a number of px, got 'a'")


def test_places_that_cannot_be_written_are_refused_before_anything_is_computed(call: Call, tmp_path: Path) -> None:
    """A missing folder, or a folder in the file's place, is noticed at once."""
    for option, name in (("--out", "run.pft"), ("--video-out", "film.mp4")):
        refused(call("run", "ball", option, tmp_path / "nowhere" / name), 1, "does not exist", "nowhere")
        (tmp_path / name).mkdir()
        refused(call("run", "ball", option, tmp_path / name), 1, "is a folder")


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
    writer = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert writer.stdout is not None
    assert writer.stderr is not None
    writer.stdout.close()
    said = writer.stderr.read()
    writer.stderr.close()
    assert writer.wait(timeout=100) == 1
    assert said == b""


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
