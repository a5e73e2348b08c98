"""Filters that the server was started with."""

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import LONGEST_FILE
from pftrack_server.schemas.body import RequestBody


class HintPublic(BaseModel):
    """What a function of a filter's file is for."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    arguments: list[str] = Field(description="Those that it may name")
    returns: str
    about: str


class ComponentPublic(BaseModel):
    """One column of the states."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    unit: str


class FilterPublic(BaseModel):
    """A file with a filter of the server's owner."""

    name: str = Field(description="Of its tracker")
    file: str
    experiment: str = Field(description="Whose target it follows")
    digest: str = Field(description="Hash of its text, by which recipes name it")
    text: str
    editable: bool = Field(description="Whether pages may write it")
    hints: list[HintPublic]
    components: list[ComponentPublic] = Field(description="Columns of the states with the usual parameters")
    observed: str = Field(description="What the functions find in a frame")


class FilterUpdate(RequestBody):
    """A new text of a file."""

    text: str = Field(min_length=1, max_length=LONGEST_FILE)
    before: str = Field(max_length=100, description="Hash of the text that it takes the place of")
