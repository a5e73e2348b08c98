"""Failures, as the gallery of them shows them."""

from typing import Any

from pydantic import BaseModel, Field

from pftrack.core.model.parameters import Value
from pftrack.core.model.preset import CauseId
from pftrack.core.model.recipe import Recipe


class DifferencePublic(BaseModel):
    """What the cure changes."""

    title: str
    unit: str
    failing: Value
    cured: Value


class FailureNeighbour(BaseModel):
    """The failure before another in the gallery, or the one after it."""

    id: str
    title: str


class FailurePublic(BaseModel):
    """A named failure of an experiment's trackers, and its cure."""

    id: str
    number: int = Field(description="Its place in the gallery, which stands for its id in addresses")
    title: str
    kind: str
    kind_title: str
    cause: CauseId = Field(description="What the diagnosis of its run comes to first")
    experiment: str
    experiment_title: str
    diagnosis: str = Field(description="What goes wrong and why")
    cure: str = Field(description="What helps, and why")
    frame: int = Field(description="The one before it happens")
    differences: list[DifferencePublic] = Field(description="What the cure changes at frame 0")
    failing: Recipe
    cured: Recipe
    page: str
    previous: FailureNeighbour | None
    next: FailureNeighbour | None


class FailureRun(BaseModel):
    """What came of one of the two runs."""

    errors: list[float | None] = Field(description="Of each frame; null where the truth is unknown")
    lost: list[bool] = Field(description="Whether the target is lost in a frame")
    shown: bool = Field(description="Whether the run fails in this way")
    finding: str = Field(description="What was found in its numbers, a sentence")
    numbers: dict[str, Any] = Field(description="What the sentence is said from; empty where it does not fail so")
    why: str = Field(description="Why its target was lost, told from its numbers alone, a sentence")


class MeasuredPublic(BaseModel):
    """What shows a failure, in its run and in the cured one; null where a run has no such number."""

    title: str
    unit: str
    failing: float | None
    cured: float | None


class FailureResult(BaseModel):
    """Both runs of a failure, computed on this server."""

    unit: str
    frame: int | None = Field(description="In which the target is lost; null if it is not lost here")
    measured: list[MeasuredPublic] = Field(description="From that frame on: medians, and shares of frames in %")
    failing: FailureRun
    cured: FailureRun
