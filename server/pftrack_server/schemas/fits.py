"""Fits of numbers to what a run has seen."""

from typing import Literal

from pydantic import BaseModel, Field

from pftrack.analysis.fitting.found import MOST_NUMBERS, Method
from pftrack.core.model.parameters import Value
from pftrack_server.schemas.body import Name, RequestBody


class FitCreate(RequestBody):
    """What to fit."""

    numbers: list[Name] = Field(min_length=1, max_length=MOST_NUMBERS, description="Names of parameters of the tracker")


class FittedPublic(BaseModel):
    """A number that was fitted."""

    name: str
    title: str
    unit: str
    before: float
    after: float
    at_bound: bool = Field(description="Whether what was found is about a bound of the number")


class FitScorePublic(BaseModel):
    """What the frames of a half come to."""

    log_evidence: float = Field(description="Mean log evidence of a frame, nats")
    coverage: dict[str, float] = Field(description="How often a band held the truth, 0..1, by its percent")
    nees: float | None = Field(
        description="Mean squared error of a coordinate in its deviation: 1 if the tracker is as sure as it may be"
    )
    nis: float | None = Field(description="Mean squared innovation of a number in its deviation, likewise")
    nis_limits: tuple[float, float] | None = Field(description="Between which that of a right filter is in 95 %")


class FitHalfPublic(BaseModel):
    """One half of the run."""

    first: int
    last: int
    before: FitScorePublic
    after: FitScorePublic


class FitPublic(BaseModel):
    """What came of a fit."""

    tracker: str
    kept: bool = Field(description="Whether what was found is better on the second half, which was not used")
    verdict: str
    caution: str = Field(description="Why it may mislead; empty if nothing speaks against it")
    values: dict[str, Value] = Field(description="What was found, by name; empty if it is not kept")
    numbers: list[FittedPublic]
    halves: list[FitHalfPublic]
    gain: float = Field(description="Of the log evidence of a frame of the second half, nats")
    gain_error: float
    method: Method = Field(
        description="By expectation maximisation (em) where the model is linear, by search elsewhere"
    )
    rounds: int = Field(description="Steps of expectation maximisation, or settings that were tried")
    procedure: str = Field(description="How it was found, one sentence")
    runs: int
    seeds: int


class FitJobPublic(BaseModel):
    """A fit under way, or what came of it."""

    id: str
    state: Literal["fitting", "done", "failed"]
    done: int
    total: int
    message: str | None = Field(description="Why it failed, if it did")
    found: FitPublic | None
