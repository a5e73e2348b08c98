"""Lessons as notebooks: they run, with the library's numbers."""

import json
from dataclasses import replace
from typing import Any

import pytest
from markdown_it import MarkdownIt

from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import Scenario, answer_of, question_recipe
from pftrack.teaching.lessons.library import read_lessons
from pftrack.teaching.lessons.notebook import lesson_cell, lesson_notebook
from tests.notebooks import executed
from tests.teaching.lessons.demonstrations import DEMONSTRATIONS


def cells(content: bytes, kind: str) -> list[str]:
    return ["".join(cell["source"]) for cell in json.loads(content)["cells"] if cell["cell_type"] == kind]


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_a_demonstration_is_in_its_cells(name: str) -> None:
    """The code gives the lesson, its parameters and its seed; the texts have all of it but the answer."""
    lesson = LESSONS[name]
    body = lesson.body
    content = lesson_notebook(lesson, body.parameters, 17)
    code, _, _, values, *_ = cells(content, "code")
    known: dict[str, Any] = {}
    exec(f"{code}\n{values}", known)  # noqa: S102 - it is the code that is tested
    assert known["lesson"] is lesson
    assert (known["parameters"], known["seed"]) == (body.parameters, 17)
    first, asked, seen, _ = cells(content, "markdown")
    assert first.startswith(f"# {lesson.number}. {lesson.title}\n")
    assert lesson.idea in first
    assert all(words in asked for words in (lesson.question.text, *(lesson.question.choices or {}).values()))
    assert lesson.question.words not in asked
    assert all(sentence in seen for sentence in (lesson.notice, *lesson.tries))


def test_a_prediction_is_judged(capsys: pytest.CaptureFixture[str]) -> None:
    """A prediction in the place of None is judged with the words for it."""
    lesson = LESSONS["bayes"]
    body = lesson.body
    known: dict[str, Any] = {}
    for source in cells(lesson_notebook(lesson, body.parameters, body.seed), "code")[:3]:
        exec(source.replace("prediction = None", "prediction = 'middle'"), known)  # noqa: S102 - see above
    told = capsys.readouterr().out
    assert told.startswith("The right answer is")
    assert lesson.question.words in told


def test_a_lecturers_scenario_runs_in_a_kernel() -> None:
    """The notebook contains the file and the recipe, and prints the answer that the library computes."""
    lesson = read_lessons().lessons["cost-of-a-threshold"]
    printed = executed(lesson_notebook(lesson))
    assert printed[-2] == f"{answer_of(lesson).exact}\n"
    assert printed[-1].splitlines() == [line for it in lesson.checks for line in (it.title, f"    {it.run()}")]
    assert any("log_evidence" in text for text in printed)


@pytest.mark.parametrize("name", [name for name, it in read_lessons().lessons.items() if isinstance(it.body, Scenario)])
def test_a_scenario_is_in_its_cells(name: str) -> None:
    """The code gives the lesson and the run of its question, and all cells are Python."""
    lesson = read_lessons().lessons[name]
    content = lesson_notebook(lesson)
    known: dict[str, Any] = {}
    sources = cells(content, "code")
    for source in sources:
        compile(source, name, "exec")
    for source in (sources[0], *(source for source in sources if source.startswith("from pftrack.core.model.recipe"))):
        exec(source, known)  # noqa: S102 - see above
    assert known["lesson"].question.text == lesson.question.text
    assert make(known["recipe"]).parameters_at(0) == make(question_recipe(lesson)).parameters_at(0)


HOSTILE = "<script>alert(1)</script> <!-- </b> <img src=x onerror=alert(1)> $a<b$ `<i>`"


def test_a_lecturers_texts_are_neither_markup_nor_code() -> None:
    """HTML in any text is shown as it was written, as on the page, and a unit stays in its comment."""
    lesson = read_lessons().lessons["cost-of-a-threshold"]
    hostile = {"text": HOSTILE, "words": HOSTILE, "choices": {"<b>": HOSTILE}, "unit": "s\nraise KeyError"}
    asked = lesson.question.model_copy(update=hostile)
    written = replace(lesson, title=HOSTILE, idea=HOSTILE, tries=(HOSTILE,), notice=HOSTILE, question=asked)
    words = "\n".join(cells(lesson_notebook(written), "markdown"))
    assert words.count("script>") == 2 * 7
    read = MarkdownIt("commonmark").parse(words)
    kinds = {each.type for block in read for each in (block, *(block.children or ()))}
    assert not kinds & {"html_block", "html_inline"}
    asked = asked.model_copy(update={"choices": None})
    predicted = cells(lesson_notebook(replace(lesson, question=asked)), "code")[1]
    exec(predicted, {})  # noqa: S102 - it is the code that is tested


@pytest.mark.parametrize("text", ["quoted ''' in", "back\\", "a \u2028 sign", "ends '"])
def test_any_text_of_a_file_comes_back_from_its_cell(text: str) -> None:
    """Quotes, backslashes and rare characters stay as they are."""
    lesson = replace(read_lessons().lessons["cost-of-a-threshold"], source=text)
    source = lesson_cell(lesson, "").source
    read: list[str] = []
    exec(source[source.index("lesson = ") :], {"read_lesson": read.append})  # noqa: S102 - see above
    assert read == [text]
