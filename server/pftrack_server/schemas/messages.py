"""Messages: the one typed, versioned vocabulary of a session's stream.

What is sent to the page is built and encoded once for all listeners. `hello` carries the complete state, so a
listener that lost messages is simply greeted again.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema

from pftrack_server.schemas.controls import ControlPublic
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.panel import SPEEDS
from pftrack_server.schemas.snapshot import SessionSnapshot
from pftrack_server.schemas.stream import Message


class SessionPublic(SessionDescription, SessionSnapshot):
    """A session as everybody outside sees it: what is fixed of it, what moves, and where it is found."""

    id: str
    speeds: tuple[float, ...] = SPEEDS
    controls: list[ControlPublic]
    sweep: str | None
    upload: str | None
    created: str
    page: str
    thumbnail: str
    viewer: str


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    session: SessionPublic
    diagnostics: dict[str, list[Any]]


class Changes(Message):
    """What has changed of all that moves, and the frames computed; the other fields of the session are as they were."""

    type: Literal["changes"] = "changes"
    session: Annotated[dict[str, Any], WithJsonSchema({"type": "object", "partial": SessionSnapshot.__name__})]
    rows: list[dict[str, Any]] = Field([], description="Diagnostics of frames of the branch that is active then")


class Refused(Message):
    """A change that came through the scene's panel was refused."""

    type: Literal["refused"] = "refused"
    message: str
    field: str | None = None
    bound: str | None = None
    value: Any = None
