"""All that people of this server have of their own: sessions, saved runs, comparisons, sweeps and uploads."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, computed_field

from pftrack.core.model.recipe import Recipe
from pftrack.runs.comparison import MOST_RUNS
from pftrack_server.schemas.body import FrameNumber, GivenTitle, RequestBody, Title
from pftrack_server.schemas.description import ExportPublic
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.sweeps import SweepPublic
from pftrack_server.schemas.uploads import UploadPublic

Kind = Literal["sessions", "runs", "comparisons", "sweeps", "uploads"]
Arrangement = Literal["side", "over"]
"""Side by side, or one over the other."""


class RunCreate(RequestBody):
    """Which session's active branch to save."""

    session: str = Field(max_length=64)
    title: Title | None = None


class NewTitle(RequestBody):
    """What people call a saved run or comparison."""

    title: GivenTitle


class RunPublic(BaseModel):
    """A saved run."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    title: str
    experiment: str
    tracker: str
    seed: int
    frames: int
    created: str
    outcome: str
    summary: dict[str, Any]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def thumbnail(self) -> str:
        """Address of its picture."""
        return f"api/v1/runs/{self.id}/thumbnail.png"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def page(self) -> str:
        """Address of the page that lists it."""
        return f"work?show=runs#run-{self.id}"


class PlotChoice(BaseModel):
    """A plot of which a picture can be made."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    title: str


class ExportsPublic(BaseModel):
    """What a saved run can be exported as."""

    exports: list[ExportPublic]
    plots: list[PlotChoice] = Field(description='What `plot` may name for an export of the group "plots"')


class SavedRun(RequestBody):
    """What makes a run of a saved comparison."""

    recipe: Recipe


class SavedComparisonCreate(RequestBody):
    """A comparison to keep."""

    title: GivenTitle
    runs: list[SavedRun] = Field(min_length=2, max_length=MOST_RUNS)
    position: FrameNumber = Field(0, description="The frame to begin at, of those that all runs have")
    arrangement: Arrangement = "side"


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


class WorkCounts(BaseModel):
    """How many there are of each kind."""

    sessions: int
    runs: int
    comparisons: int
    sweeps: int
    uploads: int


class WorkPublic(BaseModel):
    """What was found, the newest of each kind first."""

    sessions: list[SessionPublic]
    runs: list[RunPublic]
    comparisons: list[SavedComparisonPublic]
    sweeps: list[SweepPublic]
    uploads: list[UploadPublic]
    found: WorkCounts = Field(description="How many have all the words, those beyond the limit included")
    total: WorkCounts = Field(description="How many there are")
