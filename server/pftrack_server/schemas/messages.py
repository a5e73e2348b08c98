"""Messages: the one typed, versioned vocabulary of a session's stream.

What is sent to the page is built and encoded once for all listeners. `hello` carries the complete state, so a
listener that lost messages is simply greeted again.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, WithJsonSchema

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


class Frame(Message):
    """A frame was computed. While the run plays it is also the one that is shown, and no `Changes` says so."""

    type: Literal["frame"] = "frame"
    branch: str
    diagnostics: dict[str, Any]


class Frames(Message):
    """Several frames were computed since the last message; while the run plays, the last of them is shown."""

    type: Literal["frames"] = "frames"
    branch: str
    rows: list[dict[str, Any]]


class Changes(Message):
    """What has changed of all that moves; the other fields of the session are as they were."""

    type: Literal["changes"] = "changes"
    session: Annotated[dict[str, Any], WithJsonSchema({"type": "object", "partial": SessionSnapshot.__name__})]


class Refused(Message):
    """A change that came through the scene's panel was refused."""

    type: Literal["refused"] = "refused"
    message: str
    field: str | None = None
    bound: str | None = None
    value: Any = None


class Painted(BaseModel):
    """The only thing that a page says where it receives drawings: how many it has painted or left out since it came."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["painted"]
    count: Annotated[int, Field(ge=0)]


PAINTED: TypeAdapter[Painted] = TypeAdapter(Painted)


def parse_painted(text: str) -> Painted:
    """Read what a page said about drawings.

    Raises:
        ValueError: It is no such message.
    """
    return PAINTED.validate_json(text)
