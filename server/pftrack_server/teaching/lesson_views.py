"""Lessons as pages see them: texts as HTML, controls as sessions have them, and questions without their answers."""

from pftrack.core.model.parameters import declarations, flat, revise
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Scenario, question_recipe
from pftrack.teaching.lessons.library import Library
from pftrack_server.teaching.lessons import Job
from pftrack_server.teaching.messages import (
    CheckedPublic,
    CheckPublic,
    ChecksPublic,
    LessonDetail,
    LessonPublic,
    LessonsPublic,
    NeighbourPublic,
    QuestionPublic,
    ScenarioPublic,
    missing,
)


def list_view(library: Library) -> LessonsPublic:
    """Return all lessons as the overview shows them."""
    return LessonsPublic(lessons=[_brief(each) for each in library.lessons.values()], problems=list(library.problems))


def detail_view(lesson: Lesson, library: Library) -> LessonDetail:
    """Return a lesson with all that its page needs."""
    body = lesson.body
    at = dict(lesson.question.at)
    parameters = body.parameters if isinstance(body, Demonstration) else None
    defaults = flat(parameters) if parameters else {}
    declared = declarations(type(parameters)) if parameters else ()
    order = [None, *library.lessons.values(), None]
    place = [each and each.id for each in order].index(lesson.id)
    before, after = (each and NeighbourPublic.model_validate(each) for each in (order[place - 1], order[place + 1]))
    scenario = ScenarioPublic.model_validate(body) if isinstance(body, Scenario) else None
    return LessonDetail(
        **dict(_brief(lesson)),
        idea=lesson.idea,
        tries=list(lesson.tries),
        notice=lesson.notice,
        declarations=list(declared),
        defaults=defaults,
        random=isinstance(body, Demonstration) and body.random,
        seed=body.seed if isinstance(body, Demonstration) else body.recipe.seed,
        question=QuestionPublic.model_validate(lesson.question),
        asked=flat(revise(parameters, at)) if parameters else at,
        # Its question may be about another run than the one that it begins with.
        scenario=scenario and scenario.model_copy(update={"recipe": question_recipe(lesson)}),
        previous=before,
        next=after,
    )


def checks_view(lesson: Lesson, job: Job) -> ChecksPublic:
    """Return what the checks of a lesson came to so far."""
    total = len(lesson.checks)
    if job.problem:
        failed = [CheckedPublic(check=each.name, title=each.title, problem=job.problem) for each in lesson.checks]
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
        checks=[CheckPublic.model_validate(each) for each in lesson.checks],
        uses=[ScenarioPublic.model_validate(each) for each in lesson.uses],
        minutes=lesson.minutes,
        problem=missing(scenario.experiment) if scenario else None,
    )
