"""Polls: what classes were asked and how many gave which answer, to be shown again and taken away as CSV."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Query
from starlette.responses import Response

from pftrack_server.api.dependencies import TheFollows
from pftrack_server.follow.records import polls_csv
from pftrack_server.schemas.follows import PollKept

router = APIRouter(prefix="/polls", tags=["follows"])

CSV = "text/csv"
OfLecture = Annotated[str | None, Query(max_length=64, description="Those of one lecture alone")]


@router.get("")
async def list_polls(follows: TheFollows, lecture: OfLecture = None) -> list[PollKept]:
    """List what classes have answered, the newest first; what is not revealed yet is left out."""
    return await follows.kept_polls(lecture)


@router.get("/answers.csv", response_class=Response, responses={200: {"content": {CSV: {}}}})
async def polls_as_csv(follows: TheFollows, lecture: OfLecture = None) -> Response:
    """Return the same as a table, a row for each answer."""
    text = polls_csv(await follows.kept_polls(lecture))
    headers = {"Content-Disposition": 'attachment; filename="polls.csv"', "Cache-Control": "no-store"}
    return Response(text, media_type=CSV, headers=headers)


@router.delete("/{poll}", status_code=HTTPStatus.NO_CONTENT)
async def remove_poll(poll: Annotated[str, Path(max_length=64)], follows: TheFollows) -> None:
    """Forget a poll and its answers."""
    await follows.records.remove(poll)
