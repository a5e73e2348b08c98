"""The page on exercises: its example works, and the page names every key, property, option and exercise."""

import re
from pathlib import Path

import pytest

from pftrack.teaching.exercises import read_exercises
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Check, ExerciseHead

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "exercises.md").read_text(encoding="utf-8")


def test_the_example_is_an_exercise(tmp_path: Path) -> None:
    """The example has no mistakes."""
    found = re.search(r"````markdown\n(.*?)````", PAGE, re.DOTALL)
    assert found is not None
    (tmp_path / "mine.md").write_text(found[1], encoding="utf-8")
    exercises = read_exercises(tmp_path)
    assert exercises.problems == ()
    assert exercises.exercises["residual-resampling"].points == 6


OPTIONS = [option for each in PROPERTIES.values() for option in each.options]


@pytest.mark.parametrize("name", [*ExerciseHead.model_fields, *Check.model_fields, *PROPERTIES, *sorted(set(OPTIONS))])
def test_the_page_names_every_key_property_and_option(name: str) -> None:
    """The page has all that a file may contain."""
    assert f"`{name}`" in PAGE


def test_the_page_names_every_exercise() -> None:
    """The page names each exercise with its functions."""
    for each in read_exercises().exercises.values():
        (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| `{each.id}` ")]
        assert all(f"`{name}`" in row for name in each.functions)
