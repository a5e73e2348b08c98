"""Jobs: what can be asked for that takes a while, how far it is, and what came of it."""

from typing import Annotated, Generic, Literal, TypeAlias, TypeVar

from pydantic import BaseModel, Field, model_validator

from pftrack.analysis.counterfactuals import Report
from pftrack.analysis.fitting import MOST_NUMBERS, Fit
from pftrack.analysis.other_seeds import Bands, Scene
from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.model.recipe import Recipe
from pftrack.runs.comparison import ComparisonResult, Setting
from pftrack_server.schemas.body import FrameNumber, Name, RequestBody, Title
from pftrack_server.schemas.description import ExportPublic
from pftrack_server.schemas.work import RunPublic

Result = TypeVar("Result")

LONGEST_S = 300.0


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


class FitCreate(RequestBody):
    """What to fit."""

    numbers: list[Name] = Field(min_length=1, max_length=MOST_NUMBERS, description="Names of parameters of the tracker")


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


class Job(BaseModel, Generic[Result]):
    """Work under way, or what came of it."""

    id: str
    kind: str
    name: str = Field(description="Of the file that is read or written, or what is compared, fitted or explored")
    state: Literal["working", "done", "failed"] = "working"
    done: int = Field(0, description="Steps done")
    total: int = Field(0, description="Steps to do; 0 until that is known")
    result: Result | None = Field(None, description="What has been found so far; all of it once it is done")
    error: str | None = Field(None, description="Why it has failed, a sentence")

    def refresh(self) -> None:
        """Say what has been found so far, where that grows; called before anybody looks."""


class ExportedFile(BaseModel):
    """A file that was written."""

    title: str = Field(description="What kind of file it is")
    media_type: str
    address: str = Field(description="Where it can be fetched")


class ExportJob(Job[ExportedFile]):
    """A file that is being written; the first half of its steps computes the run."""

    kind: Literal["export"] = "export"


class ImportJob(Job[RunPublic]):
    """A run that was sent and is being computed; its steps are frames."""

    kind: Literal["import"] = "import"


class FitJob(Job[Fit]):
    """A fit of numbers to what a session's run has seen."""

    kind: Literal["fit"] = "fit"


class ComparedPublic(BaseModel):
    """One of the runs of a comparison."""

    name: str = Field(description="By what is special about it")
    title: str | None = Field(description="What people call it, where it has such a name")
    colour: str
    first: int = Field(description="Its frame that is the first of those that are compared")
    recipe: Recipe
    shown: Recipe = Field(description="The same, no longer than what is compared")
    upload: str | None


class RunComparisonPublic(BaseModel):
    """What is known of a comparison; its frames are those in common, counted from 0 on."""

    unit: str
    frames: int
    runs: list[ComparedPublic]
    settings: tuple[Setting, ...] = Field(description="What differs, and that alone")
    exports: list[ExportPublic] = Field(description="Files that can be made of it")
    found: ComparisonResult | None = Field(None, description="What came of the runs, once they have been computed")


class ComparisonJob(Job[RunComparisonPublic]):
    """A comparison of runs; its steps are frames of all of them."""

    kind: Literal["comparison"] = "comparison"


class ExplorationJob(Job[Report | Bands]):
    """What would have saved a run (a report), or what runs with other seeds do (bands)."""

    kind: Literal["exploration"] = "exploration"
    session: str
    branch: str


AnyJob: TypeAlias = Annotated[
    ExportJob | ImportJob | FitJob | ComparisonJob | ExplorationJob, Field(discriminator="kind")
]
