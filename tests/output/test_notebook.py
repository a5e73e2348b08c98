"""A run as a notebook, and a loop that is watched while it is recorded."""

import hashlib
import json
from pathlib import Path
from queue import Queue
from types import SimpleNamespace
from typing import Any

import pytest

import pftrack
from pftrack.core.model.recipe import Recipe
from pftrack.experiments import EXPERIMENTS, find
from pftrack.output.exports import formats
from pftrack.output.exports.files import run_cells, run_notebook
from pftrack.output.exports.formats import exports_of
from pftrack.runs.run import Run
from tests.making import disc_film
from tests.notebooks import executed_here

SAME = "The same estimates as in the run that was exported.\n"


def source(content: bytes) -> str:
    return "\n".join("".join(cell["source"]) for cell in json.loads(content)["cells"])


def test_a_recording_is_named_and_not_carried(tmp_path: Path) -> None:
    """Its name and content are said in words, and a notebook that lies beside it finds it; markup of a name is none."""
    clip = tmp_path / "clip.mp4"
    clip.write_bytes(disc_film(6))
    ball = find("ball")
    run = pftrack.run("ball", recording=clip, box=(31, 51, 19, 19), tracker="condensation")
    content = run_notebook(run)
    assert "not part of this notebook" in source(content)
    assert hashlib.sha256(clip.read_bytes()).hexdigest() in source(content)
    assert str(tmp_path) not in source(content)
    here = content.replace(b"Path('clip.mp4')", f"Path({str(clip)!r})".encode())
    assert here != content
    assert SAME in executed_here(here)
    hostile = run.recipe.with_footage(name="`<img src=x>`\n# Head.mp4")
    told = [cell.source for cell in run_cells(hostile, ball) if "not part" in cell.source]
    assert [{"<", "\n"} & set(words) for words in told] == [set()]


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_has_one_whose_code_is_python(name: str) -> None:
    """Each cell compiles, and each plot that the experiment declares is listed with columns that a run may have."""
    experiment = EXPERIMENTS[name]
    assert "notebook" in {one.name for one in exports_of(experiment)}
    cells = run_cells(Recipe(experiment=name), experiment, 3, "0" * 64)
    for cell in cells:
        if cell.kind == "code":
            compile(cell.source, name, "exec")
    listed: dict[str, Any] = {}
    exec(cells[-1].source.split("\n\n")[1], listed)  # noqa: S102 - of the project's own making
    declared = {f"series_{series.name}" for series in experiment.all_series()}
    assert len(listed["plots"]) == len(experiment.display.plots)
    assert {column for _, columns in listed["plots"] for column in columns} <= declared | {"error", "sigma"}


# Watching a loop that is being recorded: the scene follows it, and the loop waits for nothing.


def test_the_scene_follows_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each frame that was written is shown before the loop has ended, at the newest one, and the last one after it."""
    shown: Queue[Run] = Queue()

    def show(run: Run, **_: object) -> SimpleNamespace:
        shown.put(run)
        return SimpleNamespace(follow=shown.put)

    monkeypatch.setattr(formats, "show", show)
    with pftrack.record(tmp_path / "mine.pft", watch=True) as rec:
        for t in range(3):
            rec(t, mean=[float(t), 1.0])
            rec._hand_on()
            while shown.get(timeout=30).frames <= t:
                pass
        rec(3, mean=[3.0, 1.0])
    last = [shown.get() for _ in range(shown.qsize())][-1]
    assert (last.frames, last.current.diagnostics.estimate) == (4, (3.0, 1.0))
