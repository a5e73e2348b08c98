"""Recipes on the command line: a run as a file that people write."""

import json
from pathlib import Path

import pytest

from tests.cli.commands import FRAMES, Ask, Call


def written(folder: Path, recipe: object) -> Path:
    path = folder / "recipe.json"
    path.write_text(json.dumps(recipe))
    return path


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    timeline = [{"frame": 9, "values": {"sample_count": 60}}]
    return written(tmp_path, {"experiment": "sine", "seed": 5, "frames": 30, "timeline": timeline})


def test_a_recipe_is_run_and_shown_again(call: Call, ask: Ask, recipe: Path, tmp_path: Path) -> None:
    """A person's file is run; `show-recipe` of the saved run gives the same numbers.

    Seed, length and values on the command line change the run.
    """
    saved, again = tmp_path / "run.pft", tmp_path / "again.json"
    ran = ask("run", recipe, "--out", saved)
    assert (ran["seed"], ran["frames"]) == (5, 30)
    again.write_text(call("show-recipe", saved)[1])
    assert json.loads(again.read_text())["timeline"] == [{"frame": 9, "values": {"sample_count": 60}}]
    assert ask("run", again)["estimates_sha256"] == ran["estimates_sha256"]
    assert json.loads(call("show-recipe", recipe)[1]) == json.loads(recipe.read_text())
    ran = ask("run", recipe, "--seed", 6, "--frames", 12, "--set", "sample_count=40")
    assert (ran["seed"], ran["frames"], ran["parameters"]["sample_count"]) == (6, 12, 40)


MARK = {"kind": "box", "x": 20, "y": 30, "width": 10, "height": 8}


def test_a_recipe_finds_its_clip(ask: Ask, clip: Path, tmp_path: Path) -> None:
    """The path of a recording is relative to the file; `--mark-out` draws its mark."""
    (tmp_path / "clip.mp4").write_bytes(clip.read_bytes())
    path = written(tmp_path, {"experiment": "ball", "footage": {"path": "clip.mp4", "mark": MARK}})
    ran = ask("run", path, "--mark-out", tmp_path / "mark.png")
    assert (tmp_path / "mark.png").read_bytes().startswith(b"\x89PNG")
    same = ask("run", "ball", "--video", clip, "--mark", "box:20,30,10,8")
    assert (ran["frames"], ran["estimates_sha256"]) == (FRAMES, same["estimates_sha256"])


def test_a_truth_leaves_the_start_of_a_recipe(ask: Ask, clip: Path, tmp_path: Path) -> None:
    """The frame of the mark in a recipe stays, though the truth begins earlier."""
    footage = {"name": clip.name, "mark": {**MARK, "x": 26}, "start": 3}
    path = written(tmp_path, {"experiment": "ball", "footage": footage})
    ran = ask("run", path, "--video", clip, "--truth", clip.with_name("truth.csv"))
    assert (ran["frames"], ran["labelled_frames"], ran["inside_share"]) == (FRAMES - 3, FRAMES - 3, 1.0)
