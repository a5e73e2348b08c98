"""The lines that compute something again."""

from pydantic import BaseModel, ConfigDict, Field

from pftrack_server.schemas.body import RequestBody
from pftrack_server.schemas.comparisons import ComparedRun

__all__ = ["SourceCodePublic", "SourceCodeRequest"]


class SourceCodeRequest(RequestBody):
    """Of which runs: of one, or of several that are compared."""

    runs: list[ComparedRun] = Field(min_length=1, max_length=4)
    frames: int | None = Field(None, ge=1, le=10_000_000, description="How many frames of each; all if left out")


class SourceCodePublic(BaseModel):
    """The same computation in two forms."""

    model_config = ConfigDict(from_attributes=True)

    python: str
    command: str
