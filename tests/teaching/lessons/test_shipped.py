"""The three lessons that are written as a lecturer would: each still shows its point."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.recipe import Change
from pftrack.runs.loss_probability import columns_of
from pftrack.teaching.lessons.lesson import Lesson, answer_of, question_recipe
from pftrack.teaching.lessons.library import read_lessons

LIBRARY = read_lessons()
SHIPPED = {name: lesson for name, lesson in LIBRARY.lessons.items() if not lesson.number}


def run(lesson: Lesson, **values: bool | float | str) -> Mapping[str, np.ndarray[Any, Any]]:
    """The numbers of a scenario's own run, with other values from the start."""
    recipe = lesson.body.recipe
    timeline = (*recipe.timeline, Change(0, values))
    return columns_of(pftrack.run(recipe.model_copy(update={"timeline": timeline})))


def test_all_are_read() -> None:
    """There are three, and nothing is wrong with any."""
    assert LIBRARY.problems == ()
    assert {"tempted-by-look-alikes", "cost-of-a-threshold", "too-sure-to-return"} <= set(SHIPPED)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_answer_is_still_what_its_author_saw(name: str) -> None:
    """Its check passes: the answer can be computed, is as expected, and is judged right."""
    (check,) = SHIPPED[name].checks
    outcome = check.run()
    assert outcome.passed, outcome
    assert all(judged.given != answer_of(SHIPPED[name]).exact for judged in SHIPPED[name].question.mistakes)


def test_an_auxiliary_filter_is_tempted() -> None:
    """Condensation loses the ball in 3 frames, the auxiliary filter in half of all; without discs in none."""
    lesson = SHIPPED["tempted-by-look-alikes"]
    auxiliary, prediction = run(lesson), run(lesson, tracker="condensation")
    assert prediction["lost"].sum() == 3
    assert auxiliary["lost"].sum() > 20
    assert auxiliary["lost"][40:].mean() > 0.9
    assert run(lesson, distracter_radius_px=0)["lost"].sum() == 0


def test_a_threshold_that_is_too_high_loses_the_ball() -> None:
    """At 5 px nothing is lost, at 20 px some frames, without a switch many; low and beside large discs as well."""
    lesson = SHIPPED["cost-of-a-threshold"]
    lost = {gamma: int(run(lesson, gamma_px=gamma)["lost"].sum()) for gamma in (5, 20, 1000)}
    assert lost[5] == 0
    assert 8 <= lost[20] <= 18
    assert lost[1000] > lost[20] + 5
    assert run(lesson, gamma_px=0, distracter_radius_px=14)["lost"].sum() > 40
    assert dict(question_recipe(lesson).timeline[-1].values) == {"gamma_px": 20}


def test_a_filter_that_is_sure_and_wrong_stays_wrong() -> None:
    """Its interval never holds the true length; with a large variance at the start the pose is right in the end."""
    lesson = SHIPPED["too-sure-to-return"]
    sure, unsure = run(lesson), run(lesson, start_length_variance_px2=100)
    assert not np.any((sure["series_length_3"][:, 0] <= 50) & (sure["series_length_3"][:, 1] >= 50))
    assert np.all(sure["lost"][30:] == 1)
    assert np.all(unsure["lost"][-10:] == 0)
    assert np.all(run(lesson, start_length_3_px=0)["lost"][-10:] == 0)
