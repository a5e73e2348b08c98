"""The page on lessons: its example of a lecturer's lesson works, and it tells all that there is."""

import re
from pathlib import Path

import pytest

from pftrack.runs.reproduction import make
from pftrack.teaching.lessons.lesson import AnswerHead, Head
from pftrack.teaching.lessons.library import read_lessons

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "lessons.md").read_text(encoding="utf-8")
PART = PAGE[PAGE.index("## A lecturer's lesson") :]


def example() -> str:
    found = re.search(r"```markdown\n(.*?)```", PART, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_example_is_a_lesson_and_shows_what_it_says(tmp_path: Path) -> None:
    """Nothing is wrong with it, its answer is what it expects, and with its own number of particles nothing is lost."""
    (tmp_path / "mine.md").write_text(example(), encoding="utf-8")
    library = read_lessons(tmp_path)
    assert library.problems == ()
    lesson = library.lessons["too-few-particles"]
    assert all(check.run().passed for check in lesson.checks)
    run = make(lesson.body.recipe)  # type: ignore[union-attr] # it is a run
    run.finish()
    assert run.summary().verdict.lost_frames == 0


def test_the_example_of_a_mistake_is_what_is_said(tmp_path: Path) -> None:
    """The sentence on the page is that of the program, with its line."""
    (tmp_path / "mine.md").write_text(example().replace("[sample_count,", "[sampel_count,"), encoding="utf-8")
    (problem,) = read_lessons(tmp_path).problems
    assert problem.sentence in PART


@pytest.mark.parametrize("name", [*Head.model_fields, *AnswerHead.model_fields])
def test_the_page_tells_every_key(name: str) -> None:
    """Whatever may be written in a file stands on the page."""
    assert re.search(rf"`[^`]*\b{name}\b[^`]*`", PART)
