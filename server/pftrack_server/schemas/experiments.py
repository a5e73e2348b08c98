"""Experiments: the list of them, and each in detail."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.marks import Editor
from pftrack.core.model.parameters import Declaration, Value
from pftrack.core.model.preset import Tour


class PresetPublic(BaseModel):
    """A named starting point."""

    name: str
    title: str
    tracker: str
    parameters: dict[str, Value]
    seed: int
    about: list[str] = Field(description="Parameters that it is about: those that it sets, and further ones")
    watch: str = Field(description="What to look at when it is opened")
    tour: Tour | None = Field(description="What a guided tour says of it; null if it is not made for one")


class CitationPublic(BaseModel):
    """A place in a publication, as it can be cited."""

    key: str = Field(description="Name of the publication in BibTeX")
    short: str = Field(description="Family names, year and place")
    text: str = Field(description="The whole as plain text")
    bibtex: str


class ExperimentPublic(BaseModel):
    """An experiment as the start page shows it."""

    id: str
    title: str
    clip_title: str = Field(description="What it is called where a recording is tracked")
    family: str = Field(description="What kind of thing it estimates; those of one family stand together")
    question: str
    references: list[CitationPublic] = Field(description="What it comes from, the main one first")
    description: str
    accepts_video: bool
    footage: list[str] = Field(description="Kinds of recording that it takes, as an upload's kind names them")
    target: str = Field(description="What is tracked, one word")
    marks: list[Editor] = Field(description="Kinds of mark that it takes in a recording, the one to offer first")
    unmarked: list[str] = Field(description="Kinds of recording in which the target need not be marked all the same")
    finds: str | None = Field(
        description="Kind of mark that it finds by itself; null if a person has to mark the target"
    )
    hints: list[str] = Field(description="Kinds of mark by which a person may show it where to find the target")
    suits: bool = Field(description="Whether it can tell before tracking how suitable a target is")
    advice: str = Field(description="What a person who marks the target should know")
    truth_columns: list[str] = Field(description="What a table of truth for a recording has; empty if there is none")
    default_tracker: str
    frames: int
    trackers: list[dict[str, str]]
    presets: list[PresetPublic]
    thumbnail: str


class ExperimentDetail(ExperimentPublic):
    """An experiment with everything that can be turned."""

    declarations: list[Declaration]
    layers: list[Layer]
    worlds: list[World]
    parameter_schema: dict[str, Any] = Field(serialization_alias="schema")
    loss_trackers: list[str] = Field(description="Trackers that can tell how probable it is that the target is lost")


class PluginPublic(BaseModel):
    """An experiment of another package than pftrack."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    package: str
    problem: str = Field(description="Why it cannot be used, one sentence; empty if it can")
