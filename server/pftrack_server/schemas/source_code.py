"""The lines that compute something again."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack_server.schemas.body import RequestBody
from pftrack_server.schemas.jobs import ComparedRun


class SourceCodeRequest(RequestBody):
    """Of which runs: of one, or of several that are compared."""

    runs: list[ComparedRun] = Field(min_length=1, max_length=4)
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(
        None, description="How many frames of each; all if left out"
    )


class SourceCodePublic(BaseModel):
    """The same computation in two forms."""

    model_config = ConfigDict(from_attributes=True)

    python: str
    command: str
