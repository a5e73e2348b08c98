"""Filters in files on the command line: create, run, sweep, replay."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import pftrack
from tests.cli.commands import Ask, Call, refused


@pytest.fixture
def file(call: Call, tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    assert call("new", "filter", path, "--experiment", "sine")[0] == 0
    return path


def test_a_file_is_run_swept_and_replayed(ask: Ask, file: Path, tmp_path: Path) -> None:
    """A file can replace the name of a tracker; its saved run gives the same numbers."""
    saved, table = tmp_path / "run.pft", tmp_path / "sweep.parquet"
    ran = ask("run", "sine", "--tracker", file, "--frames", 30, "--out", saved)
    assert (ran["tracker"], ask("replay", saved)["same_as_saved"]) == ("mine", True)
    assert pftrack.run("sine", tracker=file, frames=30).estimates_sha256 == ran["estimates_sha256"]
    options = "--trackers", f"{file},kalman", "--axis", "step_sd=0.001,0.01", "--trials", 2, "--frames", 20, "--jobs", 1
    ask("sweep", "sine", *options, "--out", table)
    rows = pq.read_table(table).to_pylist()
    assert [row["tracker"] for row in rows].count("mine") == 4
    assert not any(row["problem"] for row in rows)


def test_the_prints_of_a_file_go_to_standard_error(call: Call, tmp_path: Path) -> None:
    """So does a sentence on frames in which all weights are zero."""
    body = "print('loaded')\nimport numpy as np\ndef log_likelihood(states, frame, parameters):\n    print('asked')\n"
    path = tmp_path / "talks.py"
    path.write_text(f"{body}    return np.full(len(states), -np.inf)\n")
    status, out, err = call("run", "sine", "--tracker", path, "--frames", 4, "--json")
    assert (status, json.loads(out)["tracker"]) == (0, "talks")
    assert {"loaded", "asked"} <= set(err.split())
    assert "all weights were zero in 3 of 4 frames, first in frame 1; replaced by equal weights" in err


def test_wrong_files_are_refused(call: Call, file: Path, tmp_path: Path) -> None:
    """So are an existing file, a wrong name, a file that raises an error, and a file of somebody else."""
    refused(call("new", "filter", file, "--experiment", "ball"), 1, "already exists")
    refused(call("new", "filter", tmp_path / "my-filter.py", "--experiment", "ball"), 2, "a name such as my_filter.py")
    refused(call("new", "filter", tmp_path / "other.py", "--experiment", "fish"), 2, "takes no filters")
    refused(call("run", "sine", "--tracker", tmp_path / "nowhere.py"), 1, "cannot be read")
    text = file.read_text()
    file.write_text(text.replace("newest, before = np", "newest, before = np.nothing"))
    line = text[: text.index("newest, before = np")].count("\n") + 1
    refused(call("run", "sine", "--tracker", file), 1, f"mine.py, line {line}", "AttributeError")
    recipe = tmp_path / "theirs.json"
    recipe.write_text(json.dumps({"experiment": "sine", "tracker": "mine", "filters": {"mine": [text + "\n# theirs"]}}))
    refused(call("run", recipe), 1, "which is not trusted here")
    assert call("run", recipe, "--trust", "--frames", 5)[0] == 0
