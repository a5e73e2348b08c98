"""Lectures: made, kept, brought in and taken away as one small text file."""

import re
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request
from starlette.responses import Response

from pftrack_server.api.dependencies import TheLectures
from pftrack_server.schemas.lectures import LecturePublic, LectureSummary, LectureUpdate

router = APIRouter(prefix="/lectures", tags=["lectures"])

MARKDOWN = "text/markdown"
FILE = {"requestBody": {"required": True, "content": {MARKDOWN: {"schema": {"type": "string"}}}}}
Name = Annotated[str, Path(max_length=64)]


@router.get("")
async def list_lectures(lectures: TheLectures) -> list[LectureSummary]:
    """List all lectures, the newest first."""
    return await lectures.all()


@router.post("", status_code=HTTPStatus.CREATED)
async def add_lecture(body: LectureUpdate, lectures: TheLectures) -> LecturePublic:
    """Keep a new lecture; runs that it names by a reference are taken into it."""
    return await lectures.add(body)


@router.post("/import", status_code=HTTPStatus.CREATED, openapi_extra=FILE)
async def import_lecture(request: Request, lectures: TheLectures) -> LecturePublic:
    """Take in the file of a lecture; items that are not here are told by their line."""
    return await lectures.bring_in(await request.body())


@router.get("/{lecture}")
async def show_lecture(lecture: Name, lectures: TheLectures) -> LecturePublic:
    """Tell everything about a lecture."""
    return await lectures.get(lecture)


@router.put("/{lecture}")
async def change_lecture(lecture: Name, body: LectureUpdate, lectures: TheLectures) -> LecturePublic:
    """Put another order in the place of a lecture's."""
    return await lectures.change(lecture, body)


@router.delete("/{lecture}", status_code=HTTPStatus.NO_CONTENT)
async def remove_lecture(lecture: Name, lectures: TheLectures) -> None:
    """Forget a lecture; what was answered in it stays."""
    await lectures.remove(lecture)


@router.get("/{lecture}/file", response_class=Response, responses={200: {"content": {MARKDOWN: {}}}})
async def lecture_file(lecture: Name, lectures: TheLectures) -> Response:
    """Return the file of a lecture."""
    title, text = await lectures.text(lecture)
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")[:60] or "lecture"
    headers = {"Content-Disposition": f'attachment; filename="{name}.lecture.md"', "Cache-Control": "no-store"}
    return Response(text, media_type=MARKDOWN, headers=headers)
