"""Saved runs."""

from typing import Annotated, Any

from pydantic import BaseModel, Field

from server.schemas.body import RequestBody

__all__ = ["RunCreate", "RunPublic"]

Title = Annotated[str, Field(max_length=200)]


class RunCreate(RequestBody):
    """Which session's active branch to save."""

    session: str = Field(max_length=64)
    title: Title | None = None


class RunPublic(BaseModel):
    """A saved run."""

    id: str
    title: str
    experiment: str
    tracker: str
    seed: int
    frames: int
    created: str
    outcome: str
    summary: dict[str, Any]
    thumbnail: str
    page: str
