"""The command line: one JSON value on standard output, one clear line on failure, an exit status that says which."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack import __version__
from pftrack.cli.app import main
from pftrack.drawing import Drawing, Text
from pftrack.experiments import EXPERIMENTS, find
from tests.cli.commands import FRAMES, Call, refused

KEYS = {
    "experiment",
    "tracker",
    "seed",
    "frames",
    "parameters",
    "success",
    "mean_error_px",
    "lost_frames",
    "first_lost_frame",
    "labelled_frames",
    "hit_rate",
    "step_ms_median",
    "estimates_sha256",
}


def process(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pftrack", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100, **options)


def on_clip(clip: Path, *more: object) -> tuple[object, ...]:
    return "run", "ball", "--video", clip, "--box", "20,30,10,8", *more


# ---------------------------------------------------------------- what there is


def test_list_names_every_experiment(call: Call) -> None:
    """`list` prints each experiment, and with `--json` one list of them with trackers and presets."""
    code, out, _ = call("list")
    assert code == 0
    assert all(name in out for name in EXPERIMENTS)
    listed = json.loads(call("list", "--json")[1])
    assert [entry["id"] for entry in listed] == list(EXPERIMENTS)
    assert listed[0]["trackers"][0].keys() == {"id", "title", "description"}


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_show_gives_every_parameter_with_all_that_is_declared(call: Call, name: str) -> None:
    """`show` prints each parameter's name, default, bounds and help; `--json` the declarations themselves."""
    shown = json.loads(call("show", name, "--json")[1])
    table = call("show", name)[1]
    for declaration in shown["declarations"]:
        assert declaration["name"] in table
        assert declaration["title"]
        assert declaration["description"]
        assert {"unit", "default", "minimum", "maximum", "step", "choices", "live"} <= declaration.keys()


def test_help_lists_the_commands_of_other_packages_too(call: Call) -> None:
    """`--help` shows the library's commands and `serve`, which comes from the server by an entry point."""
    code, out, _ = call("--help")
    assert code == 0
    for command in ("serve", "list", "show", "run", "replay", "reproduce", "bench", "doctor"):
        assert command in out
    assert "--port" in call("serve", "--help")[1]


def test_version(call: Call) -> None:
    """`--version` prints the version and ends well."""
    assert call("--version")[:2] == (0, f"pftrack {__version__}\n")


# ---------------------------------------------------------------- runs


def test_run_in_a_process_of_its_own_prints_exactly_one_json_value() -> None:
    """Standard output is one JSON object with what was measured, in strict JSON; nothing else is said."""
    done = process(
        "run", "ball", "--frames", "20", "--seed", "3", "--tracker", "s-spf", "--set", "sample_count=200", "--json"
    )
    assert (done.returncode, done.stderr) == (0, "")
    result = json.loads(done.stdout, parse_constant=pytest.fail)
    assert result.keys() >= KEYS
    assert (result["experiment"], result["tracker"], result["seed"], result["frames"]) == ("ball", "s-spf", 3, 20)
    assert result["parameters"]["sample_count"] == 200


def test_the_same_seed_gives_the_same_estimates_in_another_process(call: Call) -> None:
    """Two runs agree to the bit if and only if their seeds do."""
    same = json.loads(call("run", "ball", "--frames", 15, "--seed", 7, "--json")[1])
    again = json.loads(process("run", "ball", "--frames", "15", "--seed", "7", "--json").stdout)
    other = json.loads(call("run", "ball", "--frames", 15, "--seed", 8, "--json")[1])
    assert same["estimates_sha256"] == again["estimates_sha256"] != other["estimates_sha256"]


def test_without_json_people_get_a_table(call: Call) -> None:
    """The same figures as a table, on standard output."""
    code, out, _ = call("run", "sine", "--frames", 10)
    assert code == 0
    assert "estimates sha256" in out
    assert "mean error" in out


def test_a_clip_is_tracked_and_scored_against_its_table(call: Call, clip: Path) -> None:
    """A run on a video counts the labelled frames and how many of them were hit."""
    result = json.loads(call(*on_clip(clip, "--truth", clip.with_name("truth.csv"), "--json"))[1])
    assert (result["frames"], result["labelled_frames"]) == (FRAMES, FRAMES)
    assert result["hit_rate"] == 1.0
    assert result["mean_error_px"] < 5
    assert result["success_measure"] == "inside_share"
    assert (result["inside_share"], result["precision_20px"]) == (1.0, 1.0)
    assert result["frames_to_failure"] == FRAMES
    assert 0 < result["normalised_error"] < 0.5


def test_a_target_is_judged_before_it_is_tracked(call: Call, clip: Path) -> None:
    """A square of its own colour suits well; a box on the ground not at all, which is also said on standard error."""
    well = json.loads(call(*on_clip(clip, "--frames", 2, "--json"))[1])
    assert well["suitability"] > 0.6
    assert well["suitability_remark"].startswith("Separates well: ")
    _, out, err = call("run", "ball", "--video", clip, "--box", "80,5,20,20", "--frames", 2, "--json")
    badly = json.loads(out)
    assert badly["suitability"] < 0.3
    assert "separates not at all" in badly["suitability_remark"].lower()
    assert badly["suitability_remark"] in err


def test_a_simulated_scene_is_not_asked_whether_it_suits(call: Call) -> None:
    """It is made to be tracked, or to fail; nothing is said beforehand."""
    result = json.loads(call("run", "ball", "--frames", 2, "--json")[1])
    assert "suitability" not in result
    assert result["success_measure"] == "hit_rate"


def test_a_pose_has_no_measures_of_a_box(call: Call) -> None:
    """Measures that make no sense are absent, not 0."""
    result = json.loads(call("run", "prism", "--frames", 3, "--json")[1])
    assert "precision_10deg" in result
    assert not {"inside_share", "precision_20px", "normalised_error", "median_error_px"} & result.keys()


def test_a_clip_without_a_table_has_no_score(call: Call, clip: Path) -> None:
    """Where the truth is not known, success and hit rate are null, not guessed."""
    result = json.loads(call(*on_clip(clip, "--start", 4, "--json"))[1])
    assert result["frames"] == FRAMES - 4
    assert (result["labelled_frames"], result["hit_rate"], result["success"]) == (0, None, None)


def test_a_saved_run_replays_to_the_same_numbers(call: Call, tmp_path: Path) -> None:
    """`run --out` and `replay` give the same summary, timing aside."""
    out = tmp_path / "run.pft"
    ran = json.loads(call("run", "ball", "--frames", 30, "--set", "occlusion_width_px=60", "--out", out, "--json")[1])
    replayed = json.loads(call("replay", out, "--json")[1])
    assert replayed.pop("same_as_saved") is True
    del ran["step_ms_median"], replayed["step_ms_median"]
    assert replayed == ran


def test_a_clip_begins_at_its_first_frame_with_truth(call: Call, clip: Path, tmp_path: Path) -> None:
    """Without `--start` the box is taken to be drawn on the first frame whose truth is known."""
    rows = clip.with_name("truth.csv").read_text().splitlines()
    late = tmp_path / "late.csv"
    late.write_text("\n".join([rows[0], "0,,,,,", "1,,,,,", *rows[4:]]))
    box = ("--box", "26,30,10,8")
    summary = json.loads(call("run", "ball", "--video", clip, *box, "--truth", late, "--json")[1])
    assert summary["frames"] == FRAMES - 3
    assert summary["hit_rate"] == 1.0


def test_a_run_on_a_clip_replays_with_its_truth_and_moves_with_its_clip(call: Call, clip: Path, tmp_path: Path) -> None:
    """The saved run finds the video beside it and keeps the table; a video that was moved can be pointed out."""
    here = tmp_path / "here"
    here.mkdir()
    video = here / "clip.mp4"
    video.write_bytes(clip.read_bytes())
    saved = here / "run.pft"
    ran = json.loads(call(*on_clip(video, "--truth", clip.with_name("truth.csv"), "--out", saved, "--json"))[1])
    here.rename(tmp_path / "there")
    saved = tmp_path / "there" / "run.pft"
    replayed = json.loads(call("replay", saved, "--json")[1])
    assert (replayed["estimates_sha256"], replayed["hit_rate"]) == (ran["estimates_sha256"], ran["hit_rate"])
    (tmp_path / "there" / "clip.mp4").unlink()
    refused(call("replay", saved), 1, "which is not there; say with --video where it is")
    assert json.loads(call("replay", saved, "--video", clip, "--json")[1])["same_as_saved"] is True


def test_a_run_is_written_as_a_film(call: Call, tmp_path: Path) -> None:
    """`--video-out` writes one picture a frame and leaves nothing else behind."""
    import av

    film = tmp_path / "film.mp4"
    assert call("run", "ball", "--frames", 5, "--video-out", film, "--json")[0] == 0
    with av.open(film) as container:
        assert sum(1 for _ in container.decode(video=0)) == 5
    assert list(tmp_path.iterdir()) == [film]


def test_a_parameter_that_the_tracker_does_not_read_is_mentioned(call: Call) -> None:
    """A value without effect is accepted, and it is said on standard error, not on standard output."""
    code, out, err = call("run", "ball", "--tracker", "condensation", "--set", "gamma_px=9", "--frames", 3, "--json")
    assert code == 0
    assert json.loads(out)["parameters"]["gamma_px"] == 9
    assert "gamma_px is not read by condensation" in err


def test_more_frames_than_a_clip_has_are_all_that_it_has(call: Call, clip: Path) -> None:
    """`--frames` beyond the end of a clip means as many as there are, from its start on."""
    result = json.loads(call(*on_clip(clip, "--frames", 500, "--start", 2, "--json"))[1])
    assert result["frames"] == FRAMES - 2
    assert json.loads(call(*on_clip(clip, "--frames", 5, "--json"))[1])["frames"] == 5


def test_show_says_where_an_experiment_comes_from(call: Call) -> None:
    """`show` cites author, title and year in full; with `--json` as BibTeX too."""
    assert "Takashi Bando: Adaptive Sampling Method" in call("show", "ball")[1]
    assert json.loads(call("show", "ball", "--json")[1])["references"][0]["key"] == "bando2007"


def test_show_names_the_presets(call: Call) -> None:
    """`show` prints the name by which `--preset` knows each."""
    shown = call("show", "ball")[1]
    assert all(preset.name in shown for preset in find("ball").presets)
    assert "what to look at" in shown
    told = json.loads(call("show", "ball", "--json")[1])["presets"]
    assert [each["watch"] for each in told] == [preset.watch for preset in find("ball").presets]


def test_a_preset_gives_tracker_values_and_seed(call: Call) -> None:
    """`--preset` begins with what the preset has; what is said beside it goes before."""
    few = json.loads(call("run", "ball", "--preset", "few", "--frames", 5, "--json")[1])
    assert (few["tracker"], few["parameters"]["sample_count"]) == ("h-spf", 40)
    said = "--tracker", "apf", "--set", "sample_count=60", "--seed", 3
    own = json.loads(call("run", "ball", "--preset", "few", *said, "--frames", 5, "--json")[1])
    assert (own["tracker"], own["parameters"]["sample_count"], own["seed"]) == ("apf", 60, 3)


# ---------------------------------------------------------------- wrong use


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ((), ("name a command",)),
        (("dance",), ("dance",)),
        (("run",), ("experiment",)),
        (("run", "ball", "--trackr", "apf"), ("--trackr", "--tracker")),
        (("run", "cube"), ("there is no experiment 'cube'", "ball", "sine")),
        (("show", "cube"), ("there is no experiment 'cube'",)),
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
        (("run", "ball", "--set", "sample_count=-1"), ("sample_count", "got -1")),
        (("run", "ball", "--set", "sample_count=1e9"), ("sample_count", "got '1e9'")),
        (("run", "ball", "--set", "sample_count=1000000000"), ("sample_count", "got 1000000000")),
        (("run", "ball", "--set", "sample_count=nan"), ("sample_count", "got 'nan'")),
        (("run", "ball", "--set", "sample_count=abc"), ("sample_count", "got 'abc'")),
        (("run", "ball", "--set", "gamma_px=nan"), ("gamma_px must be a finite number between", "px")),
        (("run", "ball", "--set", "gamma_px=inf"), ("gamma_px must be a finite number between",)),
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
        ("1,2,3", "--box expected 4 numbers (x,y,w,h), got 3"),
        ("1,2,3,4,5", "--box expected 4 numbers (x,y,w,h), got 5"),
        ("a,b,c,d", "--box expected 4 numbers (x,y,w,h), got 'a,b,c,d'"),
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


# ---------------------------------------------------------------- failures


def test_files_that_are_missing_or_wrong_are_named(call: Call, clip: Path, tmp_path: Path) -> None:
    """A missing, empty or foreign file fails with status 1 and a line that names it."""
    refused(
        call("run", "ball", "--video", tmp_path / "none.mp4", "--box", "1,2,3,4"),
        1,
        "there is no file or folder",
        "none.mp4",
    )
    refused(call(*on_clip(clip, "--truth", tmp_path / "none.csv")), 1, "there is no file", "none.csv")
    refused(call("replay", tmp_path / "none.pft"), 1, "there is no file", "none.pft")
    for content in (b"", b"PK\x05\x06" + bytes(18), b"no video at all, and no run either" * 100):
        wrong = tmp_path / "wrong.mp4"
        wrong.write_bytes(content)
        refused(call("run", "ball", "--video", wrong, "--box", "1,2,3,4"), 1, "wrong.mp4")
        refused(call("replay", wrong), 1, "wrong.mp4")
    broken = tmp_path / "truth.csv"
    broken.write_text("frame,x,y,w,h\n0,a,2,3,4\n")
    refused(call(*on_clip(clip, "--truth", broken)), 1, "truth.csv, line 2: x must be a number of px, got 'a'")


def test_places_that_cannot_be_written_are_refused_before_anything_is_computed(call: Call, tmp_path: Path) -> None:
    """A missing folder, or a folder in the file's place, is noticed at once."""
    for option, name in (("--out", "run.pft"), ("--video-out", "film.mp4")):
        refused(call("run", "ball", option, tmp_path / "nowhere" / name), 1, "there is no folder", "nowhere")
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

    monkeypatch.setattr("pftrack.cli.listing.experiment_named", fail)
    refused(call("show", "ball"), 1, "a fault of pftrack", "TypeError: that should not happen", "PFTRACK_DEBUG=1")
    monkeypatch.setenv("PFTRACK_DEBUG", "1")
    with pytest.raises(TypeError):
        main(["show", "ball"])


def test_a_command_that_cannot_be_loaded_does_not_hide_the_others(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a broken server the library's commands still work, and `serve` says why it does not."""
    monkeypatch.setitem(sys.modules, "server.command", None)
    assert call("--help")[0] == 0
    assert call("list")[0] == 0
    refused(call("serve"), 1, "the command serve cannot be loaded")


# ---------------------------------------------------------------- checks


@pytest.mark.parametrize(("ours", "status", "code"), [(1.95, "pass", 0), (1.0, "fail", 1)])
def test_reproduce_sets_ours_beside_the_reference(
    call: Call, monkeypatch: pytest.MonkeyPatch, ours: float, status: str, code: int
) -> None:
    """`reproduce --json` gives one list of findings, people get a table, and one that is off ends with status 1."""
    from pftrack import reproduce
    from pftrack.reproduce.finding import compare

    monkeypatch.setitem(
        reproduce.RESULTS, "one-step", lambda _pool, _full: [compare("mean", ours, 2.0, 0.1, "made up")]
    )
    ended, out, err = call("reproduce", "one-step", "--json")
    expected = {"result": "mean", "ours": ours, "reference": 2.0, "tolerance": 0.1, "source": "made up"}
    assert (ended, json.loads(out)) == (code, [expected | {"status": status}])
    assert err == ("pftrack: 1 of 1 results lie outside their tolerances\n" if code else "")
    assert "made up" in call("reproduce", "one-step")[1]


@pytest.mark.slow
def test_reproduce_computes(call: Call) -> None:
    """A real result is computed and holds."""
    code, out, _ = call("reproduce", "kalman-sine", "--quick", "--json")
    assert code == 0
    assert {finding["status"] for finding in json.loads(out)} <= {"pass", "known-negative"}


def test_doctor_reports_every_check(call: Call) -> None:
    """On the machine that runs the tests nothing that is needed is broken."""
    code, out, _ = call("doctor", "--json")
    report = json.loads(out)
    assert (code, report["healthy"]) == (0, True), report
    assert {check["status"] for check in report["checks"]} <= {"ok", "warning"}
    assert "compiled code" in call("doctor")[1]


def test_doctor_fails_when_something_needed_is_broken(call: Call, tmp_path: Path) -> None:
    """A data folder that cannot be made is broken: status 1, and the line names the check."""
    file = tmp_path / "file"
    file.touch()
    code, out, err = call("doctor", "--data-dir", file / "below", "--json")
    assert (code, json.loads(out)["healthy"]) == (1, False)
    assert err == "pftrack: broken: data folder\n"


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_bench_gives_one_value_by_name(call: Call) -> None:
    """`bench NAME --json` gives an object with each benchmark's rows; the ratio of pftrack to itself is 1."""
    results = json.loads(call("bench", "filter_step", "ball_step", "--json")[1])
    assert list(results) == ["filter_step", "ball_step"]
    ours = [row for row in results["filter_step"]["rows"] if row["library"] == "pftrack"]
    assert [row["N"] for row in ours] == [100, 1_000, 10_000]
    assert all(row["ratio"] == 1.0 and row["right"] for row in ours)


def test_bench_without_a_checkout_says_where_benchmarks_are(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """The installed package has no benchmarks, and says so."""
    monkeypatch.setattr("pftrack.cli.checks.__file__", "/somewhere/else/pftrack/cli_checks.py")
    refused(call("bench"), 1, "the benchmarks come with the source")


def test_a_film_leaves_out_what_cannot_be_shown(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A drawing with a fault, as an experiment of another package may make, does not end the run: as on the page."""
    sine = find("sine")

    def draw(*given: Any) -> Drawing:
        drawn = sine.draw(*given)
        return replace(drawn, primitives={**drawn.primitives, "name": Text(np.zeros(3), 7, (0, 0, 0), "estimate")})  # type: ignore[arg-type]

    monkeypatch.setitem(EXPERIMENTS._known, "sine", replace(sine, draw=draw))
    film = tmp_path / "a.mp4"
    status, _, err = call("run", "sine", "--frames", 3, "--video-out", film)
    assert status == 0, err
    assert film.stat().st_size > 0


@pytest.mark.parametrize("again", [False, True], ids=["run", "replay"])
def test_compiling_is_announced(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, again: bool) -> None:
    """A run, and its replay, say on standard error that they compile, and how many functions in the end."""

    @contextmanager
    def watched(begun: Callable[[str], None], ended: Callable[[str, float], None]) -> Iterator[None]:
        begun("one")
        ended("one", 0.1)
        yield

    saved = tmp_path / "a.pft"
    assert call("run", "sine", "--frames", 2, "--out", saved)[0] == 0
    monkeypatch.setattr("pftrack.warming.watch.watched", watched)
    command = ("replay", saved) if again else ("run", "sine", "--frames", 2)
    status, out, err = call(*command, "--json")
    assert status == 0
    assert json.loads(out)["frames"] == 2
    assert "compiling what this needs, only once" in err
    assert "1 functions compiled" in err
