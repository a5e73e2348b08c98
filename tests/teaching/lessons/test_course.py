"""The files of the course: their numbers are those of the modules beside them, and a lecturer can take one over."""

from pathlib import Path

import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course import bayes, colour, estimate, importance, joint, kalman, monte_carlo
from pftrack.teaching.lessons.lesson import Demonstration, Outcome
from pftrack.teaching.lessons.library import course_lesson, read_lessons

COURSE = Path(bayes.__file__).parent


@pytest.mark.parametrize("name", LESSONS)
def test_a_lecturer_can_copy_a_lesson_and_mend_a_sentence(name: str, tmp_path: Path) -> None:
    """Under another id the file is a lecturer's lesson: it shows, asks and checks the same, and its runs fit."""
    text = (COURSE / f"{name}.md").read_text(encoding="utf-8")
    (tmp_path / "mine.md").write_text(text.replace(f"id: {name}", "id: mine", 1).replace("notice:", "notice: Look. #"))
    library = read_lessons(tmp_path)
    assert library.problems == ()
    mine, ours = library.lessons["mine"], LESSONS[name]
    assert (mine.notice, mine.number, mine.origin) == ("Look.", 0, "mine.md")
    assert (mine.idea, mine.question, mine.answer, mine.checks) == (ours.idea, ours.question, ours.answer, ours.checks)
    assert [use.words for use in mine.uses] == [use.words for use in ours.uses]
    if isinstance(ours.body, Demonstration):
        assert mine.body == ours.body


@pytest.mark.parametrize("name", LESSONS)
def test_every_check_that_is_computed_is_claimed(name: str) -> None:
    """A module computes nothing that its file does not name."""
    module = __import__(f"pftrack.teaching.lessons.course.{name.replace('-', '_')}", fromlist=["COMPUTED"])
    assert [check.name for check in LESSONS[name].checks] == list(module.COMPUTED.checks)


def test_texts_have_the_numbers_of_the_modules() -> None:
    """What a question says of a constant is what the module computes with."""
    asked = {name: lesson.question for name, lesson in LESSONS.items()}
    assert asked["joint"].bounds == (-joint.EDGE, joint.EDGE)
    assert asked["bayes"].at == bayes.AT_A_DISTANCE
    assert asked["estimate"].bounds == (estimate.LOW, estimate.HIGH)
    assert f"by more than {estimate.HIT:g} m" in estimate.show(estimate.EstimateParameters(), 1).numbers[2].title
    assert f"within {estimate.HIT:g} m" in {it.name: it.title for it in LESSONS["estimate"].checks}["best-hit"]
    assert f"From {kalman.GAP} s on, 20 measurements" in asked["kalman"].text
    assert asked["kalman"].at == {"dropped": 20, "frame": kalman.GAP + 19}
    assert f"is off by {monte_carlo.SD / 10:g} m" in asked["monte-carlo"].text
    assert list(asked["importance"].choices or ()) == [f"{spread:g}" for spread in importance.CHOICES]
    body = LESSONS["colour"].body
    assert body.tracker == colour.SIR
    assert body.timeline[0].values == {"scene_number": colour.SCENE}


def test_a_wrong_file_of_the_course_is_told_with_its_line(tmp_path: Path) -> None:
    """Whether its form is wrong or it names a check that nobody computes."""
    text = (COURSE / "kalman.md").read_text(encoding="utf-8")
    file = tmp_path / "kalman.md"
    file.write_text(text.replace("notice:", "notise:"))
    with pytest.raises(ValueError, match=r"kalman.md, line \d+: there is no `notise` in a lesson; did you mean notice"):
        course_lesson(file, kalman.COMPUTED, 6)
    file.write_text(text.replace("  surprises:", "  suprises:"))
    with pytest.raises(ValueError, match=r"^kalman.md, line \d+: there is no check suprises; did you mean surprises"):
        course_lesson(file, kalman.COMPUTED, 6)


USES = """uses:
  - experiment: ball
    tracker: condensation
    frame: 4
    plots: [error]
    words: A cloud of places and velocities.
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("experiment: ball", "experiment: bowl", "got 'bowl'"),
        ("tracker: condensation", "tracker: condensatoin", "did you mean condensation?"),
        ("frame: 4", "frame: 4000", "`frame` is 4000, and the last of"),
        ("plots: [error]", "plots: [eror]", "did you mean error?"),
    ],
)
def test_a_lecturers_use_is_checked_as_a_run_is(old: str, new: str, words: str, tmp_path: Path) -> None:
    """A run that is shown beside a lesson fits its experiment, or its line is told."""
    text = (COURSE / "joint.md").read_text(encoding="utf-8").replace("id: joint", "id: mine")
    head, rest = text[: text.index("uses:")], text[text.index("\n---\n", 5) :]
    (tmp_path / "mine.md").write_text(head + USES.replace(old, new) + rest.lstrip("\n"))
    (problem,) = read_lessons(tmp_path).problems
    assert words in problem.message
    assert problem.line == len(head.splitlines()) + 1 + [old in line for line in USES.splitlines()].index(True)


def test_checks_belong_to_a_lesson_of_the_course(tmp_path: Path) -> None:
    """A file that answers by a number of its figure is told that nobody computes its checks."""
    text = (COURSE / "joint.md").read_text(encoding="utf-8").replace("id: joint", "id: mine")
    (tmp_path / "mine.md").write_text(text.replace("answer: joint", "answer: Mean of x, given z"))
    problems = read_lessons(tmp_path).problems
    assert {"name a lesson of the course as `answer`" in problem.message for problem in problems} == {True}
    assert isinstance(LESSONS["joint"].checks[0].run(), Outcome)
