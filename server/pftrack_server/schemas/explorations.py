"""Explorations: what else a session's run might have been, by changes one at a time or by other seeds alone."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, Field

from pftrack.analysis.counterfactuals.alternatives import Kind
from pftrack.analysis.counterfactuals.report import Verdict
from pftrack.analysis.other_seeds import Scene
from pftrack.core.model.parameters import NOT_BOOLEAN, Value
from pftrack_server.schemas.body import FrameNumber, RequestBody

LONGEST_S = 300.0
Share = Annotated[float | None, Field(ge=0, le=1)]


class ExplorationCreate(RequestBody):
    """What to find out of the active branch of a session."""

    kind: Literal["what-if", "ensemble"]
    frame: FrameNumber | None = Field(
        None, description="Of what-if, in the loss that is meant; the first that lasts if not given"
    )
    scene: Scene = Field("same", description="Of ensemble, whether each run sees what its own seed makes of the scene")
    after: str | None = Field(
        None,
        max_length=64,
        description="Of what-if, an exploration with whose findings this one goes on",
    )
    seconds: Annotated[float, Field(ge=1.0, le=LONGEST_S), NOT_BOOLEAN] = Field(
        20.0, description="After so long it ends with what it has found"
    )


class FindingPublic(BaseModel):
    """What came of one change; the first is none, with other seeds."""

    kind: Kind
    title: str
    values: dict[str, Value]
    parameter: str = Field(description="Name of the one parameter that is changed; empty if none is")
    holding: int
    runs: int
    share: Share = Field(description="Of the runs that hold")
    low: Share = Field(description="Lower end of its 95 % interval (Wilson)")
    high: Share
    step_ms: float = Field(description="Mean time of a step, ms")
    p_value: float | None = Field(description="Of McNemar's test against no change on the same seeds")
    corrected: float | None = Field(description="The same after Holm's correction for all changes that are tried")
    verdict: Verdict
    seed: int | None = Field(description="To look at: the first with which it holds, else the first that was tried")


class WhatIfPublic(BaseModel):
    """What would have saved a run, as far as it has been tried, the best first."""

    loss: int = Field(description="Frame in which the loss began")
    first_lost_frame: int | None = Field(description="The first of all in which the target is lost")
    begin: int = Field(description="Last frame that all runs have in common")
    end: int = Field(description="Last frame that was computed")
    judged: int = Field(description="In how many last frames a run must not have lost its target, to hold")
    planned: int = Field(description="Changes that are tried in all")
    trials: int = Field(description="Seeds that each is tried with in the end")
    is_complete: bool
    loss_sentence: str = Field(description="Which loss is meant")
    sentence: str
    progress: str = Field(description="With how many seeds the changes have been tried, in a sentence")
    correction: str = Field(description="What the p-values are, a sentence")
    caveat: str
    findings: list[FindingPublic]


class EnsemblePublic(BaseModel):
    """What runs of the same settings with other seeds do, frame by frame, as far as they have come."""

    runs: int
    frames: int
    computed: list[int] = Field(description="How many of the runs have come to each frame so far")
    unit: str
    low: list[float | None] = Field(description="Error below which 10 % of the runs are, by frame")
    middle: list[float | None]
    high: list[float | None] = Field(description="Error below which 90 % of the runs are")
    holding: list[float | None] = Field(description="Share of the runs that have the target, by frame")


Result: TypeAlias = WhatIfPublic | EnsemblePublic


class ExplorationPublic(BaseModel):
    """An exploration under way, or what came of it."""

    id: str
    session: str
    branch: str
    kind: Literal["what-if", "ensemble"]
    state: Literal["computing", "done", "failed"]
    result: Result | None = Field(description="As far as it has come")
    message: str | None = Field(description="Why it has failed")
