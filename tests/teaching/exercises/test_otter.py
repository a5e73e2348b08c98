"""The test file for otter-grader that the documentation shows, run by otter-grader where it is installed."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "exercises.md"
SOLUTION = Path(__file__).parent / "solutions" / "importance_weights.py"


def test_otter_gives_the_points_of_the_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All for a right solution; for one that does not normalise those of what holds, with words for the rest."""
    otter = pytest.importorskip("otter.test_files.exception_test")
    (text,) = re.findall(r"```py\n(from functools.*?)```", PAGE.read_text(), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    right = SOLUTION.read_text()
    for solution, points in ((right, 9), (right.replace("log_weights - log_sum, log_sum", "log_weights, log_sum"), 3)):
        Path("my_filter.py").write_text(solution)
        graded = otter.ExceptionTestFile.from_string(text, "q1.py")
        graded.run({})
        assert (graded.name, graded.score, graded.possible) == ("importance-weights", points, 9)
    assert "distribution result" in graded.summary()
