"""Lesson 12: its question about a run, which is computed."""

from dataclasses import replace

from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import answer_of, judge, question_recipe

LESSON = LESSONS["colour"]


def test_the_question_is_about_a_sharper_likelihood_in_the_scenario() -> None:
    """The run that is asked about is the scenario's own but for lambda."""
    shown, about = (make(recipe).parameters_at(0) for recipe in (LESSON.body.recipe, question_recipe(LESSON)))
    assert (shown.sharpness, about.sharpness) == (20, 200)
    assert shown.model_copy(update={"sharpness": 200}) == about


def test_the_answer_is_where_the_column_hides_the_target() -> None:
    """It is lost for good while it is hidden; that is judged right, and usual mistakes are explained."""
    answer = answer_of(LESSON)
    assert 87 <= float(answer.exact) <= 96
    assert judge(LESSON.question, answer, answer.exact).right
    for said, words in ((120, "sharper"), (47, "look-alike"), (76, "begins to cover"), (107, "comes out"), (5, "few")):
        verdict = judge(LESSON.question, answer, said)
        assert not verdict.right
        assert any(words in sentence for sentence in verdict.words)


def test_an_answer_counts_the_frames_that_there_are() -> None:
    """A run that holds its target is never lost, and one that never held it was lost from the start."""
    run = make(question_recipe(LESSON))
    run.seek(2)
    rows = run.diagnostics
    run.diagnostics = [replace(row, lost=lost) for row, lost in zip(rows, (False, True, False), strict=True)]
    assert LESSON.answer(run).exact == 3
    run.diagnostics = [replace(row, lost=True) for row in rows]
    assert LESSON.answer(run).exact == 0
