"""Exercises on the command line: list, start, check and grade."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pftrack.teaching.exercises import grading
from pftrack.teaching.exercises.grading import check, results
from pftrack.teaching.exercises.submission import Exercise
from tests.cli.commands import Ask, Call, refused

SOLUTION = Path(__file__).parents[1] / "teaching" / "exercises" / "solutions" / "importance_weights.py"


def test_an_exercise_is_begun_and_checked(call: Call, ask: Ask, tmp_path: Path) -> None:
    """The skeleton fails, a solution passes, and the report has the form for graders."""
    assert [each["id"] for each in ask("exercise", "list")][:2] == ["importance-weights", "systematic-resampling"]
    file = tmp_path / "mine.py"
    status, out, said = call("exercise", "start", "importance-weights", file)
    assert status == 0
    assert "Write `normalise(log_weights)`" in out
    assert "Checked on sine with process_noise_sd = 0.03, sample_count = 500." in out
    assert f"pftrack exercise check {file}" in said
    status, out, said = call("exercise", "check", file)
    assert status == 1
    assert "FAILS  distribution (seed 0): mine.py, line 10: NotImplementedError" in out
    assert "5 of 5 properties do not hold" in said
    file.write_text(SOLUTION.read_text())
    report = ask("exercise", "check", file, "--seed", 7)
    assert report["score"] == report["max_score"] == 9
    assert {test["status"] for test in report["tests"]} == {"passed"}
    assert "9 of 9 points" in call("exercise", "check", file)[1]
    assert "1. Subtract" in call("exercise", "start", "importance-weights", "--hints")[1]


def test_a_folder_is_graded(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table has a row for each submission in the order of names, whichever is graded first within the limits."""
    folder = tmp_path / "submissions"
    folder.mkdir()
    (folder / "ada.py").write_text(SOLUTION.read_text())
    (folder / "bob.py").write_text("x = 1\n")
    table, limits = tmp_path / "points.csv", []

    def grade(files: dict[str, Path], exercises: dict[str, Exercise], **given: Any) -> Iterator[tuple[str, Any]]:
        limits.append((given["seed"], given["jobs"], given["budget"].cpu_seconds, given["budget"].memory_bytes >> 20))
        yield "bob", {"score": 0.0, "max_score": 0.0, "output": "no line EXERCISE", "extra_data": {}, "tests": []}
        yield "ada", results(check(exercises["importance-weights"], files["ada"], seed=given["seed"]))

    monkeypatch.setattr(grading, "grade", grade)
    options = "--seconds", 5, "--memory", 64, "--jobs", 3, "--seed", 4
    graded = ask("exercise", "grade", folder, "--out", table, *options)
    assert limits == [(4, 3, 5.0, 64)]
    assert (graded["ada"]["score"], graded["bob"]["score"]) == (9, 0)
    head, ada, bob = table.read_text().splitlines()
    assert head == "name,exercise,distribution,evidence,linear,unchanged,replays,score,of,problem"
    assert ada == "ada,importance-weights,4,2,1,1,1,9,9,"
    assert bob.startswith("bob,,")


def test_wrong_files_and_exercises_are_refused(call: Call, tmp_path: Path) -> None:
    """So are files that exist already, and unknown exercises."""
    file = tmp_path / "mine.py"
    file.write_text("x = 1\n")
    assert call("exercise", "start", "switching", file)[2].startswith(f"pftrack: {file} already exists")
    refused(call("exercise", "check", file), 2, "no line EXERCISE")
    unknown = call("exercise", "check", file, "--exercise", "nothing")
    refused(unknown, 2, "an exercise must be one of importance-weights")
    refused(call("exercise", "check", tmp_path / "other.py"), 1, "cannot be read")
    refused(call("exercise", "grade", tmp_path, "--out", tmp_path / "a.txt"), 2, "expected a file .csv")
    refused(call("exercise", "list", "--exercises", tmp_path / "nowhere"), 2, "expected a folder")
    (tmp_path / "broken.md").write_text("# Nothing\n")
    status, _, said = call("exercise", "list", "--exercises", tmp_path)
    assert (status, "broken.md, line 1: the file begins with a head" in said) == (0, True)
