"""Sessions: how one begins, what it can be asked to do, and what it answers."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field

from pftrack.core.model.parameters import NOT_BOOLEAN, Value
from pftrack.core.model.recipe import Recipe, Seed
from pftrack_server.schemas.body import FrameNumber, RequestBody, Title, Values

SLOWEST = 0.1


def _speed(value: float) -> float:
    if value != 0 and value < SLOWEST:
        raise ValueError("Input should be 0 (as fast as possible) or between 0.1 and 10")
    return value


class SessionCreate(RequestBody):
    """A new session."""

    recipe: Recipe
    upload: str | None = Field(
        None, max_length=64, description="Name of the upload that the recipe's footage is; its hash does as well"
    )
    position: FrameNumber = 0
    id: str | None = Field(
        None,
        pattern=r"^[0-9a-f]{16}$",
        description="Name chosen by the client: by it, it can end a session whose answer it has not seen",
    )


class SessionUpdate(RequestBody):
    """What people call a session."""

    name: Title = Field(description="As it is to be called; by its clip or preset again if empty")


class TransportUpdate(RequestBody):
    """A command of the transport."""

    action: Literal["play", "pause", "step", "back", "seek", "before_loss", "speed", "stop_at", "restart"]
    frame: FrameNumber | None = None
    speed: Annotated[float, Field(le=10, allow_inf_nan=False), NOT_BOOLEAN, AfterValidator(_speed)] | None = None
    probability: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), NOT_BOOLEAN] | None = Field(
        None,
        description="With stop_at: that the target is lost, from which on it stops playing; never if left out. On a "
        "recording any value stops it where a mark or the tracker itself says that the target is lost",
    )
    seed: Seed | None = Field(None, description="With restart: the seed to start again with")


class BranchCreate(RequestBody):
    """A new branch: the frame at which it leaves the active one, and its changes."""

    frame: FrameNumber
    tracker: str | None = Field(None, max_length=64)
    parameters: Values = Field({})
    seed: Seed | None = Field(
        None, description="Of the tracker's random numbers from there on; the scene stays as it is"
    )
    title: Title | None = None


class BookmarkCreate(RequestBody):
    """A bookmark on the frame that is shown."""

    note: str = Field("", max_length=500)


class Changed(BaseModel):
    """The values in force after a change, and the frame from which they count."""

    parameters: dict[str, Value]
    tracker: str
    frame: int
    branch: str


class Columns(BaseModel):
    """The diagnostics of a branch, a list a column."""

    branch: str
    columns: dict[str, list[Any]]
