"""The library: lecturers' lessons from folders and packages, and all problems of files there.

Lecturers do not write Python. A file may come from anyone and is not trusted: `document` reads its values with their
lines, and this module checks whether it fits an experiment or a figure. Files come from the project itself, from
packages that name a package of theirs in the entry point group `pftrack.teaching.lessons`, and from folders, in this
order. A problem of one file does not affect others.
"""

import math
import re
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, MutableMapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final, cast

from pftrack.core.model.parameters import Parameters, declarations, revise
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run
from pftrack.runs.scoring import summarise
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons import find as find_lesson
from pftrack.teaching.lessons.document import (
    MOST_FILES,
    Document,
    DocumentError,
    Findings,
    Place,
    Problem,
    ask,
    decode,
    document_of,
    near,
    read_folders,
    read_source,
)
from pftrack.teaching.lessons.lesson import (
    Answer,
    AnswerHead,
    Check,
    Computed,
    Demonstration,
    Head,
    Lesson,
    Outcome,
    RunPart,
    Scenario,
    Setting,
    answer_of,
    judge,
)

# Converting a document to a lesson, with a check that it fits an experiment or a figure of the course.
#
# A lecturer's lesson shows a run of an experiment, or a figure of the course with other parameters. Its question is
# answered by a declared measure of the run, by a number of the figure, or as a lesson of the course answers its own.


BESIDE: Final = ("tracker", "seed")
"""Settings that can be unlocked in addition to parameters."""
VERDICTS: Final = ("mean_error", "lost_frames", "first_lost_frame")
"""Measures of every run for questions; its experiment declares more."""
OF_A_RUN: Final = ("tracker", "frames", "timeline", "unlocked", "plots", "layers", "frame")
"""Keys that a figure does not have."""


def body_of(head: Head, found: Findings) -> tuple[Scenario | Demonstration | None, tuple[str, ...]]:
    """Return what a lesson shows, and the names of its measures; None where something is wrong.

    Args:
        head: The head of the file.
        found: Collects problems.
    """
    if (head.experiment is None) == (head.figure is None):
        found.add(("experiment",) if head.experiment else (), "a lesson names either an `experiment` or a `figure`")
        return None, ()
    if head.figure is not None:
        return _demonstration(head, found)
    if head.parameters:
        found.add(("parameters",), "`parameters` are those of a figure; write those of an experiment in `timeline`")
    at = {name: value for name, value in head.question.at.items() if name != "seed"}
    scenario = _check_scenario(_scenario_of(head), (), at, found)
    if scenario is None:
        return None, ()
    if head.answer.first_frame >= (scenario.frames or 0):
        message = (
            f"`answer.first_frame` is {head.answer.first_frame}, and the last frame is {(scenario.frames or 0) - 1}"
        )
        found.add(("answer", "first_frame"), message)
    return scenario, (*VERDICTS, *(one.name for one in find_experiment(scenario.experiment).run_measures))


def _scenario_of(head: Head) -> Scenario:
    """Return the run that a head speaks of."""
    said = {name: getattr(head, name) for name in RunPart.model_fields}
    return Scenario(experiment=head.experiment or "", **said)


def _check_scenario(said: Scenario, place: Place, at: Mapping[str, object], found: Findings) -> Scenario | None:
    """Return a run with its tracker and its length; None where something is wrong.

    Args:
        said: The entry.
        place: Its place in the head.
        at: Values at which a question is asked about it.
        found: Where it is noted what is wrong.
    """
    experiment = found.attempt((*place, "experiment"), lambda: find_experiment(said.experiment))
    if experiment is None:
        return None
    before = len(found.problems)
    setup = experiment.simulate()
    tracker = said.tracker or experiment.default_tracker
    if tracker not in experiment.trackers:
        message = f"{experiment.id} has no tracker {tracker}; {near(tracker, experiment.trackers)}"
        found.add((*place, "tracker"), message)
        tracker = experiment.default_tracker
    seed = said.seed or 0
    if seed > LARGEST_SEED:
        found.add((*place, "seed"), f"`seed` must be a whole number between 0 and {LARGEST_SEED}")
    _check_names(said, place, experiment, type(setup.parameters), found)
    timeline = Timeline.begin(setup.parameters, tracker, tuple(experiment.trackers))
    for number, change in enumerate(said.timeline):
        inner = (*place, "timeline", number, "values")
        timeline = _apply_change(timeline, Change(change.frame, change.values), inner, found)
    _apply_change(timeline, Change(0, at), ("question", "at"), found)
    if len(found.problems) > before:
        return None
    available = setup.open_source(seed, timeline.parameters_at(0)).frame_count
    frames = said.frames or available or experiment.frames
    _check_frames(said, place, min(frames, available or frames), found)
    settings = tuple(Setting(frame=each.frame, values=dict(each.values)) for each in timeline.changes)
    return said.model_copy(update={"tracker": tracker, "frames": frames, "timeline": settings})


def _check_frames(said: Scenario, place: Place, frames: int, found: Findings) -> None:
    if said.frames is not None and said.frames > frames:
        message = f"`frames` is {said.frames}, and this scene has {frames}; say fewer, or leave it out"
        found.add((*place, "frames"), message)
    if said.frame >= frames:
        found.add((*place, "frame"), f"`frame` is {said.frame}, and the last of {frames} frames is {frames - 1}")
    for number, change in enumerate(said.timeline):
        if change.frame >= frames:
            message = f"this change comes in frame {change.frame}, and the last is {frames - 1}"
            found.add((*place, "timeline", number), message)


def _apply_change(timeline: Timeline, change: Change, place: Place, found: Findings) -> Timeline:
    model: type[Parameters] = type(timeline.parameters_at(0))
    known = {it.name for it in declarations(model)} | {"tracker"}
    values = {}
    for name, value in change.values.items():
        if name in known:
            values[name] = value
        else:
            found.add((*place, name), f"there is no parameter {name}; {near(name, known)}")
    changed = found.attempt(place, lambda: timeline.insert(Change(change.frame, values)))
    return changed or timeline


def _check_names(
    said: Scenario, place: Place, experiment: Experiment, model: type[Parameters], found: Findings
) -> None:
    known = {
        "unlocked": [*(it.name for it in declarations(model)), *BESIDE],
        "plots": [plot.id for plot in experiment.display.plots],
        "layers": [layer.name for layer in experiment.display.layers],
    }
    for field, names in known.items():
        for number, name in enumerate(getattr(said, field)):
            if name not in names:
                message = f"`{field}` names {name}, which {experiment.id} does not have; {near(name, names)}"
                found.add((*place, field, number), message)


def _demonstration(head: Head, found: Findings) -> tuple[Demonstration | None, tuple[str, ...]]:
    lesson: Lesson | None = found.attempt(("figure",), lambda: find_lesson(str(head.figure)))
    for name in OF_A_RUN:
        if name in head.model_fields_set:
            found.add((name,), f"`{name}` belongs to an experiment; a figure has `parameters` and `seed`, all unlocked")
    if lesson is None:
        return None, ()
    if not isinstance(lesson.body, Demonstration):
        experiment = lesson.body.experiment
        found.add(("figure",), f"the lesson {lesson.id} shows no figure; name its `experiment`, {experiment}")
        return None, ()
    body = lesson.body
    parameters = found.attempt(("parameters",), lambda: revise(body.parameters, head.parameters))
    at = found.attempt(("question", "at"), lambda: revise(parameters or body.parameters, head.question.at))
    if parameters is None or at is None:
        return None, ()
    seed = body.seed if head.seed is None else head.seed
    return replace(body, parameters=parameters, seed=seed), tuple(_figure_numbers(body, at, seed))


def _answering(head: Head) -> Lesson | None:
    """Return the lesson of the course whose own answer a file takes: that of its figure, or one that shows a run."""
    lesson = LESSONS.get(head.answer.measure)
    if lesson is None:
        return None
    fits = isinstance(lesson.body, Scenario) if head.figure is None else lesson is find_lesson(head.figure)
    return lesson if fits else None


def _check_answer(head: Head, names: Collection[str], found: Findings) -> None:
    """Note what is wrong with an answer, given the measures of the run or the numbers of the figure."""
    asked, answer = head.question, head.answer
    if answer.measure not in names:
        found.add(("answer",), f"there is no measure {answer.measure}; {near(answer.measure, names)}")
    if head.figure is not None and answer.first_frame:
        found.add(("answer", "first_frame"), "`first_frame` belongs to an experiment; a figure has no frames")
    if (asked.kind == "choice") != (answer.choices is not None):
        message = "a question of the kind choice has `answer.choices`, the lowest number of each; no other has"
        found.add(("answer", "choices"), message)
    for name in answer.choices or {}:
        if name not in (asked.choices or {}):
            message = f"`answer.choices` names {name}, which is not a choice; {near(name, asked.choices or {})}"
            found.add(("answer", "choices", name), message)


def _answer(head: AnswerHead, body: Scenario | Demonstration) -> Callable[..., Answer]:
    if isinstance(body, Demonstration):
        return lambda parameters, seed: _answer_from(head, _figure_numbers(body, parameters, seed))
    return partial(_answer_of_run, head)


def _answer_of_run(head: AnswerHead, run: Run) -> Answer:
    rows = run.diagnostics[head.first_frame :]
    summary = summarise(run.experiment, run.setup, run.timeline, run.seed, rows)
    verdict = summary.verdict
    numbers = {**summary.measures, "mean_error": verdict.mean_error, "lost_frames": verdict.lost_frames}
    if verdict.lost_frames is not None:
        first = verdict.first_lost_frame
        numbers["first_lost_frame"] = run.frames if first is None else head.first_frame + first
    return _answer_from(head, numbers)


def _figure_numbers(body: Demonstration, parameters: Parameters, seed: int) -> dict[str, float]:
    return {number.title: number.value for number in body.show(parameters, seed).numbers}


def _answer_from(head: AnswerHead, numbers: Mapping[str, float | None]) -> Answer:
    """Return the answer that a number gives: the number, or the last choice that begins at or below it."""
    number = numbers.get(head.measure)
    if number is None or not math.isfinite(number):
        raise RefusedError(f"the run has no {head.measure}; ask for a measure that is known in its frames")
    if head.choices is None:
        return Answer(float(number))
    begun = [name for name, lowest in sorted(head.choices.items(), key=lambda each: each[1]) if lowest <= number]
    if not begun:
        raise RefusedError(f"{head.measure} is {number:g}, below the lowest number of every choice")
    return Answer(begun[-1])


def check_question(head: Head, body: Scenario | Demonstration | None, found: Findings) -> None:
    """Note what is wrong with a question."""
    asked = head.question
    if not asked.bounds[0] < asked.bounds[1]:
        found.add(("question", "bounds"), "`question.bounds` must be [lowest, highest]")
    if asked.kind != "choice" and not asked.tolerance:
        found.add(("question",), "`question.tolerance` is missing: state the largest error of a right answer")
    _check_choices(head, found)
    if (asked.kind == "point") != bool(asked.panel) or (asked.kind == "point" and isinstance(body, Scenario)):
        found.add(("question", "kind"), "a point is placed in a `panel` of a `figure`; a run is asked for a number")
    if asked.panel and isinstance(body, Demonstration):
        panels = [panel.id for panel in body.show(body.parameters, body.seed).figure.panels]
        if asked.panel not in panels:
            found.add(("question", "panel"), f"the figure has no panel {asked.panel}; {near(asked.panel, panels)}")


def _check_choices(head: Head, found: Findings) -> None:
    asked = head.question
    choices = asked.choices or {}
    if (asked.kind == "choice") != bool(choices):
        found.add(("question", "choices"), "a question of the kind choice has `choices`, and no other has")
    allowed = f"one of {', '.join(choices)}" if choices else "a number"
    for number, mistake in enumerate(asked.mistakes):
        if mistake.given not in choices if choices else isinstance(mistake.given, str):
            found.add(("question", "mistakes", number, "given"), f"`given` must be {allowed}, got {mistake.given}")
    if asked.expected is not None and (asked.expected not in choices if choices else isinstance(asked.expected, str)):
        found.add(("question", "expected"), f"`question.expected` must be {allowed}, got {asked.expected}")


MOST_WORDS: Final = 90
PAGE: Final = "docs/how-to/lessons.md"


def lesson_of(document: Document, origin: str) -> Lesson | list[DocumentError]:
    """Return the lesson of a document, or all that is wrong with it.

    Args:
        document: The file.
        origin: Its source, for users.
    """
    head = ask(document, Head, "a lesson", PAGE)
    if isinstance(head, list):
        return head
    found = Findings(document)
    _check_text(document, found)
    body, measures = body_of(head, found)
    check_question(head, body, found)
    uses = [_check_scenario(use, ("uses", number), {}, found) for number, use in enumerate(head.uses)]
    answering = _answering(head)
    if body is not None and answering is None:
        _check_answer(head, measures, found)
    checks = _checks(head, {it.name: it.run for it in answering.checks} if answering else {}, found)
    if found.problems or body is None:
        return found.problems
    answer = answering.answer if answering else _answer(head.answer, body)
    lesson = replace(
        _make(document, head, body, answer),
        checks=checks,
        uses=tuple(use for use in uses if use is not None),
        origin=origin,
        source=document.source,
    )
    return lesson if checks else replace(lesson, checks=(_check(lesson),))


def course_lesson(path: Path, computed: Computed, number: int) -> Lesson:
    """Return a lesson of the course; whether its runs fit their experiments, which would import these, is tested.

    Args:
        path: Its file.
        computed: Computations of the module next to the file.
        number: Its place in the course.

    Raises:
        ValueError: Something is wrong with the file; the sentence names it and the line.
    """
    try:
        document = document_of(decode(read_source(path)))
    except DocumentError as error:
        raise _refusal([error], f"{path.name}, ") from None
    head = ask(document, Head, "a lesson", PAGE)
    if isinstance(head, list):
        raise _refusal(head, f"{path.name}, ")
    found = Findings(document)
    checks = _checks(head, computed.checks, found)
    if found.problems:
        raise _refusal(found.problems, f"{path.name}, ")
    lesson = _make(document, head, computed.figure or _scenario_of(head), computed.answer)
    return replace(lesson, checks=checks, uses=head.uses, number=number)


def _make(document: Document, head: Head, body: Scenario | Demonstration, answer: Callable[..., Answer]) -> Lesson:
    return Lesson(
        id=head.id,
        title=head.title,
        idea=document.text,
        body=body,
        notice=head.notice,
        tries=head.tries,
        question=head.question,
        answer=answer,
        declared_minutes=head.minutes,
    )


def _checks(head: Head, known: Mapping[str, Callable[[], Outcome]], found: Findings) -> tuple[Check, ...]:
    """Return the checks that a file names, of those that a lesson of the course computes."""
    for name in head.checks:
        if name not in known:
            remedy = near(name, known) if known else "name a lesson of the course as `answer`, or leave `checks` out"
            found.add(("checks", name), f"there is no check {name}; {remedy}")
    return tuple(Check(name, title, known[name]) for name, title in head.checks.items() if name in known)


def _check_text(document: Document, found: Findings) -> None:
    words = len(re.sub(r"\$[^$]+\$", "formula", document.text).split())
    if not words:
        found.problems.append(DocumentError(document.text_line, "there is no text; write the idea below the head"))
    if words > MOST_WORDS:
        message = f"the text has {words} words, and {MOST_WORDS} fit beside the figure; say it in fewer"
        found.problems.append(DocumentError(document.text_line, message))


def _check(lesson: Lesson) -> Check:
    """Return the check that the answer can be computed, is what its author saw, and is judged right."""
    expected = lesson.question.expected
    seen = ", and is what its author saw" if expected is not None else ""

    def run() -> Outcome:
        try:
            exact = answer_of(lesson).exact
            right = judge(lesson.question, Answer(exact), exact).right
        except RefusedError as error:
            return Outcome(math.nan, 1.0, 0.0, str(error))
        if isinstance(exact, float) and isinstance(expected, float) and right:
            return Outcome(exact, expected, lesson.question.tolerance)
        return Outcome(float(right and expected in {None, exact}), 1.0, 0.0)

    return Check("answer", f"The answer can be computed and is judged right{seen}.", run)


GROUP: Final = "pftrack.teaching.lessons"
SHIPPED: Final = Path(__file__).parent / "shipped"
MOST_KEPT: Final = 2 * MOST_FILES
"""Files whose lessons are kept: one takes milliseconds to make, and a server is asked for all at each request."""


@dataclass(frozen=True, slots=True)
class Library:
    """What was found.

    Attributes:
        lessons: Lessons of the course, then of lecturers, by id; those of the course are imported on demand.
        problems: What is wrong with other files.
    """

    lessons: Mapping[str, Lesson]
    problems: tuple[Problem, ...]


def read_lessons(*folders: Path) -> Library:
    """Read all lecturers' lessons.

    Args:
        folders: Folders in addition to the project and packages; a missing one is empty.
    """
    packages, problems = _packages()
    places = [(SHIPPED, "pftrack: "), *packages, *((folder, "") for folder in folders)]
    known, wrong = read_folders(places, _found, lambda name: "a lesson of the course" if name in LESSONS else None)
    course = cast("MutableMapping[str, Lesson]", LESSONS)  # later maps of the chain are only read
    return Library(ChainMap(known, course), (*problems, *wrong))


def read_lesson(text: str) -> Lesson:
    """Return the lesson of the text of a file, as a notebook carries it.

    Raises:
        ValueError: It is none; the sentences say why.
    """
    found = _found(text.encode(), "a notebook")
    if isinstance(found, Lesson):
        return found
    raise _refusal(found)


def _refusal(problems: Iterable[DocumentError], file: str = "") -> ValueError:
    return ValueError("; ".join(f"{file}line {error.line}: {error.message}" for error in problems))


@lru_cache(MOST_KEPT)
def _found(data: bytes, origin: str) -> Lesson | list[DocumentError]:
    """Return the lesson of a file's content, or all that is wrong with it.

    Raises:
        DocumentError: It is not a text with a head.
    """
    return lesson_of(document_of(decode(data)), origin)


def _packages() -> tuple[list[tuple[Path, str]], list[Problem]]:
    """Return the folders of packages, in an order that does not hang on how these are found, and what is wrong."""
    places: list[tuple[Path, str]] = []
    problems: list[Problem] = []
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.name
        folder = _folder(entry)
        if isinstance(folder, Path):
            places.append((folder, f"{origin}: "))
        else:
            problems.append(Problem(origin, 0, folder))
    return places, problems


def _folder(entry: EntryPoint) -> Path | str:
    """Return the folder of the package that an entry point names, or why there is none."""
    try:
        files = import_module(entry.module).__file__
    except (Exception, SystemExit) as error:  # noqa: BLE001 - what a foreign import may raise is open
        return f"importing {entry.module} raises {type(error).__name__}; its lessons are left out"
    if files is None:
        return f"{entry.module} has no folder; name a package that has an __init__.py and the files beside it"
    return Path(files).parent
