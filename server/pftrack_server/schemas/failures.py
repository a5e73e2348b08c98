"""Failures, as the gallery of them shows them."""

from typing import Any

from pydantic import BaseModel, Field

from pftrack.model.parameters import Value
from pftrack.model.recipe import Recipe

__all__ = ["DifferencePublic", "FailureNeighbour", "FailurePublic", "FailureResult", "FailureRun"]


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
    finding: str = Field(description="What was measured, a sentence with its numbers")
    numbers: dict[str, Any]
    why: str = Field(description="Why its target was lost, told from its numbers alone, a sentence")


class FailureResult(BaseModel):
    """Both runs of a failure, computed on this server."""

    unit: str
    failing: FailureRun
    cured: FailureRun
