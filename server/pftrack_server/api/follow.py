"""What followers ask for beside what everybody may look at: these addresses exist behind the link of a class alone."""

from http import HTTPStatus

from fastapi import APIRouter, WebSocket

from pftrack_server.api.dependencies import AFollower, TheFollows
from pftrack_server.schemas.follows import FollowPublic, ForkCreate, ForkPublic, VotePublic, VoteRequest
from pftrack_server.sessions.duplex import converse

router = APIRouter(prefix="/follow", tags=["follows"])

FAREWELL = "The class has ended."


@router.get("")
async def show(participant: AFollower) -> FollowPublic:
    """Tell a follower what the class follows and is asked, and what is the follower's own."""
    return participant.follow.view(participant.seat)


@router.put("/vote")
async def vote(participant: AFollower, body: VoteRequest) -> VotePublic:
    """Answer what the class is asked, in place of an earlier answer."""
    return participant.follow.vote(participant.seat, body.poll, body.answer)


@router.post("/fork", status_code=HTTPStatus.CREATED)
async def fork(participant: AFollower, body: ForkCreate, follows: TheFollows) -> ForkPublic:
    """Begin a session of the follower's own where one of the class's stands, or let the follower turn the figure."""
    return participant.follow.fork_view(await follows.fork(participant, body))


@router.delete("/fork", status_code=HTTPStatus.NO_CONTENT)
async def give_back(participant: AFollower, follows: TheFollows) -> None:
    """End what the follower tries, so that somebody else can."""
    follows.end_fork(participant)


@router.websocket("/stream")
async def stream(websocket: WebSocket, participant: AFollower) -> None:
    """Greet a follower, then tell of all that changes."""
    await websocket.accept()
    with participant.follow.listen(participant.seat) as listener:
        await converse(websocket, listener, FAREWELL)
