"""The page on lessons: its example of a lecturer's lesson works, and the page names every key."""

import re
from pathlib import Path

import pytest

from pftrack.runs.reproduction import make
from pftrack.teaching.lessons.lesson import AnswerHead, Head
from pftrack.teaching.lessons.library import read_lessons

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "lessons.md").read_text(encoding="utf-8")
PART = PAGE[PAGE.index("## A lecturer's lesson") :]


def test_the_example_is_a_lesson_and_its_mistake_is_reported(tmp_path: Path) -> None:
    """The example has no mistakes and its answer; with its own number of particles nothing is lost.

    The message for a mistake on the page is that of the program, with its line.
    """
    found = re.search(r"```markdown\n(.*?)```", PART, re.DOTALL)
    assert found is not None
    (tmp_path / "mine.md").write_text(found[1], encoding="utf-8")
    library = read_lessons(tmp_path)
    assert library.problems == ()
    lesson = library.lessons["too-few-particles"]
    assert all(check.run().passed for check in lesson.checks)
    run = make(lesson.body.recipe)  # type: ignore[union-attr] # it is a run
    run.finish()
    assert run.summary().verdict.lost_frames == 0
    (tmp_path / "mine.md").write_text(found[1].replace("[sample_count,", "[sampel_count,"), encoding="utf-8")
    (problem,) = read_lessons(tmp_path).problems
    assert problem.sentence in PART


@pytest.mark.parametrize("name", [*Head.model_fields, *AnswerHead.model_fields])
def test_the_page_names_every_key(name: str) -> None:
    """The page has all that a file may contain."""
    assert re.search(rf"`[^`]*\b{name}\b[^`]*`", PART)
