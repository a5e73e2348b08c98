"""Grading: each submission runs in a confined process."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pftrack.process import MEBIBYTE
from pftrack.teaching.exercises import read_exercises
from pftrack.teaching.exercises.grading import BUDGET, grade, submissions_in

RIGHT = (Path(__file__).parent / "solutions" / "importance_weights.py").read_text()
NORMALISE = 'import os, socket\nimport numpy as np\nEXERCISE = "importance-weights"\n\ndef normalise(log_weights):\n'
FORGE = """    for each in range(3, 64):
        try:
            os.write(each, b"nonsense" * 9)
        except OSError:
            pass
    os._exit(0)
"""
SPIN = """    while True:
        try:
            while True:
                pass
        except BaseException:
            pass
"""
HANDED_IN = {
    "ada": RIGHT,
    "bob": RIGHT.replace("log_weights - log_sum, log_sum", "log_weights - top, log_sum"),
    "crash": f"{NORMALISE}    os._exit(0)\n",
    "forge": f"{NORMALISE}{FORGE}",
    "memory": f"{NORMALISE}    return np.ones((2**33,)), 0.0\n",
    "network": f"{NORMALISE}    socket.create_connection(('192.0.2.1', 80), timeout=5)\n",
    "nobody": "x = 1\n",
    "other": 'EXERCISE = "nothing-like-it"\n',
    "spin": f"{NORMALISE}{SPIN}",
    "typo": "def normalise(:\nEXERCISE = 'importance-weights'\nEXERCISE = 'importance-weights'\n",
}

WHY = {
    "crash": "Its process was ended",
    "forge": "Its process was ended",
    "spin": "2 s of processor time",
    "nobody": "no line EXERCISE",
    "other": "nothing-like-it",
}


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("submissions")
    for name, text in HANDED_IN.items():
        (folder / name).mkdir()
        (folder / name / "mine.py").write_text(text)
    budget = replace(BUDGET, cpu_seconds=2.0, silence_s=30.0, memory_bytes=512 * MEBIBYTE)
    return dict(grade(submissions_in(folder), read_exercises().exercises, budget=budget, jobs=2))


def test_points_are_those_of_the_checks(graded: dict[str, dict[str, Any]]) -> None:
    """A right submission has all points, a wrong one some; one that cannot be checked has none, with the reason.

    One that takes too much memory fails in its own line.
    """
    assert graded.keys() == HANDED_IN.keys()
    assert graded["ada"]["score"] == graded["ada"]["max_score"] == 9
    assert 0 < graded["bob"]["score"] < 9
    assert graded["typo"]["score"] == 0
    assert "mine.py, line 1" in graded["typo"]["tests"][0]["output"]
    assert "MemoryError" in graded["memory"]["tests"][0]["output"]
    for name, words in WHY.items():
        assert graded[name]["score"] == 0
        assert words in graded[name]["output"]


def test_there_is_no_network(graded: dict[str, dict[str, Any]]) -> None:
    """If the system cannot enforce that, the results state it."""
    if graded["ada"]["extra_data"]["network"]:
        pytest.skip("this system lets no process give up the network")
    assert "Network is unreachable" in graded["network"]["tests"][0]["output"]


def test_submissions_are_files_and_folders(tmp_path: Path) -> None:
    """They are named after their authors; anything but a file has no points, and delays no other submission."""
    for path in ("ada.py", "bob/mine.py", "eve/one.py", "eve/two.py", "notes.txt"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).touch()
    os.mkfifo(tmp_path / "pipe.py")
    handed_in = submissions_in(tmp_path)
    assert handed_in.keys() == {"ada", "bob", "eve/one", "eve/two", "pipe"}
    found = dict(grade(handed_in, {}))["pipe"]
    assert (found["score"], found["output"]) == (0, "It is not a regular file.")
