"""The base of request bodies, and the types that they share."""

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import NOT_BOOLEAN


def printable(text: str) -> str:
    """Return a text as one line of visible characters.

    Line ends, control characters and marks that change the direction of writing are removed, since titles appear within
    lines of pages, in file names and in logs.
    """
    return " ".join("".join(each for each in text if each.isprintable() or each.isspace()).split())


def _not_blank(title: str) -> str:
    if not title:
        raise ValueError("a title needs a visible character")
    return title


FrameNumber = Annotated[int, Field(ge=0, le=10_000_000), NOT_BOOLEAN]

Name = Annotated[str, Field(max_length=64)]

Values = dict[Name, Any]

Title = Annotated[str, Field(max_length=200), AfterValidator(printable)]
"""A title given by a person; if it is empty, the server chooses one."""

GivenTitle = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(printable), AfterValidator(_not_blank)]
"""A title that must not be blank."""


def fields_of(model: type[BaseModel], *sources: object) -> dict[str, Any]:
    """Return a model's fields, read from attributes of the same names; the last object that has one wins.

    Such a model has no defaults, so it fails if an attribute was renamed.
    """
    return {name: getattr(it, name) for it in sources for name in model.model_fields if hasattr(it, name)}


class RequestBody(BaseModel):
    """Base of what a client sends: closed to unknown names."""

    model_config = ConfigDict(extra="forbid")
