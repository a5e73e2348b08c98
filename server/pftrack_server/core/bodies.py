"""The base of request bodies, and the types that they share."""

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import NOT_BOOLEAN


def printable(text: str) -> str:
    """Return a text as one line of what can be seen.

    Line ends, control characters and marks that turn the direction of all that follows are left out, since titles stand
    in the middle of lines on pages, in names of files and in logs.
    """
    return " ".join("".join(each for each in text if each.isprintable() or each.isspace()).split())


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


def fields_of(model: type[BaseModel], *sources: object) -> dict[str, Any]:
    """Return the fields of a model that objects have as attributes of the same names; the last one counts.

    Such a model has no defaults, so that it fails where an attribute was renamed.
    """
    return {name: getattr(it, name) for it in sources for name in model.model_fields if hasattr(it, name)}


class RequestBody(BaseModel):
    """Base of what a client sends: closed to unknown names."""

    model_config = ConfigDict(extra="forbid")
