"""The base of request bodies, and the types that they share."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["FrameNumber", "Name", "RequestBody", "Values"]

FrameNumber = Annotated[int, Field(ge=0, le=10_000_000)]
Name = Annotated[str, Field(max_length=64)]
Values = dict[Name, Any]


class RequestBody(BaseModel):
    """Base of what a client sends: closed to unknown names."""

    model_config = ConfigDict(extra="forbid")
