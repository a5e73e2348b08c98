"""Routes and pages of lessons and lectures; and the entry point of teaching for the app.

The app calls `install` to add addresses, pages and the check of class links, and `opened` to open their services.
"""

import asyncio
import re
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Request
from starlette.responses import RedirectResponse, Response

from pftrack.core.model.parameters import declarations, flat, revise
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Scenario, question_recipe
from pftrack.teaching.lessons.library import Library
from pftrack_server.core.base_path import address_of
from pftrack_server.core.bodies import fields_of
from pftrack_server.core.errors import ApiError
from pftrack_server.core.requests import AName, service
from pftrack_server.jobs.results import DiskCache
from pftrack_server.store.database import LectureRow
from pftrack_server.store.store import AStore
from pftrack_server.teaching import class_routes, messages
from pftrack_server.teaching.access import AccessGuard
from pftrack_server.teaching.class_routes import TheLessons, follower
from pftrack_server.teaching.follows import Follows, PollRecords
from pftrack_server.teaching.lectures import Lectures
from pftrack_server.teaching.lessons import Lessons
from pftrack_server.web.pages import add_pages, page
from pftrack_server.web.services import Services

NOTEBOOK = "application/x-ipynb+json"
MARKDOWN = "text/markdown"
TheLectures = Annotated[Lectures, service(Lectures)]
FILE = {"requestBody": {"required": True, "content": {MARKDOWN: {"schema": {"type": "string"}}}}}

router = APIRouter(prefix="/lessons", tags=["lessons"])
lectures_router = APIRouter(prefix="/lectures", tags=["lectures"])
pages = APIRouter(include_in_schema=False)


def install(app: FastAPI) -> None:
    """Add teaching to an app."""
    for part in (router, class_routes.router, lectures_router):
        app.include_router(part, prefix="/api/v1")
    app.include_router(pages)
    app.add_middleware(AccessGuard)


@asynccontextmanager
async def opened(services: Services) -> AsyncIterator[None]:
    """Add the services of teaching's handlers to the server's services, while the context lasts."""
    folder = services.settings.data_dir
    kept = await asyncio.to_thread(DiskCache, folder / "lessons-computed")
    lessons = Lessons(folder / "lessons", kept, services.tasks)
    follows = Follows(services.settings, services.manager, lessons, PollRecords(services.store))
    services.added.extend((lessons, Lectures(services.house, lessons), follows))
    try:
        yield
    finally:
        await follows.close()
        await lessons.close()


async def _lesson(lesson: AName, lessons: TheLessons) -> Lesson:
    return await lessons.get(lesson)


ALesson = Annotated[Lesson, Depends(_lesson)]


# Views of lessons: texts as HTML, controls as in sessions, questions without answers.


def _detail_view(lesson: Lesson, library: Library) -> messages.LessonDetail:
    """Return a lesson with everything for its page."""
    body = lesson.body
    at = dict(lesson.question.at)
    parameters = body.parameters if isinstance(body, Demonstration) else None
    defaults = flat(parameters) if parameters else {}
    declared = declarations(type(parameters)) if parameters else ()
    order = [None, *library.lessons.values(), None]
    place = [each and each.id for each in order].index(lesson.id)
    scenario = messages.ScenarioPublic.model_validate(body) if isinstance(body, Scenario) else None
    return messages.LessonDetail(
        **fields_of(messages.LessonDetail, lesson) | dict(_brief(lesson)),
        declarations=list(declared),
        defaults=defaults,
        random=isinstance(body, Demonstration) and body.random,
        seed=body.seed if isinstance(body, Demonstration) else body.recipe.seed,
        asked=flat(revise(parameters, at)) if parameters else at,
        # Its question may be about another run than its first one.
        scenario=scenario and scenario.model_copy(update={"recipe": question_recipe(lesson)}),
        previous=order[place - 1],
        next=order[place + 1],
    )


def _brief(lesson: Lesson) -> messages.LessonPublic:
    scenario = lesson.body if isinstance(lesson.body, Scenario) else None
    return messages.LessonPublic(
        **fields_of(messages.LessonPublic, lesson),
        kind="scenario" if scenario else "demonstration",
        problem=messages.missing(scenario.experiment) if scenario else None,
    )


@router.get("")
async def list_lessons(lessons: TheLessons) -> messages.LessonsPublic:
    """List all lessons, and the problems of lecturers' files that cannot be read."""
    library = await lessons.all()
    return messages.LessonsPublic(lessons=[_brief(it) for it in library.lessons.values()], problems=library.problems)


@router.get("/{lesson}")
async def show_lesson(lesson: ALesson, lessons: TheLessons) -> messages.LessonDetail:
    """Return a lesson without the answer to its question."""
    return _detail_view(lesson, await lessons.all())


@router.post("/{lesson}/figure", response_class=Response, responses={200: {"model": messages.FigurePublic}})
async def draw_figure(lesson: ALesson, body: messages.FigureRequest, lessons: TheLessons) -> Response:
    """Compute the figure of a demonstration at some parameters."""
    return Response(await lessons.figure(lesson, body), media_type="application/json")


@router.post("/{lesson}/answer", responses={202: {"model": messages.ComputingPublic}})
async def answer(
    lesson: ALesson, body: messages.AnswerRequest, lessons: TheLessons, response: Response
) -> messages.VerdictPublic | messages.ComputingPublic:
    """Judge a prediction: how far off it is, and why; 202 while the deciding run is still being computed."""
    said = await lessons.judge(lesson, body.answer)
    if isinstance(said, messages.ComputingPublic):
        response.status_code = HTTPStatus.ACCEPTED
        return said
    return messages.VerdictPublic.model_validate(said)


@router.get(
    "/{lesson}/notebook.ipynb",
    response_class=Response,
    responses={200: {"content": {NOTEBOOK: {"schema": {"type": "string", "format": "binary"}}}}},
)
async def notebook(lesson: ALesson, lessons: TheLessons) -> Response:
    """Return a lesson as a Jupyter notebook that computes the same numbers."""
    headers = {"Content-Disposition": f'attachment; filename="{lesson.id}.ipynb"'}
    return Response(await lessons.notebook(lesson), media_type=NOTEBOOK, headers=headers)


@router.get("/{lesson}/checks")
async def checks(lesson: ALesson, lessons: TheLessons) -> messages.ChecksPublic:
    """Compute a lesson's checks and return the results so far; ask again until all are done."""
    total = len(lesson.checks)
    if not total:
        return messages.ChecksPublic(done=0, total=0, results=[])
    job = await lessons.checks(lesson)
    if job.error is not None:
        problem = f"{job.error.rstrip('.')}."
        failed = [messages.CheckedPublic(check=it.name, title=it.title, problem=problem) for it in lesson.checks]
        return messages.ChecksPublic(done=total, total=total, results=failed)
    results = job.result["results"] if job.result is not None else []
    return messages.ChecksPublic(done=total if results else min(job.done, total), total=total, results=results)


@lectures_router.get("")
async def list_lectures(lectures: TheLectures) -> Sequence[messages.LectureSummary]:
    """List all lectures, newest first."""
    return await lectures.all()


@lectures_router.post("", status_code=HTTPStatus.CREATED)
async def add_lecture(body: messages.LectureUpdate, lectures: TheLectures) -> messages.LecturePublic:
    """Store a new lecture; runs given by reference are stored in it as recipes."""
    return await lectures.add(body)


@lectures_router.post("/import", status_code=HTTPStatus.CREATED, openapi_extra=FILE)
async def import_lecture(request: Request, lectures: TheLectures) -> messages.LecturePublic:
    """Import the file of a lecture; problems of items that are missing here name their line."""
    return await lectures.bring_in(await request.body())


@lectures_router.get("/{lecture}")
async def show_lecture(lecture: AName, lectures: TheLectures) -> messages.LecturePublic:
    """Return a whole lecture."""
    return await lectures.get(lecture)


@lectures_router.put("/{lecture}")
async def change_lecture(lecture: AName, body: messages.LectureUpdate, lectures: TheLectures) -> messages.LecturePublic:
    """Replace the content of a lecture."""
    return await lectures.change(lecture, body)


@lectures_router.delete("/{lecture}", status_code=HTTPStatus.NO_CONTENT)
def remove_lecture(lecture: AName, store: AStore) -> None:
    """Delete a lecture; its answered polls stay."""
    store.discard(LectureRow, lecture)


@lectures_router.get("/{lecture}/file", response_class=Response, responses={200: {"content": {MARKDOWN: {}}}})
async def lecture_file(lecture: AName, lectures: TheLectures) -> Response:
    """Return the file of a lecture."""
    title, text = await lectures.text(lecture)
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")[:60] or "lecture"
    headers = {"Content-Disposition": f'attachment; filename="{name}.lecture.md"', "Cache-Control": "no-store"}
    return Response(text, media_type=MARKDOWN, headers=headers)


add_pages(pages, {"/lectures": "lectures/lectures.html", "/lectures/{lecture}": "lectures/lecture.html"})
add_pages(pages, {"/learn": "learn/learn.html"})


@pages.get("/learn/{lesson}")
async def lesson_page(request: Request, lesson: str, lessons: TheLessons) -> Response:
    """Return the page of a lesson, or one that says that there is none; a number redirects to its lesson."""
    try:
        found = await lessons.get(lesson)
    except ApiError as error:
        return page(request, "learn/lesson.html", error.status)
    if found.id != lesson:
        return RedirectResponse(address_of(request.scope, f"learn/{found.id}"))
    return page(request, "learn/lesson.html")


@pages.get("/follow", dependencies=[Depends(follower)])
async def follow_page(request: Request) -> Response:
    """Return the page of followers."""
    return page(request, "follow/follow.html")
