"""Comparisons: which runs, what differs between them, and what came of each beside the others."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field, model_validator

from pftrack.core.model.recipe import Recipe
from pftrack.runs.comparison import MOST_RUNS
from pftrack_server.schemas.body import FrameNumber, GivenTitle, RequestBody, Title
from pftrack_server.schemas.description import ExportPublic

Arrangement = Literal["side", "over"]
"""Side by side, or one over the other."""

Place = Annotated[int, Field(description="Place of a run in the comparison")]


class ComparedRun(RequestBody):
    """A run to compare: one that is here, by its name, or what makes it."""

    reference: str | None = Field(
        None,
        max_length=200,
        description="A saved run, `session:branch` or `sweep:run`; with `:tracker` the same by another",
    )
    recipe: Recipe | None = None
    upload: str | None = Field(None, max_length=64, description="Name of the upload that the recipe's footage is")

    @model_validator(mode="after")
    def _one_of_both(self) -> "ComparedRun":
        if (self.reference is None) == (self.recipe is None):
            raise ValueError("A run to compare is named by a reference or by a recipe")
        return self


class ComparisonCreate(RequestBody):
    """Two to four runs to compare."""

    runs: list[ComparedRun] = Field(max_length=64)


class ComparisonExportCreate(ComparisonCreate):
    """Two to four runs whose comparison shall be written as a file."""

    title: Title = Field("", description="By which the file is called")


class ComparedPublic(BaseModel):
    """One of the runs."""

    name: str = Field(description="By what is special about it")
    title: str | None = Field(description="What people call it, where it has such a name")
    colour: str
    first: int = Field(description="Its frame that is the first of those that are compared")
    recipe: Recipe
    shown: Recipe = Field(description="The same, no longer than what is compared")
    upload: str | None


class SettingPublic(BaseModel):
    """Something in which the runs differ."""

    name: str
    title: str
    values: list[str | None] = Field(description="What each run has of it, in words; null where it knows no such thing")


class OutcomePublic(BaseModel):
    """What came of a run in the frames that are compared."""

    mean_error: float | None
    success_share: float | None = Field(description="Of the measure that decides on success, over these frames")
    lost_frames: int | None = Field(description="In how many the target is lost; null where nobody says")
    first_lost_frame: int | None


class PartingPublic(BaseModel):
    """Where two runs part."""

    first: Place
    second: Place
    frame: int | None = Field(description="The first with other estimates, if only in the last bit")


class PairedPublic(BaseModel):
    """How much a run differs from the first one, frame by frame."""

    first: Place
    second: Place
    name: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    frames: int = Field(description="In which both have it")
    mean: float | None = Field(description="Of the second run's value minus the first's")
    low: float | None = Field(description="Lower end of its 95 % interval, by batch means; null if not applicable")
    high: float | None


class ComparisonResult(BaseModel):
    """What is known once all runs have been computed."""

    frames: int
    outcomes: list[OutcomePublic]
    partings: list[PartingPublic]
    first_difference: int | None = Field(description="The first frame in which any two runs part")
    before_loss: int | None = Field(description="From which to watch the first loss of any run")
    paired: list[PairedPublic]


class ComparisonOutline(BaseModel):
    """What is known of a comparison from the start; its frames are those in common, counted from 0 on."""

    unit: str
    frames: int
    runs: list[ComparedPublic]
    settings: list[SettingPublic] = Field(description="What differs, and that alone")
    exports: list[ExportPublic] = Field(description="Files that can be made of it")


class RunComparisonPublic(ComparisonOutline):
    """A comparison that is computed, or what came of it."""

    id: str
    state: Literal["computing", "done", "failed"]
    done: int = Field(description="Frames computed, of all runs")
    total: int = Field(description="Frames to compute; 0 until it has begun")
    result: ComparisonResult | None
    message: str | None = Field(description="Why it failed, if it did")


class SavedRun(RequestBody):
    """What makes a run of a saved comparison."""

    recipe: Recipe


class SavedComparisonCreate(RequestBody):
    """A comparison to keep."""

    title: GivenTitle
    runs: list[SavedRun] = Field(min_length=2, max_length=MOST_RUNS)
    position: FrameNumber = Field(0, description="The frame to begin at, of those that all runs have")
    arrangement: Arrangement = "side"


class SavedComparisonUpdate(RequestBody):
    """What people call a saved comparison."""

    title: GivenTitle


class SavedComparisonPublic(BaseModel):
    """A saved comparison."""

    id: str
    title: str
    experiments: list[str] = Field(description="Of its runs, each once")
    trackers: list[str] = Field(
        description="Of its runs, in their order; empty where a recipe leaves it to the experiment"
    )
    created: str
    page: str


class SavedComparisonDetail(SavedComparisonPublic):
    """A saved comparison with all that makes it again."""

    runs: list[SavedRun]
    position: int
    arrangement: Arrangement
