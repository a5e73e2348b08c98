"""Saved runs."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from pftrack_server.schemas.body import GivenTitle, RequestBody, Title


class RunCreate(RequestBody):
    """Which session's active branch to save."""

    session: str = Field(max_length=64)
    title: Title | None = None


class RunUpdate(RequestBody):
    """What people call a saved run."""

    title: GivenTitle


class ImportPublic(BaseModel):
    """A run that was sent and is being computed, or what came of it."""

    id: str
    name: str = Field(description="Of the file that was sent")
    state: Literal["computing", "done", "failed"]
    done: int = Field(description="Frames computed")
    total: int = Field(description="Frames to compute; 0 until it has begun")
    run: str | None = Field(description="The saved run, once there is one")
    message: str | None = Field(description="Why it failed, if it did")


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
