"""Views: sweeps as everybody outside sees them."""

from typing import Literal, TypeAlias

from pydantic import BaseModel

from pftrack.core.model.parameters import Value
from pftrack_server.schemas.description import TrackerPublic
from pftrack_server.schemas.measures import MeasurePublic

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
