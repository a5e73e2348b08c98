"""Sweeps: what one is to compute, how everybody outside sees it, and the messages of its stream.

The stream's vocabulary is typed and versioned. `hello` carries the complete state; after it come the progress and the
cells of the map that have changed. A page that is slow gets fewer and larger messages, never old ones.
"""

from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, Field, model_validator

from pftrack.core.model.parameters import NOT_BOOLEAN, Value
from pftrack.core.model.recipe import Footage, Seed
from pftrack_server.schemas.body import GivenTitle, Name, RequestBody
from pftrack_server.schemas.description import MeasurePublic, TrackerPublic
from pftrack_server.schemas.stream import Message

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


State = Literal["running", "stopped", "done"]
Test = Literal["chi-square", "fisher", "rank-sum"]
Correction = Literal["none", "holm"]
Verdict = Literal["first", "second", "none", "untested"]
Pair: TypeAlias = tuple[str | None, str | None]
"""Names of the axes of a map, across and up; None pools all values."""


class AxisPublic(BaseModel):
    """An axis with what a map needs to write beside it."""

    name: str
    title: str
    unit: str
    kind: str
    values: list[Value]


class ValuesPublic(BaseModel):
    """The first values of an axis as it would be, and how many there are."""

    name: str
    count: int
    first: list[Value]


class EstimatePublic(BaseModel):
    """The size of a sweep before it starts.

    `seconds` is missing where it was not measured; `problem` says why this server would not carry the sweep out now.
    """

    runs: int
    conditions: int
    cells: int
    frames: int
    axes: list[ValuesPublic]
    jobs: int
    bytes: int
    seconds: float | None = None
    problem: str | None = None


class SweepPublic(BaseModel):
    """A sweep.

    `fixed` is `parameters` with titles and units; `successes` counts over all runs so far, where the experiment knows
    success; `problems` counts runs whose values are at odds with each other; `recording` is the name of the recording
    on which all runs are, if there is one; without `has_truth` there is no error, and `measures` are what the methods
    say of themselves.
    """

    id: str
    title: str
    experiment: str
    unit: str
    judged: bool
    has_truth: bool = True
    axes: list[AxisPublic]
    trackers: list[TrackerPublic]
    measures: list[MeasurePublic] = []
    trials: int
    frames: int
    recording: str | None = None
    seed: int
    loss_probability: bool = False
    parameters: dict[str, Value]
    fixed: list[AxisPublic]
    runs: int
    conditions: int
    done: int
    successes: int | None = None
    problems: int
    state: State
    message: str | None = None
    rate: float | None = None
    seconds: float
    seconds_left: float | None = None
    created: str
    outcome: str
    page: str


class MapPublic(BaseModel):
    """The cells of one method, a list for each quantity.

    The lists are as long as `at` of a message, or as the map has cells, row after row of the y axis. What is not known
    is null. `error` is the mean over the successful runs, and each of `measures` by its name that over all runs.
    """

    tracker: str
    runs: list[int]
    problems: list[int]
    successes: list[int | None]
    rate: list[float | None]
    low: list[float | None]
    high: list[float | None]
    error: list[float | None]
    lost_frames: list[float | None]
    measures: dict[str, list[float | None]] = {}


class ComparisonPublic(BaseModel):
    """Two methods against each other, cell by cell.

    `measure` is "success", "error" or the name of one of the sweep's measures. `difference` is positive where the first
    is better: that of the success rates, of the mean errors of successful runs, or of a measure's means over all runs.
    `paired` is the mean difference between runs on the same scenes, of which there are `pairs`, with its 95 % interval.
    `verdict` is the outcome of the test; "untested" where its conditions of use do not hold.
    """

    first: str
    second: str
    measure: str
    test: Test
    level: float
    correction: Correction
    difference: list[float | None]
    paired: list[float | None]
    paired_low: list[float | None]
    paired_high: list[float | None]
    pairs: list[int]
    verdict: list[Verdict]
    p_value: list[float | None]


class CellsPublic(BaseModel):
    """A sweep seen over one or two of its axes; the others, and the trials, are pooled."""

    x: AxisPublic
    y: AxisPublic | None
    planned: int
    done: int
    maps: list[MapPublic]
    comparison: ComparisonPublic | None = None


class RowPublic(BaseModel):
    """One run of a sweep."""

    run: int
    tracker: str
    trial: int
    seed: int
    conditions: dict[str, Value]
    success: bool | None
    mean_error: float | None
    lost_frames: int | None
    first_lost_frame: int | None
    measures: dict[str, float | None] = {}
    problem: str | None


class RowsPublic(BaseModel):
    """Some runs of a cell, failures first, and how many there are."""

    total: int
    failures: int
    rows: list[RowPublic]


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    sweep: SweepPublic
    cells: CellsPublic


class Progress(Message):
    """Progress and state of the sweep. Rates are in runs a second, times in seconds."""

    type: Literal["progress"] = "progress"
    state: State
    message: str | None
    done: int
    successes: int | None
    rate: float | None
    seconds: float
    seconds_left: float | None
    outcome: str


class Cells(Message):
    """The cells that have changed, by their number: row after row of the y axis."""

    type: Literal["cells"] = "cells"
    done: int
    at: list[int]
    maps: list[MapPublic]
