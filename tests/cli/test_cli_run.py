"""`pftrack run` and `replay`: tables, scores, saved runs and films, by the library's own numbers."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import Drawing, Text
from pftrack.experiments import EXPERIMENTS, find
from tests.cli.commands import FRAMES, Call, on_clip, refused

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


def test_run_in_a_process_of_its_own_prints_exactly_one_json_value(call: Call) -> None:
    """Standard output is one JSON object with what was measured, in strict JSON; nothing else is said.

    Two runs, here and there, agree to the bit if and only if their seeds do.
    """
    arguments = "run", "ball", "--frames", "20", "--tracker", "s-spf", "--set", "sample_count=200", "--json", "--seed"
    done = process(*arguments, "3")
    assert (done.returncode, done.stderr) == (0, "")
    result = json.loads(done.stdout, parse_constant=pytest.fail)
    assert result.keys() >= KEYS
    assert (result["experiment"], result["tracker"], result["seed"], result["frames"]) == ("ball", "s-spf", 3, 20)
    assert result["parameters"]["sample_count"] == 200
    same, other = (json.loads(call(*arguments, seed)[1]) for seed in (3, 4))
    assert same["estimates_sha256"] == result["estimates_sha256"] != other["estimates_sha256"]


def test_people_are_told_which_parameters_are_not_the_defaults(call: Call) -> None:
    """Of fifty parameters the one that was set stands in the table."""
    code, out, _ = call("run", "ball", "--frames", 5, "--set", "sample_count=200")
    assert code == 0
    assert "sample_count=200" in out
    assert "ball_radius_px" not in out


def test_without_json_people_get_a_table(call: Call) -> None:
    """The same figures as a table, on standard output."""
    code, out, _ = call("run", "sine", "--frames", 10)
    assert code == 0
    assert "the defaults" in out
    assert "estimates sha256" in out
    assert "mean error" in out
    assert json.loads(call("run", "sine", "--frames", 10, "--json")[1])["estimates_sha256"] in out  # nothing is folded


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


def test_a_tracker_that_believes_in_a_size_is_scored_by_its_overlap(call: Call, clip: Path) -> None:
    """A window on a video is scored by the overlap of its boxes with the true ones; trackers of a point are not."""
    table = clip.with_name("truth.csv")
    window = call("run", "histogram", "--video", clip, "--box", "20,30,10,8", "--truth", table, "--json")[1]
    assert 0.5 < json.loads(window)["mean_iou"] <= 1.0
    assert "mean_iou" not in json.loads(call(*on_clip(clip, "--truth", table, "--json"))[1])


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


def test_a_truth_outside_the_picture_is_told(call: Call, clip: Path, tmp_path: Path) -> None:
    """As of a clip of another size, or after the last frame; where all is after it, there is nothing to measure."""
    inside = clip.with_name("truth.csv")
    assert "outside" not in call(*on_clip(clip, "--truth", inside, "--json"))[2]
    large = tmp_path / "large.csv"
    large.write_text("frame,x,y,w,h\n" + "".join(f"{frame},200,300,100,80\n" for frame in range(2 * FRAMES)))
    error = call(*on_clip(clip, "--truth", large, "--json"))[2]
    assert f"pftrack: {FRAMES} of {FRAMES} true boxes lie wholly outside the picture of 120 x 80 px: frames" in error
    assert f"The file lists {FRAMES} frames after the last of the recording, {FRAMES - 1}; they are left out." in error
    large.write_text("frame,x,y,w,h\n1001,20,30,10,8\n")
    refused(call(*on_clip(clip, "--truth", large)), 1, f"of the recording's frames, 0 to {FRAMES - 1}", "at frame 1001")


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


def test_a_preset_gives_tracker_values_and_seed(call: Call) -> None:
    """`--preset` begins with what the preset has; what is said beside it goes before."""
    few = json.loads(call("run", "ball", "--preset", "few", "--frames", 5, "--json")[1])
    assert (few["tracker"], few["parameters"]["sample_count"]) == ("h-spf", 40)
    said = "--tracker", "apf", "--set", "sample_count=60", "--seed", 3
    own = json.loads(call("run", "ball", "--preset", "few", *said, "--frames", 5, "--json")[1])
    assert (own["tracker"], own["parameters"]["sample_count"], own["seed"]) == ("apf", 60, 3)


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
    monkeypatch.setattr("pftrack.doctor.compiling.watch", watched)
    command = ("replay", saved) if again else ("run", "sine", "--frames", 2)
    status, out, err = call(*command, "--json")
    assert status == 0
    assert json.loads(out)["frames"] == 2
    assert "compiling what this needs, only once" in err
    assert "1 functions compiled" in err
