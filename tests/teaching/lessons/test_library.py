"""Lessons in files: those of the course, those of lecturers, and messages about wrong files."""

import os
import sys
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

import pftrack
from pftrack.core.model.recipe import Change
from pftrack.core.refusal import RefusedError
from pftrack.runs.loss_probability import columns_of
from pftrack.teaching.lessons import LESSONS, find, library
from pftrack.teaching.lessons.course import bayes, colour, estimate, importance, joint, kalman, monte_carlo
from pftrack.teaching.lessons.document import LARGEST_BYTES, Document, DocumentError
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Outcome, answer_of, judge, question_recipe
from pftrack.teaching.lessons.library import Library, read_lessons

GOOD = """---
id: my-lesson
title: A ball in the dark
experiment: ball
tracker: condensation
seed: 3
frames: 12
timeline:
  - values: {occlusion_width_px: 60, sample_count: 50}
  - frame: 5
    values: {process_noise_px: 2}
unlocked: [tracker, occlusion_width_px, seed]
plots: [error]
frame: 4
question:
  text: How far off is the estimate on average?
  tolerance: 1
  unit: px
  bounds: [0, 100]
  at: {sample_count: 60, seed: 4}
  words: It is what it is.
  mistakes:
    - {given: [50, 100], words: That would be lost.}
answer: {measure: mean_error, first_frame: 2}
tries: [Make the pillar wider.]
notice: The error grows behind the pillar.
uses:
  - experiment: sine
    tracker: kalman
    frame: 7
    plots: [sigma]
    words: A signal in noise.
---
A ball goes behind a pillar, and $x$ is where it is.
"""


def read(folder: Path, text: str | bytes = GOOD, name: str = "mine.md") -> Library:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_lessons(folder)


def test_a_file_makes_a_lesson(tmp_path: Path) -> None:
    """The lesson has all fields of the file, next to the course, and names its file.

    Its answer comes from the run with the values and seed of the question; its check passes.
    """
    found = read(tmp_path)
    assert found.problems == ()
    lesson = found.lessons["my-lesson"]
    recipe = lesson.body.recipe
    assert (recipe.experiment, recipe.tracker, recipe.seed, recipe.frames) == ("ball", "condensation", 3, 12)
    assert [(change.frame, dict(change.values)) for change in recipe.timeline] == [
        (0, {"occlusion_width_px": 60, "sample_count": 50}),
        (5, {"process_noise_px": 2}),
    ]
    assert lesson.body.unlocked == ("tracker", "occlusion_width_px", "seed")
    assert (lesson.body.plots, lesson.body.frame) == (("error",), 4)
    assert (lesson.number, lesson.origin, lesson.tries) == (0, "mine.md", ("Make the pillar wider.",))
    assert lesson.idea.startswith("A ball goes behind")
    assert [(use.recipe.experiment, use.recipe.tracker, use.frame) for use in lesson.uses] == [("sine", "kalman", 7)]
    assert list(found.lessons)[: len(LESSONS)] == list(LESSONS)
    assert find("my-lesson", found.lessons) is lesson
    assert (question_recipe(lesson).seed, question_recipe(lesson).frames) == (4, 12)
    answer = answer_of(lesson)
    assert judge(lesson.question, answer, answer.exact).right
    assert "lost" in judge(lesson.question, answer, 80).words[1]
    assert [check.run().passed for check in lesson.checks] == [True]


def changed(old: str, new: str) -> str:
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


def choosing(lost: float, held: float) -> str:
    """Return the lesson with a question of choices, each with the lowest number at which it is right."""
    choices = "  kind: choice\n  choices: {held: It is held, lost: It is lost}\n"
    text = changed("  tolerance: 1\n  unit: px\n  bounds: [0, 100]\n", choices).replace("[50, 100]", "lost")
    answer = f"{{measure: mean_error, choices: {{lost: {lost}, held: {held}}}}}"
    return text.replace("{measure: mean_error, first_frame: 2}", answer)


def test_the_right_choice_begins_at_or_below_the_measure(tmp_path: Path) -> None:
    """The choices may have any order; a measure below every choice fails the check, which gives the reason."""
    for lost, right in ((1e-6, "lost"), (1000, "held")):
        assert answer_of(read(tmp_path, choosing(lost, 0)).lessons["my-lesson"]).exact == right
    (check,) = read(tmp_path, choosing(1000, 900)).lessons["my-lesson"].checks
    assert "below the lowest number of every choice" in check.run().words


BAD = {
    "unlocked": ("[tracker, occlusion_width", "[tracker, occlusion_with", 12, "have; did you mean occlusion_width_px?"),
    "experiment": ("\nexperiment: ball", "\nexperiment: bowl", 4, "experiment must be one of ball"),
    "tracker": ("tracker: condensation", "tracker: condensatoin", 5, "did you mean condensation?"),
    "bounds": ("sample_count: 50", "sample_count: 0", 9, "sample_count must be a whole number between"),
    "parameter": ("process_noise_px: 2", "proces_noise_px: 2", 11, "did you mean process_noise_px?"),
    "frame": ("frame: 4", "frame: 12", 14, "the last of 12 frames is 11"),
    "plot": ("plots: [error]", "plots: [eror]", 13, "did you mean error?"),
    "measure": ("measure: mean_error", "measure: mean_eror", 24, "no measure mean_eror; did you mean mean_error?"),
    "from": ("first_frame: 2", "first_frame: 12", 24, "`answer.first_frame` is 12, and the last frame is 11"),
    "formula": ("{measure: mean_error, first_frame: 2}", "sum(error[2:])", 24, "there are mean_error, lost_frames"),
    "key": ("first_frame: 2", "from: 2", 24, "there is no `answer.from` in a lesson"),
    "course": ("id: my-lesson", "id: colour", 2, "colour is taken by a lesson of the course"),
    "shipped": ("id: my-lesson", "id: too-sure-to-return", 2, "is taken by pftrack: too-sure"),
    "id": ("id: my-lesson", "id: My Lesson", 2, "must begin with a letter"),
    "no question": (GOOD[GOOD.index("question:") : GOOD.index("answer:")], "", 2, "`question` is missing"),
    "typo": ("notice:", "notise:", 26, "there is no `notise` in a lesson; did you mean notice?"),
    "both": ("\nexperiment: ball", "\nexperiment: ball\nfigure: estimate", 4, "an `experiment` or a `figure`"),
    "point": ("  tolerance: 1", "  tolerance: 1\n  kind: point", 18, "a run is asked for a number"),
    "mistake": ("given: [50, 100]", "given: far", 23, "`given` must be a number"),
    "seed": ("\nseed: 3", f"\nseed: {2**60}", 6, "`seed` must be a whole number between 0 and"),
    "use, frame": ("frame: 7", "frame: 4000", 30, "`frame` is 4000, and the last of"),
    "too long": (GOOD, GOOD + "word " * 100, 34, "fit beside the figure"),
    "no text": (GOOD[GOOD.rindex("---\n") + 4 :], "", 34, "there is no text"),
    "no head": (GOOD, "# A lesson\n", 1, "begins with a head"),
    "no end": (GOOD[GOOD.rindex("---\n") :], "", 1, "has no end"),
    "yaml": ("title: A", "title: : A", 3, "the head is not YAML"),
    "twice": ("\nseed: 3", "\nseed: 3\nseed: 4", 7, "`seed` is there twice"),
    "no mapping": (GOOD, "---\n- 1\n---\nText.\n", 2, "made of lines such as"),
    "tag": ("\nseed: 3", "\nseed: !!python/object/apply:os.getcwd []", 6, "the tag"),
    "bomb": ("\nseed: 3", "\nseed: &a [3]\nframe: *a", 6, "references"),
    "deep": ("\nseed: 3", f"\nseed: {'[' * 400}{']' * 400}", 6, "nested more than"),
    "endless": ("\nseed: 3", f"\nseed: 0x{'f' * 5000}", 6, "too large a number"),
    "base 60": ("\nseed: 3", f"\nseed: 1:{'0:' * 300}0.5", 6, "is not a value"),
    "control": ("A ball in", "A\x07ball in", 3, "character that YAML does not allow"),
    "large": (GOOD, GOOD + "x" * LARGEST_BYTES, 0, "the file is larger than 32 KiB; its text fits on one screen"),
}


@pytest.mark.parametrize(("old", "new", "line", "words"), BAD.values(), ids=BAD)
def test_a_mistake_is_reported_with_line_and_remedy(tmp_path: Path, old: str, new: str, line: int, words: str) -> None:
    """Each message names its line and the remedy, and another file in the folder is still read."""
    (tmp_path / "other.md").write_text(GOOD.replace("my-lesson", "my-other-lesson"))
    found = read(tmp_path, changed(old, new))
    assert "my-other-lesson" in found.lessons
    told = [(problem.line, problem.message) for problem in found.problems if problem.origin == "mine.md"]
    assert any(line == place and words in message for place, message in told), told
    assert all(words not in problem.message for problem in found.problems if problem.origin != "mine.md")


def test_a_file_that_raises_an_error_affects_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unforeseen error is reported for that file, with its type."""
    made = library.lesson_of

    def make(document: Document, origin: str) -> Lesson | list[DocumentError]:
        if origin == "mine.md":
            raise ZeroDivisionError
        return made(document, origin)

    monkeypatch.setattr(library, "lesson_of", make)
    (tmp_path / "other.md").write_text(GOOD.replace("my-lesson", "my-fine-lesson"))
    found = read(tmp_path, GOOD.replace("my-lesson", "my-strange-lesson"))
    assert "my-fine-lesson" in found.lessons
    (problem,) = found.problems
    assert problem.sentence.startswith("mine.md: nothing can be made of this file: reading it raises ZeroDivision")


def test_an_unchanged_file_is_not_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server reads all lessons at each request, and a folder may contain 200 files."""
    first = read(tmp_path, GOOD.replace("my-lesson", "my-kept-lesson")).lessons["my-kept-lesson"]
    monkeypatch.setattr(library, "lesson_of", None)
    assert read_lessons(tmp_path).lessons["my-kept-lesson"] is first
    monkeypatch.undo()
    changed_file = read(tmp_path, GOOD.replace("my-lesson", "my-kept-lesson").replace("in the dark", "in the light"))
    assert changed_file.lessons["my-kept-lesson"].title == "A ball in the light"


def test_all_mistakes_in_a_file_are_reported_at_once(tmp_path: Path) -> None:
    """A person can fix the file in one go."""
    text = changed("plots: [error]", "plots: [eror]").replace("sample_count: 50", "sample_count: -1")
    assert len(read(tmp_path, text.replace("[tracker,", "[tracer,")).problems) == 3


def test_files_are_read_as_utf_8(tmp_path: Path) -> None:
    """Other bytes are refused with their line; a byte order mark and Windows line ends are accepted.

    A number with an exponent is a number, though YAML 1.1 takes 1e-1 for a text.
    """
    latin = read(tmp_path, GOOD.replace("A ball in", "Ein Bäll in").encode("latin-1")).problems
    assert [(problem.line, "UTF-8" in problem.message) for problem in latin] == [(3, True)]
    assert read(tmp_path, b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()).problems == ()
    lesson = read(tmp_path, changed("given: [50, 100]", "given: 1e1").replace("tolerance: 1", "tolerance: 1e-1"))
    question = lesson.lessons["my-lesson"].question
    assert (question.tolerance, question.mistakes[0].given) == (0.1, 10.0)


def test_the_first_of_two_files_with_one_id_counts(tmp_path: Path) -> None:
    """The message on the other names the first; folders, pipes, other files and missing folders are skipped."""
    (tmp_path / "folder.md").mkdir()
    (tmp_path / "notes.txt").write_text("nothing")
    os.mkfifo(tmp_path / "pipe.md")
    assert read_lessons(tmp_path, tmp_path / "missing").problems == ()
    (tmp_path / "a.md").write_text(GOOD)
    found = read(tmp_path, GOOD, "b.md")
    assert found.lessons["my-lesson"].origin == "a.md"
    assert [(it.origin, it.line) for it in found.problems] == [("b.md", 2)]
    assert "taken by a.md" in found.problems[0].message


def test_packages_bring_lessons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lessons of an installed package are there; a package that cannot be imported is reported."""
    folder = tmp_path / "my_lessons"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "mine.md").write_text(GOOD)
    monkeypatch.syspath_prepend(tmp_path)
    entries = [EntryPoint("mine", "my_lessons", library.GROUP), EntryPoint("gone", "not_there_at_all", library.GROUP)]
    monkeypatch.setattr(library, "entry_points", lambda group: entries if group == library.GROUP else [])
    found = read_lessons()
    sys.modules.pop("my_lessons", None)
    assert found.lessons["my-lesson"].origin == "mine: mine.md"
    assert [problem.sentence for problem in found.problems] == [
        "gone: importing not_there_at_all raises ModuleNotFoundError; its lessons are left out"
    ]


# The files of the course.

COURSE = Path(bayes.__file__).parent


@pytest.mark.parametrize("name", LESSONS)
def test_a_lecturer_can_copy_a_lesson_and_edit_a_sentence(name: str, tmp_path: Path) -> None:
    """Under another id the file is a lecturer's lesson with the same figure, question and checks.

    The file names every check of its module, and the lesson of the course is found by id and by number.
    """
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
    module = import_module(f"pftrack.teaching.lessons.course.{name.replace('-', '_')}")
    assert [check.name for check in ours.checks] == list(module.COMPUTED.checks)
    assert find(name) is find(str(ours.number)) is ours


def test_texts_have_the_numbers_of_the_modules() -> None:
    """The constants in a question are those of its module."""
    asked = {name: lesson.question for name, lesson in LESSONS.items()}
    assert asked["joint"].bounds == (-joint.EDGE, joint.EDGE)
    assert asked["bayes"].at == bayes.AT_A_DISTANCE
    assert asked["estimate"].bounds == (estimate.LOW, estimate.HIGH)
    assert f"above {estimate.HIT:g} m" in estimate.show(estimate.EstimateParameters(), 1).numbers[2].title
    assert f"within {estimate.HIT:g} m" in {it.name: it.title for it in LESSONS["estimate"].checks}["best-hit"]
    assert f"From {kalman.GAP} s, 20 measurements" in asked["kalman"].text
    assert asked["kalman"].at == {"dropped": 20, "frame": kalman.GAP + 19}
    assert f"is {monte_carlo.SD / 10:g} m on average" in asked["monte-carlo"].text
    assert list(asked["importance"].choices or ()) == [f"{spread:g}" for spread in importance.CHOICES]
    body = LESSONS["colour"].body
    assert body.tracker == colour.SIR
    assert body.timeline[0].values == {"scene_number": colour.SCENE}


def test_checks_belong_to_a_lesson_of_the_course(tmp_path: Path) -> None:
    """A file whose answer is a number of its figure can have no checks of a module."""
    text = (COURSE / "joint.md").read_text(encoding="utf-8").replace("id: joint", "id: mine")
    (tmp_path / "mine.md").write_text(text.replace("answer: joint", "answer: Mean of x, given z"))
    problems = read_lessons(tmp_path).problems
    assert {"name a lesson of the course as `answer`" in problem.message for problem in problems} == {True}
    assert isinstance(LESSONS["joint"].checks[0].run(), Outcome)


# Three lessons in the form of a lecturer's: each still makes its point.

LIBRARY = read_lessons()
SHIPPED = {name: lesson for name, lesson in LIBRARY.lessons.items() if not lesson.number}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_lesson_still_has_its_answer(name: str) -> None:
    """Its check passes: the answer is as expected and is judged right; no file has a problem."""
    assert LIBRARY.problems == ()
    (check,) = SHIPPED[name].checks
    outcome = check.run()
    assert outcome.passed, outcome
    assert all(judged.given != answer_of(SHIPPED[name]).exact for judged in SHIPPED[name].question.mistakes)


@pytest.mark.parametrize(
    ("name", "values", "low", "high"),
    [
        ("tempted-by-look-alikes", {}, 21, 90),
        ("tempted-by-look-alikes", {"tracker": "condensation"}, 3, 3),
        ("cost-of-a-threshold", {"gamma_px": 5}, 0, 0),
        ("cost-of-a-threshold", {"gamma_px": 20}, 8, 18),
        ("cost-of-a-threshold", {"gamma_px": 1000}, 24, 90),
    ],
)
def test_a_shipped_lesson_makes_its_point(name: str, values: dict[str, Any], low: int, high: int) -> None:
    """Its settings lose the ball in the stated number of frames."""
    recipe = SHIPPED[name].body.recipe
    timeline = (*recipe.timeline, Change(0, values))
    lost = columns_of(pftrack.run(recipe.model_copy(update={"timeline": timeline})))["lost"]
    assert low <= lost.sum() <= high


@pytest.mark.parametrize("wanted", ["", "0", "1.5", "Probability"])
def test_an_unknown_lesson_is_refused(wanted: str) -> None:
    """The sentence quotes the name and lists all numbers and ids."""
    with pytest.raises(RefusedError) as caught:
        find(wanted)
    sentence = caught.value.args[0]
    assert repr(wanted) in sentence
    assert all(f"{lesson.number} {name}" in sentence for name, lesson in LESSONS.items())
