"""Lessons: what there is, what each shows, what is said of an answer, and what its checks came to."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Depends, Path
from starlette.responses import Response

from pftrack.teaching.lessons.lesson import Lesson
from pftrack_server.api.dependencies import TheLessons
from pftrack_server.lessons.results import Job
from pftrack_server.lessons.views import checks_view, detail_view, list_view, verdict_view
from pftrack_server.schemas.lessons import (
    AnswerRequest,
    ChecksPublic,
    ComputingPublic,
    FigurePublic,
    FigureRequest,
    LessonDetail,
    LessonsPublic,
    VerdictPublic,
)

NOTEBOOK = "application/x-ipynb+json"

router = APIRouter(prefix="/lessons", tags=["lessons"])


async def _lesson(lesson: Annotated[str, Path(max_length=64)], lessons: TheLessons) -> Lesson:
    return await lessons.get(lesson)


ALesson = Annotated[Lesson, Depends(_lesson)]


@router.get("")
async def list_lessons(lessons: TheLessons) -> LessonsPublic:
    """List all lessons, and what is wrong with those of lecturers that cannot be read."""
    return list_view(await lessons.all())


@router.get("/{lesson}")
async def show_lesson(lesson: ALesson, lessons: TheLessons) -> LessonDetail:
    """Tell everything about a lesson but the answer of its question."""
    return detail_view(lesson, await lessons.all())


@router.post("/{lesson}/figure", response_class=Response, responses={200: {"model": FigurePublic}})
async def draw_figure(lesson: ALesson, body: FigureRequest, lessons: TheLessons) -> Response:
    """Return what a demonstration comes to at some parameters."""
    return Response(await lessons.figure(lesson, body), media_type="application/json")


@router.post(
    "/{lesson}/answer",
    responses={202: {"model": ComputingPublic, "description": "The run is still being computed; ask again"}},
)
async def answer(
    lesson: ALesson, body: AnswerRequest, lessons: TheLessons, response: Response
) -> VerdictPublic | ComputingPublic:
    """Judge a prediction: how far off it is, and why."""
    said = await lessons.judge(lesson, body.answer)
    if isinstance(said, ComputingPublic):
        response.status_code = HTTPStatus.ACCEPTED
        return said
    return verdict_view(said)


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
async def checks(lesson: ALesson, lessons: TheLessons) -> ChecksPublic:
    """Compute what a lesson claims, and tell how far that is; ask again until all is done."""
    return checks_view(lesson, await lessons.checks(lesson) if lesson.checks else Job())
