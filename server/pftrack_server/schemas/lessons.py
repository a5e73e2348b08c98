"""Lessons: the list of them, each in detail, what they show, and what is said of an answer."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, StrictInt, StrictStr

from pftrack.core.model.parameters import Declaration, Value
from pftrack.core.model.recipe import Recipe, Seed
from pftrack_server.core.bodies import RequestBody, Values


class _Public(BaseModel):
    model_config = ConfigDict(from_attributes=True)


class CheckPublic(_Public):
    """What a lesson claims and computes."""

    name: str
    title: str


class ScenarioPublic(_Public):
    """A run of an experiment, of which some parameters may be turned."""

    recipe: Recipe
    unlocked: list[str]
    frame: int
    plots: list[str] = Field(description="Ids of the plots to show; all of them if none is named")
    layers: list[str] = Field(description="Names of layers to show beside those that are shown anyway")
    title: str = Field("", description="Of the experiment")
    problem: str | None = Field(None, description="Why it cannot be run here, one sentence")


class UsePublic(_Public):
    """Where the idea is used."""

    words: str = Field(description="What to look for there, HTML")
    scenario: ScenarioPublic


class LessonPublic(_Public):
    """A lesson as the overview shows it."""

    id: str
    number: int = Field(description="Place in the course; 0 for one beside it")
    title: str
    kind: Literal["demonstration", "scenario"]
    origin: str = Field(description="File or package that it comes from; empty for the project's own")
    checks: list[CheckPublic]
    uses: list[UsePublic]
    minutes: float = Field(description="How long it takes a class")
    problem: str | None = Field(None, description="Why it cannot be run here, one sentence")


class ProblemPublic(_Public):
    """A lesson of a lecturer that cannot be read."""

    origin: str
    line: int = Field(description="0 where it is the fault of no line")
    message: str


class LessonsPublic(BaseModel):
    """All lessons, those of the course first and in its order."""

    lessons: list[LessonPublic]
    problems: list[ProblemPublic]


class ChoicePublic(BaseModel):
    """A possible answer."""

    name: str
    words: str = Field(description="HTML")


class QuestionPublic(BaseModel):
    """What is asked, without its answer."""

    text: str = Field(description="HTML")
    kind: Literal["number", "choice", "point"]
    unit: str
    bounds: tuple[float, float] = Field(description="Lowest and highest number that is an answer at all")
    choices: list[ChoicePublic]
    panel: str = Field(description='Of a "point": id of the panel of the figure in which it is placed')
    along: Literal["x", "y"]


class NeighbourPublic(BaseModel):
    """The lesson before or after."""

    id: str
    number: int
    title: str


class LessonDetail(LessonPublic):
    """A lesson with everything that its page needs; texts are HTML."""

    idea: str
    tries: list[str]
    notice: str
    declarations: list[Declaration]
    defaults: dict[str, Value]
    random: bool = Field(description="Whether the seed matters")
    seed: int
    question: QuestionPublic
    asked: dict[str, Value] = Field(description="Values at which the question is asked")
    scenario: ScenarioPublic | None
    previous: NeighbourPublic | None
    next: NeighbourPublic | None


class FigureRequest(RequestBody):
    """At which parameters a figure is wanted."""

    parameters: Values = Field({}, description="Values by name; others have their defaults")
    seed: Seed | None = Field(None, description="Of the random numbers; the lesson's own if left out")
    revealed: bool = Field(False, description="Whether what answers the question is shown")
    nearest: bool = Field(
        False, description="Whether a number out of bounds becomes the nearest that is allowed, as where it was dragged"
    )


class NumberPublic(BaseModel):
    """A number with its exact value, where that is known; what is not finite is left out."""

    title: str
    value: float | None
    exact: float | None
    tolerance: float | None
    unit: str
    digits: int
    within: bool | None = Field(description="Whether the value is as close to the exact one as may be expected")


class FigurePublic(BaseModel):
    """What a lesson comes to at some parameters."""

    figure: dict[str, Any] = Field(description="As `pftrack.teaching.lessons.Figure` has it")
    numbers: list[NumberPublic]
    parameters: dict[str, Value] = Field(description="In force")
    seed: int


class AnswerRequest(RequestBody):
    """What a person predicts: a number, or the name of a choice."""

    answer: StrictFloat | StrictInt | StrictStr


class VerdictPublic(_Public):
    """What is said of a prediction."""

    right: bool
    given: float | str
    exact: float | str
    measured: float | None
    off: float | None = Field(description="By how much a number was off")
    words: list[str] = Field(description="The verdict and its reason, HTML")


class ComputingPublic(BaseModel):
    """The run that answers the question is still computed; ask again."""

    done: int
    total: int


class CheckedPublic(BaseModel):
    """What a check came to."""

    check: str
    title: str
    ours: float | None
    exact: float | None
    tolerance: float | None
    passed: bool
    problem: str | None = Field(None, description="Why it could not be computed, one sentence")


class ChecksPublic(BaseModel):
    """What the checks came to so far."""

    done: int
    total: int
    results: list[CheckedPublic]
