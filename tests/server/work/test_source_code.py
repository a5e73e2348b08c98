"""What computes a run, a comparison and a sweep again: the lines are run, and come to the same numbers."""

import ast
import io
import json
import shlex
import subprocess
import sys
from contextlib import chdir, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner

from pftrack.analysis.failures import gallery
from pftrack.cli.app import app
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.runs.reproduction import make, run_code
from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis
from pftrack.sweep.work import sweep_code
from tests.server.host import begin, error_of, steer


def in_shell(text: str, folder: Path) -> str:
    """Run lines of a shell where nothing but this Python's programs is, and return what they print."""
    (folder / "bin").mkdir(exist_ok=True)
    program = folder / "bin" / "pftrack"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m pftrack "$@"\n')
    program.chmod(0o755)
    command = f"PATH={folder / 'bin'}:$PATH\n{text}"
    return subprocess.run(["sh", "-euc", command], cwd=folder, capture_output=True, text=True, check=True).stdout


def in_python(text: str, folder: Path) -> str:
    """Run lines of Python as a file would be, but in this process, and return what they print."""
    printed = io.StringIO()
    with chdir(folder), redirect_stdout(printed):
        exec(text, {"__name__": "__main__"})  # noqa: S102 - our own lines
    return printed.getvalue()


def as_command(line: str) -> str:
    """Run a line of a shell that is a single command of pftrack in this process, and return what it prints."""
    program, *arguments = shlex.split(line)
    assert program == "pftrack"
    return CliRunner().invoke(app, arguments, catch_exceptions=False).stdout


def sine(frame: int, values: dict[str, Any], **more: Any) -> Recipe:
    return Recipe(experiment="sine", timeline=(Change(frame, values),), **more)


RECIPES = {
    "preset": sine(0, {"sample_count": 10}, tracker="condensation"),
    "values": sine(0, {"initial_sd": 0.3}, tracker="kalman", seed=4, frames=40),
    "changes": sine(9, {"sample_count": 60}, seed=4, frames=40),
}


@pytest.mark.parametrize("name", RECIPES)
def test_the_lines_of_a_run_come_to_its_numbers(name: str, tmp_path: Path) -> None:
    """By a preset, by values, and by changes on the way."""
    run = make(RECIPES[name])
    run.seek(29)
    told = run_code(run.recipe, run.experiment, 30)
    expected = run.estimates_sha256
    assert in_python(told.python, tmp_path).strip() == expected
    command = f"{told.command.rstrip()} --json"
    printed = as_command(command) if len(command.splitlines()) == 1 else in_shell(command, tmp_path)
    assert json.loads(printed)["estimates_sha256"] == expected
    assert len(told.python.splitlines()) <= 30
    assert ("preset='few'" in told.python) is (name == "preset")


def test_the_lines_of_a_session_and_of_a_comparison(client: httpx.Client, tmp_path: Path) -> None:
    """The server writes them; those of a comparison compare, also as commands."""
    session = begin(client, tracker="kalman", frames=30)
    steer(client, session["id"], "seek", frame=9)

    def told(*runs: dict[str, Any], **more: Any) -> dict[str, str]:
        answer = client.post("/api/v1/source-code", json={"runs": list(runs), **more})
        assert answer.status_code == 200, answer.text
        return answer.json()

    one = told({"reference": f"{session['id']}:b0"}, frames=10)
    columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    shown = one["python"] + "print([list(row.estimate) for row in run.diagnostics])\n"
    assert json.loads(in_python(shown, tmp_path).splitlines()[-1]) == columns["estimate"]
    both = told(*({"recipe": RECIPES[name].as_dict()} for name in ("values", "preset")))
    assert in_python(both["python"], tmp_path).count("mean_error") == 2
    with chdir(tmp_path):
        assert "What came of it" in "".join(as_command(line) for line in both["command"].splitlines())


@pytest.mark.parametrize("cured", [False, True])
def test_the_lines_of_every_failure_make_both_of_its_runs(cured: bool) -> None:
    """Failing and cured, they are what the page shows."""
    for entry in gallery({name: find(name) for name in ("ball", "sine", "histogram")}):
        recipe = entry.recipe(cured=cured)
        made: dict[str, Any] = {}
        exec(run_code(recipe, entry.experiment, 3).python, made)  # noqa: S102 - our own lines
        shown = make(recipe.model_copy(update={"frames": 3}))
        shown.finish()
        assert made["run"].estimates_sha256 == shown.estimates_sha256, entry.failure.id


def test_the_lines_of_a_sweep_carry_it_out(tmp_path: Path) -> None:
    """In Python and as a command, to as many rows."""
    plan = Plan("sine", (Axis("sample_count", (10, 20)),), ("condensation", "kalman"), trials=2, frames=12, seed=3)
    told = sweep_code(plan)
    (tmp_path / "sweep.py").write_text(told.python)
    done = subprocess.run([sys.executable, "sweep.py"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "'runs': 8" in done
    (tmp_path / "sweep.parquet").unlink()
    with chdir(tmp_path):
        assert json.loads(as_command(f"{told.command.rstrip()} --json"))["runs"] == 8


BOX = {"kind": "box", "x": 1, "y": 2.5, "width": 9, "height": 9}


def clip(name: str = "a clip.mp4") -> tuple[Footage, Plan]:
    """Return a recording, and a plan of a sweep on it."""
    footage = Footage(name=name, sha256="0" * 64, start=2, mark=BOX)
    return footage, Plan("ball", (), ("condensation",), trials=3, frames=12, footage=footage, kind="video")


def test_lines_on_a_recording_name_it() -> None:
    """A sweep has the recording, the box and the frame where it is; what no option can say is left to Python.

    The file itself is looked for where the lines are run.
    """
    footage, plan = clip()
    words = shlex.split(sweep_code(plan).command)
    assert words[:3] == ["pftrack", "sweep", "ball"]
    assert words[-8:] == ["--video", "a clip.mp4", "--box", "1,2.5,9,9", "--start", "2", "--out", "sweep.parquet"]
    known = replace(plan, footage=footage.model_copy(update={"truth": {0: (1.0, 2.0)}}))
    assert sweep_code(known).command.startswith("python - ")
    told = run_code(Recipe(experiment="ball", footage=footage), find("ball"))
    assert "recording='a clip.mp4',  # where it lies here" in told.python
    assert "'mark': {" in told.python
    assert told.command.splitlines()[-1] == "pftrack run run.json --video 'a clip.mp4'"


ARGUMENT = {"timeline": [{"frame": 0, "values": {"a=open('it-has-run', 'w'), b": 1}}]}
STRANGE_NAMES: dict[str, dict[str, Any]] = {
    "argument": ARGUMENT,
    "parameter of nobody": {"timeline": [{"frame": 3, "values": {"colour_of_nobody": 1}}]},
    "beside a filter": {"filters": {"mine": ["x = 1"]}, **ARGUMENT},
    "file": {"tracker": "Downloads/evil.py"},
    "later file": {"timeline": [{"frame": 3, "values": {"tracker": "Downloads/evil.py"}}]},
}


@pytest.mark.parametrize("name", STRANGE_NAMES)
def test_only_names_that_are_declared_are_written_and_kept(client: httpx.Client, name: str) -> None:
    """Of parameters and trackers; lines of Python, comparisons and lectures have no others."""
    recipe = {"experiment": "ball", **STRANGE_NAMES[name]}
    with pytest.raises(ParameterError):
        run_code(Recipe.read(recipe), find("ball"))
    runs = {"runs": [{"recipe": recipe}, {"recipe": {"experiment": "ball"}}]}
    error_of(client.post("/api/v1/source-code", json=runs), 422)
    error_of(client.post("/api/v1/comparisons/saved", json={"title": "x", **runs}), 422)
    for item in ({"comparison": runs}, {"session": runs["runs"][0]}):
        lecture = {"title": "x", "items": [item]}
        assert error_of(client.post("/api/v1/lectures", json=lecture), 422)["message"].startswith("Line 4: ")
        text = f"---\n{json.dumps(lecture)}\n---\n"
        assert error_of(client.post("/api/v1/lectures/import", content=text), 422)["message"].startswith("Line 2: ")


def test_a_name_of_a_recording_stays_a_text() -> None:
    """With quotes in it, too: the lines run nothing of it."""
    name = 'a"), print("it has run"), ("'
    footage, plan = clip(name)
    for code in (sweep_code(plan), run_code(Recipe(experiment="ball", footage=footage), find("ball"))):
        tree = ast.parse(code.python)
        assert name in [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
