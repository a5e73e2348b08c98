"""Lessons as pages see them: texts as HTML, controls as sessions have them, and questions without their answers."""

from pftrack.core.model.parameters import declarations, flat, revise
from pftrack.core.model.recipe import Recipe
from pftrack.experiments import find as find_experiment
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Question, Scenario, Verdict, question_recipe
from pftrack.teaching.lessons.library import Library
from pftrack_server.lessons.results import Job
from pftrack_server.lessons.service import missing
from pftrack_server.lessons.text import inline, paragraphs
from pftrack_server.schemas.lessons import (
    CheckedPublic,
    CheckPublic,
    ChecksPublic,
    ChoicePublic,
    LessonDetail,
    LessonPublic,
    LessonsPublic,
    NeighbourPublic,
    ProblemPublic,
    QuestionPublic,
    ScenarioPublic,
    UsePublic,
    VerdictPublic,
)


def list_view(library: Library) -> LessonsPublic:
    """Return all lessons as the overview shows them."""
    return LessonsPublic(
        lessons=[_brief(lesson) for lesson in library.lessons.values()],
        problems=[ProblemPublic.model_validate(problem) for problem in library.problems],
    )


def detail_view(lesson: Lesson, library: Library) -> LessonDetail:
    """Return a lesson with all that its page needs."""
    body = lesson.body
    at = dict(lesson.question.at)
    parameters = body.parameters if isinstance(body, Demonstration) else None
    defaults = flat(parameters) if parameters else {}
    declared = declarations(type(parameters)) if parameters else ()
    order = list(library.lessons.values())
    place = [each.id for each in order].index(lesson.id)
    return LessonDetail(
        **dict(_brief(lesson)),
        idea=paragraphs(lesson.idea),
        tries=[inline(each) for each in lesson.tries],
        notice=inline(lesson.notice),
        declarations=list(declared),
        defaults=defaults,
        random=isinstance(body, Demonstration) and body.random,
        seed=body.seed if isinstance(body, Demonstration) else body.recipe.seed,
        question=_question(lesson.question),
        asked=flat(revise(parameters, at)) if parameters else at,
        scenario=_scenario(body, question_recipe(lesson)) if isinstance(body, Scenario) else None,
        previous=_neighbour(order[place - 1]) if place > 0 else None,
        next=_neighbour(order[place + 1]) if place + 1 < len(order) else None,
    )


def verdict_view(verdict: Verdict) -> VerdictPublic:
    """Return a verdict."""
    return VerdictPublic(
        right=verdict.right,
        given=verdict.given,
        exact=verdict.exact,
        measured=verdict.measured,
        off=verdict.off,
        words=[inline(sentence) for sentence in verdict.words],
    )


def checks_view(lesson: Lesson, job: Job) -> ChecksPublic:
    """Return what the checks of a lesson came to so far."""
    total = len(lesson.checks)
    if job.problem:
        failed = [
            CheckedPublic(
                check=each.name,
                title=each.title,
                ours=None,
                exact=None,
                tolerance=None,
                passed=False,
                problem=job.problem,
            )
            for each in lesson.checks
        ]
        return ChecksPublic(done=total, total=total, results=failed)
    if job.result is None:
        return ChecksPublic(done=min(job.done, total), total=total, results=[])
    results = [CheckedPublic.model_validate(each) for each in job.result["results"]]
    return ChecksPublic(done=total, total=total, results=results)


def _brief(lesson: Lesson) -> LessonPublic:
    scenario = lesson.body if isinstance(lesson.body, Scenario) else None
    return LessonPublic(
        id=lesson.id,
        number=lesson.number,
        title=lesson.title,
        kind="scenario" if scenario else "demonstration",
        origin=lesson.origin,
        checks=[CheckPublic(name=each.name, title=each.title) for each in lesson.checks],
        uses=[UsePublic(words=inline(use.words), scenario=_scenario(use)) for use in lesson.uses],
        minutes=lesson.minutes,
        problem=missing(scenario) if scenario else None,
    )


def _scenario(scenario: Scenario, recipe: Recipe | None = None) -> ScenarioPublic:
    """Return a scenario, with another recipe than its own where its question is about that."""
    problem = missing(scenario)
    return ScenarioPublic(
        recipe=recipe or scenario.recipe,
        unlocked=list(scenario.unlocked),
        frame=scenario.frame,
        plots=list(scenario.plots),
        layers=list(scenario.layers),
        title=scenario.recipe.experiment if problem else find_experiment(scenario.recipe.experiment).title,
        problem=problem,
    )


def _question(question: Question) -> QuestionPublic:
    return QuestionPublic(
        text=inline(question.text),
        kind=question.kind,
        unit=question.unit,
        bounds=question.bounds,
        choices=[ChoicePublic(name=name, words=inline(words)) for name, words in (question.choices or {}).items()],
        panel=question.panel,
        along=question.along,
    )


def _neighbour(lesson: Lesson) -> NeighbourPublic:
    return NeighbourPublic(id=lesson.id, number=lesson.number, title=lesson.title)
