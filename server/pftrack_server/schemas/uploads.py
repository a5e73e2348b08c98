"""Uploads: recordings, what was found in them, and what is known of them."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.setup import Grade
from pftrack_server.schemas.body import RequestBody


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


class TableHead(RequestBody):
    """The beginning of a table whose columns have names of its own."""

    text: Annotated[str, Field(max_length=65_536, description="Its first lines")]


class ColumnMeaning(BaseModel):
    """What a column of a table of boxes may be."""

    name: str
    title: str


class TablePublic(BaseModel):
    """What a person has to see of a table to say what its columns are."""

    header: list[str] = Field(description="Names of its columns")
    rows: list[list[str]] = Field(description="Its first lines")
    guess: dict[str, int] = Field(description="Place of the column of each meaning, as far as its name tells")
    meanings: list[ColumnMeaning]


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


class SuitabilityPublic(BaseModel):
    """Whether a target can be followed, looked at before it is tracked."""

    value: float = Field(description="0..1, the higher the better")
    grade: Grade = Field(description="The same in words")
    remark: str = Field(description="What was found, a sentence")
    advice: list[str] = Field(description="What would help, a sentence each")
    better: dict[str, Any] | None = Field(
        description="A mark of the same target that suits better; null if none is known"
    )
    picture: str | None = Field(
        description="The likelihood over the picture as a data address, from purple for 0 to yellow for its peak; null "
        "for a likelihood that is not one of places"
    )


class TruthPublic(BaseModel):
    """Summary of the truth that is known of an upload."""

    frames: int = Field(description="How many frames there is truth of")
    first: int
    last: int
    warnings: list[str]


class QueuePublic(BaseModel):
    """Where a request waits."""

    before: int = Field(description="How many come before it")
