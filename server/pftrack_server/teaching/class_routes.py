"""Routes of classes: those of lecturers, those of followers, and the stored answers."""

import io
from http import HTTPStatus
from typing import Annotated

import segno
from fastapi import APIRouter, Depends, Query, Request, WebSocket
from starlette.requests import HTTPConnection
from starlette.responses import Response

from pftrack.core.refusal import ConflictError
from pftrack_server.core.base_path import address_of
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import AName, service
from pftrack_server.sessions.duplex import converse
from pftrack_server.store.database import PollRow
from pftrack_server.store.store import AStore
from pftrack_server.teaching import messages
from pftrack_server.teaching.follow import Follow, Participant, participant_of
from pftrack_server.teaching.follows import Follows
from pftrack_server.teaching.lessons import Lessons
from pftrack_server.teaching.polls import polls_csv

router = APIRouter(tags=["follows"])

CSV = "text/csv"
TheFollows = Annotated[Follows, service(Follows)]
TheLessons = Annotated[Lessons, service(Lessons)]
FAREWELL = "The class has ended."
OfLecture = Annotated[str | None, Query(max_length=64, description="Only polls of this lecture")]


def _follow(follow: AName, follows: TheFollows) -> Follow:
    return follows.get(follow)


def follower(connection: HTTPConnection) -> Participant:
    """Return the follower who makes the request."""
    participant = participant_of(connection.scope)
    if participant is None:
        raise not_found("This address belongs to followers; open the link of the class.")
    return participant


AFollow = Annotated[Follow, Depends(_follow)]
AFollower = Annotated[Participant, Depends(follower)]


@router.post("/follows", status_code=HTTPStatus.CREATED)
async def begin_follow(body: messages.FollowCreate, follows: TheFollows, request: Request) -> messages.FollowOwned:
    """Let a class follow up to four sessions, a lesson, or both."""
    origin = request.headers.get("origin") or f"{request.url.scheme}://{request.url.netloc}"
    follow = await follows.begin(body, origin + address_of(request.scope).removesuffix("/"))
    return follow.owner_view()


@router.get("/follows")
async def list_follows(follows: TheFollows) -> list[messages.FollowOwned]:
    """List all classes, newest first."""
    return [follow.owner_view() for follow in follows.all]


@router.get("/follows/{follow}")
async def show_follow(follow: AFollow) -> messages.FollowOwned:
    """Return the complete state of a class."""
    return follow.owner_view()


@router.patch("/follows/{follow}")
async def change_follow(
    follow: AFollow, body: messages.FollowUpdate, follows: TheFollows, request: Request
) -> messages.FollowOwned:
    """Change what a class follows, or its limits."""
    await follows.change(follow, body, participant_of(request.scope))
    return follow.owner_view()


@router.delete("/follows/{follow}", status_code=HTTPStatus.NO_CONTENT)
async def end_follow(follow: AFollow, follows: TheFollows) -> None:
    """End a class and its followers' own sessions."""
    follows.end(follow)


@router.get("/follows/{follow}/qr.svg", response_class=Response, responses={200: {"content": {"image/svg+xml": {}}}})
async def qr_code(follow: AFollow, link: Annotated[int, Query(ge=0)] = 0) -> Response:
    """Return a link for followers as a QR code."""
    links = follow.owner_view().links
    if link >= len(links):
        raise not_found(f"The class has {len(links)} links, counted from 0.")
    picture = io.BytesIO()
    segno.make(links[link].address, micro=False, error="m").save(
        picture, kind="svg", scale=8, xmldecl=False, light="#fff"
    )
    return Response(picture.getvalue(), media_type="image/svg+xml", headers={"Cache-Control": "no-store"})


@router.post("/follows/{follow}/figure", response_class=Response, responses={200: {"model": messages.FigurePublic}})
async def show_figure(follow: AFollow, body: messages.FigureRequest, lessons: TheLessons) -> Response:
    """Compute the followed lesson's figure at some parameters, and show it to the class."""
    if follow.content.lesson_id is None:
        raise ConflictError("The class follows no lesson.")
    lesson = await lessons.get(follow.content.lesson_id)
    figure = await lessons.figure(lesson, body)
    follow.show_figure(lesson.id, figure)
    return Response(figure, media_type="application/json")


@router.put(
    "/follows/{follow}/poll",
    responses={
        202: {"model": messages.ComputingPublic, "description": "The run behind the answers is still being computed"}
    },
)
async def ask(
    follow: AFollow, body: messages.PollCreate, follows: TheFollows, request: Request, response: Response
) -> messages.FollowOwned | messages.ComputingPublic:
    """Ask the class a question in place of the one before, or show stored answers again."""
    computing = await follows.ask(follow, body, participant_of(request.scope))
    if computing is not None:
        response.status_code = HTTPStatus.ACCEPTED
        return computing
    return follow.owner_view()


@router.post("/follows/{follow}/poll/reveal")
async def reveal(follow: AFollow, follows: TheFollows) -> messages.FollowOwned:
    """Show everybody the counts of the answers; answering is closed."""
    await follows.reveal(follow)
    return follow.owner_view()


@router.delete("/follows/{follow}/poll", status_code=HTTPStatus.NO_CONTENT)
async def close_poll(follow: AFollow, follows: TheFollows) -> None:
    """Close the poll; revealed answers are kept, others are deleted."""
    await follows.close_poll(follow)


@router.websocket("/follows/{follow}/stream")
async def lead(websocket: WebSocket, follow: AFollow) -> None:
    """Send a lecturer's page the state, then every change of followers and answers."""
    await websocket.accept()
    with follow.listen_as_lecturer() as listener:
        await converse(websocket, listener, FAREWELL)


# Requests of followers: these addresses exist only behind the link of a class.


@router.get("/follow")
async def show(participant: AFollower) -> messages.FollowPublic:
    """Return a follower's view: content, question and the follower's own answer and copy."""
    return participant.follow.view(participant.seat)


@router.put("/follow/vote")
async def vote(participant: AFollower, body: messages.Vote) -> messages.Vote:
    """Answer the open question, in place of an earlier answer."""
    return participant.follow.vote(participant.seat, body)


@router.post("/follow/fork", status_code=HTTPStatus.CREATED)
async def fork(participant: AFollower, body: messages.ForkCreate, follows: TheFollows) -> messages.ForkPublic:
    """Start a follower's own copy of a session, or let the follower change the lesson's figure."""
    return participant.follow.fork_view(await follows.fork(participant, body))


@router.delete("/follow/fork", status_code=HTTPStatus.NO_CONTENT)
async def give_back(participant: AFollower, follows: TheFollows) -> None:
    """End the follower's copy, which frees its place."""
    follows.end_fork(participant)


@router.websocket("/follow/stream")
async def follow(websocket: WebSocket, participant: AFollower) -> None:
    """Send a follower the state, then every change."""
    await websocket.accept()
    with participant.follow.listen(participant.seat) as listener:
        await converse(websocket, listener, FAREWELL)


@router.get("/polls")
async def list_polls(follows: TheFollows, lecture: OfLecture = None) -> list[messages.PollKept]:
    """List the answers of classes, newest first; polls that are not revealed yet are left out."""
    return await follows.kept_polls(lecture)


@router.get("/polls/answers.csv", response_class=Response, responses={200: {"content": {CSV: {}}}})
async def polls_as_csv(follows: TheFollows, lecture: OfLecture = None) -> Response:
    """Return the answers of classes as CSV, one row per answer."""
    text = polls_csv(await follows.kept_polls(lecture))
    headers = {"Content-Disposition": 'attachment; filename="polls.csv"', "Cache-Control": "no-store"}
    return Response(text, media_type=CSV, headers=headers)


@router.delete("/polls/{poll}", status_code=HTTPStatus.NO_CONTENT)
def remove_poll(poll: AName, store: AStore) -> None:
    """Delete a poll and its answers."""
    store.discard(PollRow, poll)
