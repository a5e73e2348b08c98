"""`pftrack run` and `replay`: tables, scores, saved runs and films."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from shutil import copy
from typing import Any

import av
import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing, Text
from pftrack.experiments import EXPERIMENTS, find
from tests.cli.commands import FRAMES, Ask, Call, on_clip, refused

KEYS = {
    *("experiment", "tracker", "seed", "frames", "parameters", "success", "mean_error_px", "lost_frames"),
    *("first_lost_frame", "labelled_frames", "hit_rate", "step_ms_median", "estimates_sha256"),
}


def test_run_in_a_process_of_its_own_prints_exactly_one_json_value(ask: Ask) -> None:
    """Standard output is one strict JSON object with the measures, and standard error is empty.

    Runs in different processes agree to the bit with the same seed, and differ with another.
    """
    arguments = "run", "ball", "--frames", "20", "--tracker", "s-spf", "--set", "sample_count=200", "--seed"
    command = [sys.executable, "-m", "pftrack", *arguments, "3", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert (done.returncode, done.stderr) == (0, "")
    result = json.loads(done.stdout, parse_constant=pytest.fail)
    assert result.keys() >= KEYS
    expected = {"experiment": "ball", "tracker": "s-spf", "seed": 3, "frames": 20}
    assert result.items() >= expected.items()
    assert result["parameters"]["sample_count"] == 200
    same, other = (ask(*arguments, seed)["estimates_sha256"] for seed in (3, 4))
    assert same == result["estimates_sha256"] != other


def test_without_json_there_is_a_table(call: Call, ask: Ask) -> None:
    """Standard output has the same figures as a table, with changed parameters only."""
    sine = "run", "sine", "--frames", 10, "--set", "sample_count=200"
    code, out, _ = call(*sine)
    words = "sample_count=200", "estimates sha256", "mean error", ask(*sine)["estimates_sha256"]
    assert (code, [it for it in words if it not in out], "observation_noise_sd" in out) == (0, [], False)
    assert "the defaults" in call("run", "sine", "--frames", 2)[1]


def test_a_clip_is_tracked_and_scored_against_its_table(ask: Ask, clip: Path) -> None:
    """A run on a video has the numbers of labelled frames and of hits."""
    table = clip.with_name("truth.csv")
    result = ask(*on_clip(clip, "--truth", table))
    counted = {"frames": FRAMES, "labelled_frames": FRAMES, "frames_to_failure": FRAMES}
    shares = {"hit_rate": 1.0, "inside_share": 1.0, "precision_20px": 1.0, "success_measure": "inside_share"}
    assert result.items() >= (counted | shares).items()
    assert result["mean_error_px"] < 5
    assert 0 < result["normalised_error"] < 0.5
    assert "mean_iou" not in result
    window = ask("run", "histogram", "--video", clip, "--box", "20,30,10,8", "--truth", table)
    assert 0.5 < window["mean_iou"] <= 1.0


def test_an_unsuitable_target_is_reported(call: Call, clip: Path) -> None:
    """A box on the ground does not suit, with a remark on standard error; a target of a simulated scene has none.

    A parameter that the tracker does not read causes a remark, too.
    """
    _, out, err = call("run", "ball", "--video", clip, "--box", "80,5,20,20", "--frames", 2, "--json")
    badly = json.loads(out)
    assert badly["suitability"] < 0.3
    assert "separates not at all" in badly["suitability_remark"].lower()
    assert badly["suitability_remark"] in err
    code, out, err = call("run", "ball", "--tracker", "condensation", "--set", "gamma_px=9", "--frames", 3, "--json")
    simulated = json.loads(out)
    assert (code, "suitability" in simulated, simulated["parameters"]["gamma_px"]) == (0, False, 9)
    assert "gamma_px is not read by condensation" in err


def test_frames_of_a_clip(ask: Ask, clip: Path, tmp_path: Path) -> None:
    """`--frames` beyond the end of a clip means all frames from `--start`, by default the first with a known truth."""
    assert ask(*on_clip(clip, "--frames", 500, "--start", 2))["frames"] == FRAMES - 2
    assert ask(*on_clip(clip, "--frames", 5))["frames"] == 5
    rows = clip.with_name("truth.csv").read_text().splitlines()
    late = tmp_path / "late.csv"
    late.write_text("\n".join([rows[0], "0,,,,,", "1,,,,,", *rows[4:]]))
    summary = ask("run", "ball", "--video", clip, "--box", "26,30,10,8", "--truth", late)
    assert (summary["frames"], summary["hit_rate"]) == (FRAMES - 3, 1.0)


def test_a_saved_run_replays_to_the_same_numbers(ask: Ask, tmp_path: Path) -> None:
    """`run --out` and `replay` give the same summary except for times."""
    out = tmp_path / "run.pft"
    ran = ask("run", "ball", "--frames", 30, "--set", "occlusion_width_px=60", "--out", out)
    replayed = ask("replay", out)
    timed = {"step_ms_median": ran["step_ms_median"]}
    assert replayed | timed == {**ran, "same_as_saved": True}


def test_a_run_on_a_clip_replays_and_moves_with_it(call: Call, ask: Ask, clip: Path, tmp_path: Path) -> None:
    """The saved run finds the video next to it and contains the table; `--video` gives another place."""
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    video = Path(copy(clip, here))
    ran = ask(*on_clip(video, "--truth", clip.with_name("truth.csv"), "--out", here / "run.pft"))
    here.rename(there)
    replayed = ask("replay", there / "run.pft")
    assert (replayed["estimates_sha256"], replayed["hit_rate"]) == (ran["estimates_sha256"], ran["hit_rate"])
    (there / "clip.mp4").unlink()
    refused(call("replay", there / "run.pft"), 1, "which does not exist; give its path with --video")
    assert ask("replay", there / "run.pft", "--video", clip)["same_as_saved"] is True


def test_a_preset_gives_tracker_values_and_seed(ask: Ask) -> None:
    """`--preset` sets tracker and values; other options override it."""
    few = ask("run", "ball", "--preset", "few", "--frames", 5)
    assert (few["tracker"], few["parameters"]["sample_count"]) == ("h-spf", 40)
    said = "--tracker", "apf", "--set", "sample_count=60", "--seed", 3
    own = ask("run", "ball", "--preset", "few", *said, "--frames", 5)
    assert (own["tracker"], own["parameters"]["sample_count"], own["seed"]) == ("apf", 60, 3)


def test_a_film_omits_faulty_primitives(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A faulty drawing of an experiment does not end the run; the film has a picture per frame and is the only file."""
    sine = find("sine")

    def draw(*given: Any) -> Drawing:
        drawn = sine.draw(*given)
        return replace(drawn, primitives={**drawn.primitives, "name": Text(np.zeros(3), 7, (0, 0, 0), "estimate")})  # type: ignore[arg-type]

    monkeypatch.setitem(EXPERIMENTS._known, "sine", replace(sine, draw=draw))
    film = tmp_path / "a.mp4"
    status, _, err = call("run", "sine", "--frames", 3, "--video-out", film)
    assert status == 0, err
    with av.open(film) as container:
        assert sum(1 for _ in container.decode(video=0)) == 3
    assert list(tmp_path.iterdir()) == [film]


def test_compiling_is_announced(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run and its replay report on standard error that they compile, and the number of functions."""

    @contextmanager
    def watched(begun: Callable[[str], None], ended: Callable[[str, float], None]) -> Iterator[None]:
        begun("one")
        ended("one", 0.1)
        yield

    monkeypatch.setattr("pftrack.doctor.compiling.watch", watched)
    saved = tmp_path / "a.pft"
    for command in (("run", "sine", "--frames", 2, "--out", saved), ("replay", saved)):
        status, out, err = call(*command, "--json")
        assert (status, json.loads(out)["frames"]) == (0, 2)
        assert "compiling the code needed here (once)" in err
        assert "1 functions compiled" in err
