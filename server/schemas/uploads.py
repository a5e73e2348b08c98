"""Uploads: recordings, what was found in them, and what is known of them."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["SightingPublic", "TruthPublic", "UploadPublic"]


class UploadPublic(BaseModel):
    """An upload and what was found in it."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    name: str
    kind: str
    frames: int
    width: int
    height: int
    frame_rate_hz: float
    duration_s: float
    sha256: str
    warnings: list[str]
    size_bytes: int
    created: str


class SightingPublic(BaseModel):
    """The result of a search for a target in an upload.

    As long as there is no mark and `looked` is less than `of`, one may go on looking.
    """

    frame: int = Field(description="Where it was found, or the last frame that was looked into")
    mark: dict[str, Any] | None = Field(description="The target, of the kind that is found; null if it was not found")
    placed: list[str] = Field(description="Handles of the mark that a model has placed rather than the picture shown")
    remarks: list[str] = Field(description="What to look at, or why nothing was found")
    looked: int = Field(description="How many frames were looked into")
    of: int = Field(description="How many frames there are to look into")


class TruthPublic(BaseModel):
    """Summary of the truth that is known of an upload."""

    frames: int = Field(description="How many frames there is truth of")
    first: int
    last: int
    warnings: list[str]
