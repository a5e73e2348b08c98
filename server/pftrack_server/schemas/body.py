"""The base of request bodies, and the types that they share."""

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack_server.titles import printable


def _not_blank(title: str) -> str:
    if not title:
        raise ValueError("a title needs a character that can be seen")
    return title


FrameNumber = Annotated[int, Field(ge=0, le=10_000_000), NOT_BOOLEAN]
Name = Annotated[str, Field(max_length=64)]
Values = dict[Name, Any]
Title = Annotated[str, Field(max_length=200), AfterValidator(printable)]
"""What people call something; an empty one leaves that to the server."""
GivenTitle = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(printable), AfterValidator(_not_blank)]
"""The same, where there has to be one."""


class RequestBody(BaseModel):
    """Base of what a client sends: closed to unknown names."""

    model_config = ConfigDict(extra="forbid")
