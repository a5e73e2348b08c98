"""Models: the shapes that the REST interface takes and gives."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from pftrack.layer import Layer
from pftrack.marks import Editor
from pftrack.parameters import Declaration, Value
from pftrack.runs import migrate
from pftrack.runs.recipe import Recipe, Seed
from server.schemas.messages import TrackerPublic

__all__ = [
    "BookmarkCreate",
    "BranchCreate",
    "Changed",
    "Columns",
    "ExperimentDetail",
    "ExperimentPublic",
    "PluginPublic",
    "PresetPublic",
    "RunCreate",
    "RunPublic",
    "SessionCreate",
    "SightingPublic",
    "TrackerPublic",
    "TransportUpdate",
    "TruthPublic",
    "UploadPublic",
]

SLOWEST = 0.1

Frame = Annotated[int, Field(ge=0, le=10_000_000)]
Values = dict[Annotated[str, Field(max_length=64)], Any]
Title = Annotated[str, Field(max_length=200)]


def _speed(value: float) -> float:
    if value != 0 and value < SLOWEST:
        raise ValueError("Input should be 0 (as fast as possible) or between 0.1 and 10")
    return value


class RequestBody(BaseModel):
    """Base of what a client sends: closed to unknown names."""

    model_config = ConfigDict(extra="forbid")


class PresetPublic(BaseModel):
    """A named starting point."""

    name: str
    title: str
    tracker: str
    parameters: dict[str, Value]
    seed: int


class ExperimentPublic(BaseModel):
    """An experiment as the gallery shows it."""

    id: str
    title: str
    question: str
    document: str
    description: str
    accepts_video: bool
    target: str = Field(description="What is tracked, one word")
    marks: list[Editor] = Field(description="Kinds of mark that it takes in a recording, the one to offer first")
    finds: str | None = Field(
        description="Kind of mark that it finds by itself; null if a person has to mark the target"
    )
    hints: list[str] = Field(description="Kinds of mark by which a person may show it where to find the target")
    advice: str = Field(description="What a person who marks the target should know")
    truth_columns: list[str] = Field(description="What a table of truth for a recording has")
    default_tracker: str
    frames: int
    trackers: list[dict[str, str]]
    presets: list[PresetPublic]
    thumbnail: str


class ExperimentDetail(ExperimentPublic):
    """An experiment with everything that can be turned."""

    declarations: list[Declaration]
    layers: list[Layer]
    parameter_schema: dict[str, Any] = Field(serialization_alias="schema")


class PluginPublic(BaseModel):
    """An experiment of another package than pftrack."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    package: str
    problem: str = Field(description="Why it cannot be used, one sentence; empty if it can")


class UploadPublic(BaseModel):
    """An upload and what was found in it."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    name: str
    kind: str
    frames: int
    width: int
    height: int
    frame_rate_hz: float
    duration_s: float
    sha256: str
    warnings: list[str]
    size_bytes: int
    created: str


class SightingPublic(BaseModel):
    """What came of looking for a target in an upload.

    As long as there is no mark and `looked` is less than `of`, one may go on looking.
    """

    frame: int = Field(description="Where it was found, or the last frame that was looked into")
    mark: dict[str, Any] | None = Field(description="The target, of the kind that is found; null if it was not found")
    placed: list[str] = Field(description="Handles of the mark that a model has placed rather than the picture shown")
    remarks: list[str] = Field(description="What to look at, or why nothing was found")
    looked: int = Field(description="How many frames were looked into")
    of: int = Field(description="How many frames there are to look into")


class TruthPublic(BaseModel):
    """What is truly so in an upload, in short."""

    frames: int = Field(description="How many frames there is truth of")
    first: int
    last: int
    warnings: list[str]


class SessionCreate(RequestBody):
    """What a new session is to be; what links of earlier versions hold is understood as well."""

    recipe: Recipe
    upload: str | None = Field(
        None, max_length=64, description="Name of the upload that the recipe's footage is; its hash does as well"
    )
    position: Frame = 0

    @model_validator(mode="before")
    @classmethod
    def _earlier(cls, raw: Any) -> Any:  # noqa: ANN401 - whatever was sent
        return migrate.request(raw) if isinstance(raw, dict) and "recipe" not in raw else raw


class TransportUpdate(RequestBody):
    """What the run is to do."""

    action: Literal["play", "pause", "step", "back", "seek", "before_loss", "speed", "restart"]
    frame: Frame | None = None
    speed: Annotated[float, Field(le=10, allow_inf_nan=False), AfterValidator(_speed)] | None = None
    seed: Seed | None = Field(None, description="With restart: the seed to begin anew with")


class BranchCreate(RequestBody):
    """Where to leave the active branch, and with what to go on."""

    frame: Frame
    tracker: str | None = Field(None, max_length=64)
    parameters: Values = {}
    title: Title | None = None


class BookmarkCreate(RequestBody):
    """What is worth remembering of the frame that is shown."""

    note: str = Field("", max_length=500)


class RunCreate(RequestBody):
    """Which session's active branch to save."""

    session: str = Field(max_length=64)
    title: Title | None = None


class Changed(BaseModel):
    """The values in force after a change, and the frame from which they count."""

    parameters: dict[str, Value]
    tracker: str
    frame: int
    branch: str


class Columns(BaseModel):
    """The diagnostics of a branch, a list a column."""

    branch: str
    columns: dict[str, list[Any]]


class RunPublic(BaseModel):
    """A saved run."""

    id: str
    title: str
    experiment: str
    tracker: str
    seed: int
    frames: int
    created: str
    outcome: str
    summary: dict[str, Any]
    thumbnail: str
    page: str
