"""Sessions: how one begins, and what is said of it."""

from typing import Any

from pydantic import BaseModel, Field

from pftrack.core.model.recipe import Recipe
from pftrack_server.schemas.body import FrameNumber, RequestBody, Title


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


class BookmarkCreate(RequestBody):
    """A bookmark on the frame that is shown."""

    note: str = Field("", max_length=500)


class Columns(BaseModel):
    """The diagnostics of a branch, a list a column."""

    branch: str
    columns: dict[str, list[Any]]
