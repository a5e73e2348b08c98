"""Dependencies of the handlers for classes and lessons."""

from typing import Annotated

from fastapi import Depends, Path
from starlette.requests import HTTPConnection

from pftrack_server.core.errors import NotFoundError
from pftrack_server.core.requests import service
from pftrack_server.follow.follow import Follow
from pftrack_server.follow.follows import Follows
from pftrack_server.follow.participant import Participant, participant_of
from pftrack_server.lectures.service import Lectures
from pftrack_server.lessons.service import Lessons

TheLectures = Annotated[Lectures, service(Lectures)]
TheLessons = Annotated[Lessons, service(Lessons)]
TheFollows = Annotated[Follows, service(Follows)]


def _follow(follow: Annotated[str, Path(max_length=64)], follows: TheFollows) -> Follow:
    return follows.get(follow)


def _follower(connection: HTTPConnection) -> Participant:
    participant = participant_of(connection.scope)
    if participant is None:
        raise NotFoundError("This address belongs to followers; open the link of the class.")
    return participant


AFollow = Annotated[Follow, Depends(_follow)]
AFollower = Annotated[Participant, Depends(_follower)]
