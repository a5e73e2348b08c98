"""Recipes and marks on the command line: a run as a file that people write, and any kind of mark."""

import json
from pathlib import Path

import pytest

from tests.cli.commands import FRAMES, Call, refused


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "recipe.json"
    path.write_text(
        json.dumps(
            {"experiment": "sine", "seed": 5, "frames": 30, "timeline": [{"frame": 9, "values": {"sample_count": 60}}]}
        )
    )
    return path


def test_a_recipe_is_run_and_shown_again(call: Call, recipe: Path, tmp_path: Path) -> None:
    """A file that a person has written is run; what `show-recipe` prints of the saved run gives the same numbers."""
    saved = tmp_path / "run.pft"
    ran = json.loads(call("run", recipe, "--out", saved, "--json")[1])
    assert (ran["seed"], ran["frames"]) == (5, 30)
    shown = json.loads(call("show-recipe", saved)[1])
    assert shown["timeline"] == [{"frame": 9, "values": {"sample_count": 60}}]
    again = tmp_path / "again.json"
    again.write_text(json.dumps(shown))
    assert json.loads(call("run", again, "--json")[1])["estimates_sha256"] == ran["estimates_sha256"]
    assert json.loads(call("show-recipe", recipe)[1]) == json.loads(recipe.read_text())


def test_options_go_before_what_a_recipe_says(call: Call, recipe: Path) -> None:
    """Seed, length and values on the command line change the run of a recipe."""
    ran = json.loads(call("run", recipe, "--seed", 6, "--frames", 12, "--set", "sample_count=40", "--json")[1])
    assert (ran["seed"], ran["frames"], ran["parameters"]["sample_count"]) == (6, 12, 40)


def test_a_recipe_finds_its_clip_beside_it(call: Call, clip: Path, tmp_path: Path) -> None:
    """The path of a recording is seen from the file; its mark is any that the experiment takes."""
    (tmp_path / "clip.mp4").write_bytes(clip.read_bytes())
    mark = {"kind": "box", "x": 20, "y": 30, "width": 10, "height": 8}
    path = tmp_path / "recipe.json"
    path.write_text(json.dumps({"experiment": "ball", "footage": {"path": "clip.mp4", "mark": mark}}))
    ran = json.loads(call("run", path, "--json")[1])
    same = json.loads(call("run", "ball", "--video", clip, "--mark", "box:20,30,10,8", "--json")[1])
    assert ran["frames"] == FRAMES
    assert ran["estimates_sha256"] == same["estimates_sha256"]


def test_a_truth_leaves_the_start_of_a_recipe(call: Call, clip: Path, tmp_path: Path) -> None:
    """A recipe says on which frame its mark is; a table of truth that begins earlier changes nothing of that."""
    mark = {"kind": "box", "x": 26, "y": 30, "width": 10, "height": 8}
    path = tmp_path / "recipe.json"
    path.write_text(json.dumps({"experiment": "ball", "footage": {"name": clip.name, "mark": mark, "start": 3}}))
    truth = clip.with_name("truth.csv")
    ran = json.loads(call("run", path, "--video", clip, "--truth", truth, "--json")[1])
    assert (ran["frames"], ran["labelled_frames"]) == (FRAMES - 3, FRAMES - 3)
    assert ran["inside_share"] == 1.0


def test_a_mark_is_drawn_on_the_first_picture(call: Call, clip: Path, tmp_path: Path) -> None:
    """`--mark-out` writes a picture; a simulated scene has no mark."""
    drawn = tmp_path / "mark.png"
    assert (
        call("run", "ball", "--video", clip, "--box", "20,30,10,8", "--frames", 1, "--mark-out", drawn, "--json")[0]
        == 0
    )
    assert drawn.read_bytes().startswith(b"\x89PNG")
    refused(call("run", "ball", "--frames", 1, "--mark-out", drawn), 2, "--mark-out needs --video")


@pytest.mark.parametrize(
    ("text", "status", "message"),
    [
        ("{", 1, "recipe.json is not JSON"),
        ("[]", 2, "recipe must be"),
        ('{"experiment": "ball", "colour": 1}', 2, "colour must be left out"),
        ('{"experiment": "chess"}', 2, "got 'chess'"),
        (
            '{"experiment": "ball", "seed": 9007199254740993}',
            2,
            "seed must be a whole number",
        ),
        ('{"experiment": "ball", "timeline": [{"frame": 0, "values": {"magic": 1}}]}', 2, "magic must be"),
        ('{"experiment": "ball", "footage": {"path": "none.mp4", "mark": {"kind": "box"}}}', 1, "none.mp4"),
    ],
)
def test_wrong_recipes_are_refused(call: Call, tmp_path: Path, text: str, status: int, message: str) -> None:
    """What is wrong with a recipe is said in one line."""
    path = tmp_path / "recipe.json"
    path.write_text(text)
    refused(call("run", path), status, message)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--mark", "1,2,3,4"), "--mark expected KIND:..."),
        (("--mark", "line:1,2"), "ball takes no mark of kind 'line', only box"),
        (("--mark", "box:1,2,3"), "--mark expected 4 finite numbers"),
        (("--mark", "box:1,2,3,4", "--box", "1,2,3,4"), "the target is marked once, got --mark and --box"),
    ],
)
def test_wrong_marks_are_refused(call: Call, clip: Path, options: tuple[str, ...], message: str) -> None:
    """A mark that is none, or of no kind that the experiment takes, is refused."""
    refused(call("run", "ball", "--video", clip, *options), 2, message)


def test_a_missing_recipe_is_named(call: Call, tmp_path: Path) -> None:
    """A file that is not there is said to be so."""
    refused(call("show-recipe", tmp_path / "none.json"), 1, "does not exist")
