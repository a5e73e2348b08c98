"""Follows: a lecturer lets a class follow, asks it questions, and ends it."""

import io
from http import HTTPStatus
from typing import Annotated

import segno
from fastapi import APIRouter, Query, Request, WebSocket
from starlette.responses import Response

from pftrack.core.refusal import ConflictError
from pftrack_server.api.dependencies import AFollow, TheFollows, TheLessons
from pftrack_server.core.base_path import address_of
from pftrack_server.core.errors import NotFoundError
from pftrack_server.follow.participant import participant_of
from pftrack_server.schemas.follows import FollowCreate, FollowOwned, FollowUpdate, PollCreate
from pftrack_server.schemas.lessons import ComputingPublic, FigurePublic, FigureRequest
from pftrack_server.sessions.duplex import GONE, converse

router = APIRouter(prefix="/follows", tags=["follows"])

FAREWELL = "The class has ended."


@router.post("", status_code=HTTPStatus.CREATED)
async def begin_follow(body: FollowCreate, follows: TheFollows, request: Request) -> FollowOwned:
    """Let a class follow up to four sessions, a lesson, or both."""
    origin = request.headers.get("origin") or f"{request.url.scheme}://{request.url.netloc}"
    follow = await follows.begin(body, origin + address_of(request.scope).removesuffix("/"))
    return follow.owner_view()


@router.get("")
async def list_follows(follows: TheFollows) -> list[FollowOwned]:
    """List all classes that follow, the newest first."""
    return [follow.owner_view() for follow in follows.all]


@router.get("/{follow}")
async def show_follow(follow: AFollow) -> FollowOwned:
    """Tell everything about a class."""
    return follow.owner_view()


@router.patch("/{follow}")
async def change_follow(follow: AFollow, body: FollowUpdate, follows: TheFollows, request: Request) -> FollowOwned:
    """Change what a class follows, or its limits."""
    await follows.change(follow, body, participant_of(request.scope))
    return follow.owner_view()


@router.delete("/{follow}", status_code=HTTPStatus.NO_CONTENT)
async def end_follow(follow: AFollow, follows: TheFollows) -> None:
    """Send the class home, and end the sessions of its own."""
    follows.end(follow)


@router.get("/{follow}/qr.svg", response_class=Response, responses={200: {"content": {"image/svg+xml": {}}}})
async def qr_code(follow: AFollow, link: Annotated[int, Query(ge=0)] = 0) -> Response:
    """Return a link for followers as a QR code."""
    links = follow.owner_view().links
    if link >= len(links):
        raise NotFoundError(f"The class has {len(links)} links, counted from 0.")
    picture = io.BytesIO()
    segno.make(links[link].address, micro=False, error="m").save(
        picture, kind="svg", scale=8, xmldecl=False, light="#fff"
    )
    return Response(picture.getvalue(), media_type="image/svg+xml", headers={"Cache-Control": "no-store"})


@router.post("/{follow}/figure", response_class=Response, responses={200: {"model": FigurePublic}})
async def show_figure(follow: AFollow, body: FigureRequest, lessons: TheLessons) -> Response:
    """Return what the lesson that is followed comes to at some parameters, and show it to the class."""
    if follow.content.lesson_id is None:
        raise ConflictError("The class follows no lesson.")
    lesson = await lessons.get(follow.content.lesson_id)
    figure = await lessons.figure(lesson, body)
    follow.show_figure(lesson.id, figure)
    return Response(figure, media_type="application/json")


@router.put(
    "/{follow}/poll",
    responses={202: {"model": ComputingPublic, "description": "The run that the answers come from is still computed"}},
)
async def ask(
    follow: AFollow, body: PollCreate, follows: TheFollows, request: Request, response: Response
) -> FollowOwned | ComputingPublic:
    """Ask the class something, in place of what it was asked before, or show again what it answered."""
    computing = await follows.ask(follow, body, participant_of(request.scope))
    if computing is not None:
        response.status_code = HTTPStatus.ACCEPTED
        return computing
    return follow.owner_view()


@router.post("/{follow}/poll/reveal")
async def reveal(follow: AFollow, follows: TheFollows) -> FollowOwned:
    """Show everybody how many gave which answer; answering is closed."""
    await follows.reveal(follow)
    return follow.owner_view()


@router.delete("/{follow}/poll", status_code=HTTPStatus.NO_CONTENT)
async def close_poll(follow: AFollow, follows: TheFollows) -> None:
    """Ask nothing more; what was revealed is kept, and what was not is forgotten."""
    await follows.close_poll(follow)


@router.websocket("/{follow}/stream")
async def stream(websocket: WebSocket, follow: str, follows: TheFollows) -> None:
    """Greet a lecturer's page, then tell it who follows and how many have answered."""
    await websocket.accept()
    try:
        found = follows.get(follow)
    except NotFoundError as error:
        await websocket.close(GONE, str(error))
        return
    with found.listen_as_lecturer() as listener:
        await converse(websocket, listener, FAREWELL)
