"""Messages: the one typed, versioned vocabulary of a session's stream.

What is sent to the page is built and encoded once for all listeners. `hello` carries the complete state, so a
listener that lost messages is simply greeted again.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from pftrack.model.parameters import Value
from pftrack.model.recipe import Recipe
from pftrack_server.schemas.controls import ControlPublic
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.panel import SPEEDS
from pftrack_server.schemas.spec import Bookmark
from pftrack_server.schemas.stream import Message

__all__ = [
    "Bookmarks",
    "BranchPublic",
    "Branches",
    "Frame",
    "Frames",
    "Hello",
    "Measures",
    "Painted",
    "Parameters",
    "Phase",
    "Position",
    "Refused",
    "SessionNews",
    "SessionPublic",
    "ThresholdPublic",
    "ThresholdStep",
    "painted",
]

Phase = Literal["starting", "ready", "playing", "ended", "suspended", "crashed"]


class ChangePublic(BaseModel):
    """A change of parameters on the timeline, with what was in force before it, unless the run begins with it."""

    frame: int
    values: dict[str, Value]
    before: dict[str, Value] = {}


class ThresholdStep(BaseModel):
    """From this frame on a threshold has this value; null while no tracker reads it."""

    frame: int
    value: float | None


class ThresholdPublic(BaseModel):
    """What the tracker compares something with, as it changed in the course of the run."""

    name: str
    of: str
    steps: list[ThresholdStep]


class BranchPublic(BaseModel):
    """A branch as the page lists it."""

    id: str
    title: str
    parent: str | None
    frame: int
    tracker: str
    colour: str


class SessionPublic(SessionDescription):
    """A session as everybody outside sees it."""

    id: str
    recipe: Recipe
    measured: dict[str, float] = Field({}, description="Measures of the active branch so far, by name")
    tracker: str
    position: int
    computed: int
    goal: int | None = Field(None, description="Frame to which it is computing, while it is; a pause stops it")
    playing: bool
    speed: float
    speeds: tuple[float, ...] = SPEEDS
    state: Phase
    message: str | None = None
    remark: str | None = Field(None, description="What a person should know of it, a sentence")
    parameters: dict[str, Value]
    controls: list[ControlPublic]
    timeline: list[ChangePublic]
    thresholds: list[ThresholdPublic]
    branch: str
    branches: list[BranchPublic]
    bookmarks: list[Bookmark]
    sweep: str | None = None
    upload: str | None = None
    created: str
    page: str
    viewer: str


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    session: SessionPublic
    diagnostics: dict[str, list[Any]]


class Frame(Message):
    """A frame was computed. While the run plays, that frame is also the one that is shown, without a `Position`."""

    type: Literal["frame"] = "frame"
    branch: str
    diagnostics: dict[str, Any]


class Frames(Message):
    """Several frames were computed since the last message; while the run plays, the last of them is shown."""

    type: Literal["frames"] = "frames"
    branch: str
    rows: list[dict[str, Any]]


class Position(Message):
    """Another frame is shown, or the transport changed."""

    type: Literal["position"] = "position"
    branch: str
    frame: int
    computed: int
    goal: int | None
    playing: bool
    speed: float


class Measures(Message):
    """The measures of a branch so far, by name; those that it has no truth for are missing."""

    type: Literal["measures"] = "measures"
    branch: str
    values: dict[str, float]


class Parameters(Message):
    """The values in force and how they came about; `values` are those that changed, from `frame` on."""

    type: Literal["parameters"] = "parameters"
    branch: str
    frame: int
    parameters: dict[str, Value]
    recipe: Recipe
    tracker: str
    values: dict[str, Value]
    timeline: list[ChangePublic]
    thresholds: list[ThresholdPublic]


class Branches(Message):
    """A branch was made or chosen."""

    type: Literal["branches"] = "branches"
    branch: str
    branches: list[BranchPublic]


class Bookmarks(Message):
    """The bookmarks changed."""

    type: Literal["bookmarks"] = "bookmarks"
    bookmarks: list[Bookmark]


class SessionNews(Message):
    """The session is in another state."""

    type: Literal["session"] = "session"
    state: Phase
    message: str | None = None


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


def painted(text: str) -> Painted:
    """Read what a page said about drawings.

    Raises:
        ValueError: It is no such message.
    """
    return PAINTED.validate_json(text)
