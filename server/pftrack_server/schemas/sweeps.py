"""Sweeps: what one is to compute, and how one of its runs is opened."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.model.recipe import Footage, Seed
from pftrack_server.schemas.body import GivenTitle, Name, RequestBody

Number = Annotated[float, Field(allow_inf_nan=False), NOT_BOOLEAN]


class SweepAxis(RequestBody):
    """A parameter that is varied: from `start` to `stop` by `step`, both ends included, or over a list of values."""

    name: Name
    start: Number | None = None
    stop: Number | None = None
    step: Number | None = None
    values: list[Any] | None = Field(None, max_length=10_000)

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        given = [self.start, self.stop, self.step]
        if (self.values is None) == all(value is None for value in given) or (
            self.values is None and any(value is None for value in given)
        ):
            raise ValueError("an axis has either start, stop and step, or a list of values")
        return self


class SweepCreate(RequestBody):
    """A new sweep: an experiment over a grid of conditions."""

    experiment: Name
    title: GivenTitle | None = Field(None, description="Name on the screen; made up from the plan if it is not given.")
    axes: list[SweepAxis] = Field(
        max_length=8,
        description="What is varied; the axes multiply. On a recording there may be none: other seeds alone.",
    )
    trackers: list[Name] = Field([], max_length=64, description="Trackers; all of them meet the same seeds.")
    trials: Annotated[int, Field(ge=1, le=1_000_000), NOT_BOOLEAN] = 10
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(None, description="Length of a run.")
    seed: Seed = 0
    loss_probability: bool = Field(
        False, description="Whether how probable it is that the target is lost is measured as well."
    )
    parameters: dict[Name, Any] = Field({}, description="Parameters that differ from the defaults in every run.")
    footage: Footage | None = Field(
        None, description="The recording on which all runs are, as a recipe has it; the simulated scene if not given."
    )
    upload: Name | None = Field(None, description="Name of the upload that the footage is; its hash does as well.")


class EstimateRequest(SweepCreate):
    """A sweep of which somebody wants to know the size before it starts."""

    measure: bool = Field(True, description="Whether to measure the time on a few runs, which takes some seconds.")


class OpenRequest(RequestBody):
    """With which method to open a run; with its own if none is named."""

    tracker: Name | None = None
