"""Source code of runs, comparisons and sweeps: the lines run and give the same numbers."""

import ast
import io
import json
import shlex
import subprocess
from contextlib import chdir, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner

from pftrack.cli.app import app
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.runs.reproduction import make, run_code
from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis
from pftrack.sweep.work import sweep_code
from pftrack_server.core.processes import FORK_SERVER
from tests.server.host import begin, error_of, post, steer


def in_shell(text: str, folder: Path) -> str:
    """Run lines of a shell up to its command of pftrack, which this process carries out, and return its output."""
    lines = f'pftrack() {{ printf "%s\\n" "$@"; }}\n{text}'
    done = subprocess.run(["sh", "-euc", lines], cwd=folder, capture_output=True, text=True, check=True)
    with chdir(folder):
        return as_command(shlex.join(["pftrack", *done.stdout.splitlines()]))


def in_python(text: str, folder: Path) -> str:
    """Run lines of Python as a script, but in this process, and return their output."""
    printed = io.StringIO()
    with chdir(folder), redirect_stdout(printed):
        exec(text, {"__name__": "__main__"})  # noqa: S102 - our own lines
    return printed.getvalue()


def as_command(line: str) -> str:
    """Run a single command of pftrack in this process, and return its output."""
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
def test_the_lines_of_a_run_give_its_numbers(name: str, tmp_path: Path) -> None:
    """The lines use a preset, values, or changes on the way."""
    run = make(RECIPES[name])
    run.seek(29)
    lines = run_code(run.recipe, run.experiment, 30)
    expected = run.estimates_sha256
    assert in_python(lines.python, tmp_path).strip() == expected
    assert json.loads(in_shell(f"{lines.command.rstrip()} --json", tmp_path))["estimates_sha256"] == expected
    assert len(lines.python.splitlines()) <= 30
    assert ("preset='few'" in lines.python) is (name == "preset")


def test_the_lines_of_a_session_and_of_a_comparison(client: httpx.Client, tmp_path: Path) -> None:
    """The server writes the lines; those of a comparison compare, also as commands."""
    session = begin(client, tracker="kalman", frames=30)
    steer(client, session["id"], "seek", frame=9)

    one = post(client, "source-code", runs=[{"reference": f"{session['id']}:b0"}], frames=10)
    columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    shown = one["python"] + "print([list(row.estimate) for row in run.diagnostics])\n"
    assert json.loads(in_python(shown, tmp_path).splitlines()[-1]) == columns["estimate"]
    both = post(client, "source-code", runs=[{"recipe": RECIPES[name].as_dict()} for name in ("values", "preset")])
    assert in_python(both["python"], tmp_path).count("mean_error") == 2
    with chdir(tmp_path):
        assert "Results" in "".join(as_command(line) for line in both["command"].splitlines())


def test_the_lines_of_a_sweep_carry_it_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In Python and as a command the lines give as many rows."""
    monkeypatch.setattr(FORK_SERVER, "close", lambda: None)  # it outlives the pools
    monkeypatch.setattr("pftrack.sweep.work._fresh", lambda: FORK_SERVER)
    plan = Plan("sine", (Axis("sample_count", (10, 20)),), ("condensation", "kalman"), trials=2, frames=12, seed=3)
    lines = sweep_code(plan)
    assert "'runs': 8" in in_python(lines.python, tmp_path)
    (tmp_path / "sweep.parquet").unlink()
    with chdir(tmp_path):
        assert json.loads(as_command(f"{lines.command.rstrip()} --json"))["runs"] == 8


def clip(name: str = "a clip.mp4") -> tuple[Footage, Plan]:
    """Return a recording, and a plan of a sweep on it."""
    mark = {"kind": "box", "x": 1, "y": 2.5, "width": 9, "height": 9}
    footage = Footage(name=name, sha256="0" * 64, start=2, mark=mark)
    return footage, Plan("ball", (), ("condensation",), trials=3, frames=12, footage=footage, kind="video")


def test_lines_on_a_recording_name_it() -> None:
    """A sweep has the recording, the box and its frame as options; a table of truth is left to Python.

    The lines look for the file where they are run.
    """
    footage, plan = clip()
    words = shlex.split(sweep_code(plan).command)
    assert words[:3] == ["pftrack", "sweep", "ball"]
    assert words[-8:] == ["--video", "a clip.mp4", "--box", "1,2.5,9,9", "--start", "2", "--out", "sweep.parquet"]
    known = replace(plan, footage=footage.model_copy(update={"truth": {0: (1.0, 2.0)}}))
    assert sweep_code(known).command.startswith("python - ")
    lines = run_code(Recipe(experiment="ball", footage=footage), find("ball"))
    assert "recording='a clip.mp4',  # where it lies here" in lines.python
    assert "'mark': {" in lines.python
    assert lines.command.splitlines()[-1] == "pftrack run run.json --video 'a clip.mp4'"


TRACKER = {"tracker": "Downloads/evil.py"}
ARGUMENT = {"timeline": [{"frame": 0, "values": {"a=open('it-has-run', 'w'), b": 1}}]}


@pytest.mark.parametrize(
    "wish", [TRACKER, {"timeline": [{"frame": 3, "values": TRACKER}]}, {"filters": {"mine": ["x = 1"]}, **ARGUMENT}]
)
def test_only_declared_names_are_written_and_stored(client: httpx.Client, wish: dict[str, Any]) -> None:
    """Lines of Python, comparisons and lectures have no other names of parameters and trackers."""
    recipe = {"experiment": "ball", **wish}
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
    """Also a name with quotes is a text in the lines, which run nothing of it."""
    name = 'a"), print("it has run"), ("'
    footage, plan = clip(name)
    for code in (sweep_code(plan), run_code(Recipe(experiment="ball", footage=footage), find("ball"))):
        assert name in [node.value for node in ast.walk(ast.parse(code.python)) if isinstance(node, ast.Constant)]
