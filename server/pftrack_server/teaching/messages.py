"""Messages of teaching: requests and answers about classes, lectures and lessons.

Texts of a lesson are Markdown in the library and HTML here: a field of the type `Html` takes Markdown and holds HTML.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictFloat,
    StrictInt,
    StrictStr,
    computed_field,
    model_validator,
)
from pydantic_core import to_json

from pftrack.core.model.parameters import NOT_BOOLEAN, Declaration, Value
from pftrack.core.model.recipe import Recipe, Seed
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.teaching.lessons.document import Problem
from pftrack.teaching.lessons.figure import Number
from pftrack_server.core.bodies import FrameNumber, GivenTitle, Name, RequestBody, Values
from pftrack_server.core.markdown import inline, paragraphs
from pftrack_server.sessions.duplex import Message
from pftrack_server.work.sources import ComparedRun

LARGEST_ARRANGEMENT = 16 * 1024
LONGEST_QUESTION, LONGEST_ANSWER = 300, 100


def _once(names: list[str]) -> list[str]:
    if len(set(names)) < len(names):
        raise ValueError("Input should be names that differ from each other")
    return names


def _small(arrangement: dict[str, Any]) -> dict[str, Any]:
    try:
        length = len(to_json(arrangement))
    except (ValueError, RecursionError):
        raise ValueError("Input should be what JSON in UTF-8 can hold, not too deep") from None
    if length > LARGEST_ARRANGEMENT:
        raise ValueError(f"Input should be at most {LARGEST_ARRANGEMENT} bytes of JSON")
    return arrangement


Followed = Annotated[list[Name], Field(max_length=4), AfterValidator(_once)]
Arrangement = Annotated[dict[str, Any], AfterValidator(_small)]
MostFollowers = Annotated[int, Field(ge=0, le=1000), NOT_BOOLEAN]
PollQuestion = Annotated[str, Field(min_length=1, max_length=LONGEST_QUESTION)]
PollAnswer = Annotated[str, Field(min_length=1, max_length=LONGEST_ANSWER)]
PollAnswers = Annotated[list[PollAnswer], Field(min_length=2, max_length=8)]
Hours = Annotated[float, Field(gt=0, le=24, allow_inf_nan=False), NOT_BOOLEAN]


class FollowUpdate(RequestBody):
    """A class's content and limits; in a change, fields that are left out stay the same."""

    sessions: Followed = Field([], description="One session, or up to four to compare")
    lesson: Name | None = None
    title: GivenTitle | None = Field(None, description="Title; left out for that of the lesson or the first session")
    arrangement: Arrangement = Field({}, description="Arrangement on the lecturer's page, for the followers' pages")
    most_followers: MostFollowers = Field(200, description="Followers at one time; 0 closes the class to new ones")
    hours: Hours = Field(3.0, description="Hours from now after which it ends by itself")


class FollowCreate(FollowUpdate):
    """A new class, on at least one session or a lesson."""

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.sessions and self.lesson is None:
            raise ValueError("Input should name a session or a lesson to follow")
        return self


class PollCreate(RequestBody):
    """A question to the class: the lecturer's own with answers, a lesson's, or a stored one."""

    question: PollQuestion | None = None
    answers: PollAnswers | None = None
    lesson: Name | None = Field(None, description="Lesson whose question is asked; the server makes its answers")
    kept: Name | None = Field(None, description="A stored poll, whose answers are shown again")
    lecture: Name | None = Field(None, description="Lecture in which it is asked; stored with the answers")

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.question is None) != (self.answers is None):
            raise ValueError("A question of your own needs answers")
        if sum(each is not None for each in (self.question, self.lesson, self.kept)) != 1:
            raise ValueError("Input should be a question with its answers, a lesson, or a stored poll")
        return self


class Vote(RequestBody):
    """A follower's answer, as an index in the list."""

    poll: Name
    answer: Annotated[int, Field(ge=0, le=7), NOT_BOOLEAN]


class ForkCreate(RequestBody):
    """A follower's request for a copy of a session, or to change the lesson's figure."""

    session: Name | None = Field(None, description="Session of the class to copy; left out for the lesson")
    frame: FrameNumber | None = Field(None, description="First frame of the copy; left out for the shown frame")


class FollowedPublic(BaseModel):
    """A followed session."""

    id: str
    title: str


class LinkPublic(BaseModel):
    """An address of the link for followers."""

    address: str
    everybody: bool = Field(description="Whether other machines can open it")


class PollPublic(BaseModel):
    """A question to the class, and its answers."""

    id: str
    question: str
    answers: list[str]
    votes: int | None = Field(description="Number of answers; null for followers until it is revealed")
    counts: list[int] | None = Field(description="Votes for each answer; null until it is revealed")
    revealed: bool
    lesson: str | None = Field(description="Lesson that the question comes from, if any")


class PollKept(BaseModel):
    """A closed poll with the votes for each answer; who voted is not stored."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    question: str
    answers: list[str]
    counts: list[int] = Field(description="Votes for each answer")
    followers: int = Field(description="Followers who were present")
    title: str = Field(description="Title of the content that the class saw")
    lecture: str | None = Field(description="The lecture in which it was asked, if any")
    lecture_title: str | None = None
    asked: str = Field(validation_alias="created")

    @computed_field(description="Number of answers")  # type: ignore[prop-decorator]
    @property
    def votes(self) -> int:
        """Return the number of answers."""
        return sum(self.counts)


class ForkPublic(BaseModel):
    """A follower's copy: a session or the lesson."""

    id: str | None = Field(description="Name of the session; null for the lesson")
    title: str
    page: str


class MinePublic(BaseModel):
    """The part of a class's view that belongs to one follower."""

    fork: ForkPublic | None
    vote: Vote | None


class _Follow(BaseModel):
    title: str
    sessions: list[FollowedPublic]
    lesson: str | None
    arrangement: dict[str, Any]
    expires: str
    poll: PollPublic | None


class FollowPublic(_Follow):
    """The followers' view of a class; `mine` is null in messages to all."""

    mine: MinePublic | None = None


class FollowOwned(_Follow):
    """The lecturer's view of a class."""

    id: str
    links: list[LinkPublic] = Field(description="Links for followers, the best first")
    owner_link: str = Field(description="Link for another device of the lecturer; gives rights over this class only")
    notice: str | None = Field(description="Why others cannot follow, a sentence")
    followers: int
    most_followers: int
    forks: int = Field(description="Number of followers with a copy of their own")


class FollowNews(Message):
    """The class's state; `hello` is the first message to a follower."""

    type: Literal["hello", "follow"] = "follow"
    follow: FollowPublic


class FigureShown(Message):
    """A new figure of the lecturer's lesson."""

    type: Literal["figure"] = "figure"
    lesson: str
    figure: dict[str, Any] = Field(description="The figure, as sent to the lecturer's page")


class OwnedNews(Message):
    """The class's state for the lecturer; `hello` is the first message."""

    type: Literal["hello", "follow"] = "follow"
    follow: FollowOwned


Kind = Literal["lesson", "failure", "session", "comparison", "question", "poll"]
KINDS: tuple[Kind, ...] = ("lesson", "failure", "session", "comparison", "question", "poll")
MOST_ITEMS = 100
LONGEST_NOTES = 10_000
Minutes = Annotated[float, Field(gt=0, le=180, allow_inf_nan=False), NOT_BOOLEAN]


class LectureRun(ComparedRun):
    """A run, and the first frame of its session."""

    position: FrameNumber | None = Field(
        None, description="Frame to show; left out for that of a saved run, or the first"
    )


class LectureComparison(RequestBody):
    """Two to four runs next to each other."""

    runs: Annotated[list[ComparedRun], Field(min_length=2, max_length=4)]
    position: FrameNumber = 0
    arrangement: Literal["side", "over"] = "side"


class LectureItem(RequestBody):
    """One item of a lecture, of one of the kinds."""

    # In a file a lesson may be given by its number, and answers may be numbers.
    model_config = ConfigDict(extra="forbid", coerce_numbers_to_str=True)

    lesson: Name | None = Field(None, description="Id of a lesson")
    failure: Name | None = Field(None, description="Id of a failure")
    session: LectureRun | None = None
    comparison: LectureComparison | None = None
    question: Name | None = Field(None, description="Id of a lesson whose question to ask the class")
    poll: PollQuestion | None = Field(None, description="A question of the lecturer's own")
    answers: PollAnswers | None = Field(None, description="Answers of the poll")
    title: GivenTitle | None = Field(None, description="Title; left out for the content's own")
    minutes: Minutes | None = Field(None, description="Minutes; left out for the usual time")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"an item is one of {', '.join(KINDS)}, got {' and '.join(given) or 'none'}")
        if (self.poll is None) != (self.answers is None):
            raise ValueError("only a poll has answers, and it needs them")
        return self

    @property
    def kind(self) -> Kind:
        """The kind of the item."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)


class LectureUpdate(RequestBody):
    """A lecture from its page; its file has the same fields, with the notes as its text."""

    title: GivenTitle
    items: list[LectureItem] = Field([], max_length=MOST_ITEMS)
    notes: Annotated[str, Field(max_length=LONGEST_NOTES)] = ""


class LectureItemPublic(BaseModel):
    """The view of a lecture's item."""

    item: dict[str, Any] = Field(description="The item itself, a LectureItem to send back")
    kind: Kind
    title: str
    minutes: float = Field(description="Its minutes, given or usual")
    page: str | None = Field(description="Page that shows it; null for a poll, which appears over the present page")
    asks: PollCreate | None = Field(description="Question to the class, if it is a poll or a lesson's question")
    problem: str | None = Field(description="Why it cannot be shown here, a sentence with the line in the file")


class LectureSummary(BaseModel):
    """A lecture in a list."""

    id: str
    title: str
    count: int = Field(description="Items")
    minutes: float
    created: str
    updated: str
    page: str


class LecturePublic(LectureSummary):
    """A whole lecture."""

    items: list[LectureItemPublic]
    notes: str


Html = Annotated[str, BeforeValidator(inline)]
"""A sentence."""
Paragraphs = Annotated[str, BeforeValidator(paragraphs)]


class _Public(BaseModel):
    model_config = ConfigDict(from_attributes=True)


class CheckPublic(_Public):
    """A claim of a lesson that can be computed."""

    name: str
    title: str


class ScenarioPublic(_Public):
    """A run of an experiment, with the parameters that can be changed."""

    recipe: Recipe
    words: Html = Field("", description="Hint on what to look for, HTML")
    unlocked: tuple[str, ...]
    frame: int
    plots: tuple[str, ...] = Field(description="Ids of the plots to show; empty for all")
    layers: tuple[str, ...] = Field(description="Names of layers to show in addition to the default ones")

    @computed_field(description="Title of the experiment")
    def title(self) -> str:
        """Return the experiment's title, or its name if it is not installed."""
        name = self.recipe.experiment
        return name if missing(name) else find_experiment(name).title

    @computed_field(description="Why it cannot be run here, one sentence")
    def problem(self) -> str | None:
        """Return why the run cannot be made here."""
        return missing(self.recipe.experiment)


class LessonPublic(_Public):
    """A lesson in the overview."""

    id: str
    number: int = Field(description="Number in the course; 0 for a lesson outside it")
    title: str
    kind: Literal["demonstration", "scenario"]
    origin: str = Field(description="File or package that it comes from; empty for the project's own")
    checks: list[CheckPublic]
    uses: list[ScenarioPublic]
    minutes: float = Field(description="Minutes that it takes a class")
    problem: str | None = Field(description="Why it cannot be run here, one sentence")


class LessonsPublic(BaseModel):
    """All lessons; those of the course come first, in its order."""

    lessons: list[LessonPublic]
    problems: list[Problem]


class ChoicePublic(BaseModel):
    """A possible answer."""

    name: str
    words: Html = Field(description="HTML")


def _in_order(choices: dict[str, str] | None) -> list[ChoicePublic]:
    return [ChoicePublic(name=name, words=words) for name, words in (choices or {}).items()]


class QuestionPublic(_Public):
    """A lesson's question without its answer."""

    text: Html = Field(description="HTML")
    kind: Literal["number", "choice", "point"]
    unit: str
    bounds: tuple[float, float] = Field(description="Lowest and highest possible answer")
    choices: Annotated[list[ChoicePublic], BeforeValidator(_in_order)]
    panel: str = Field(description='For a "point": id of the figure\'s panel in which to place it')
    along: Literal["x", "y"]


class NeighbourPublic(_Public):
    """The lesson before or after."""

    id: str
    number: int
    title: str


class LessonDetail(LessonPublic):
    """A lesson with everything for its page; texts are HTML."""

    idea: Paragraphs
    tries: list[Html]
    notice: Html
    declarations: list[Declaration]
    defaults: dict[str, Value]
    random: bool = Field(description="Whether the figure depends on the seed")
    seed: int
    question: QuestionPublic
    asked: dict[str, Value] = Field(description="Parameter values at which the question is asked")
    scenario: ScenarioPublic | None
    previous: NeighbourPublic | None
    next: NeighbourPublic | None


class FigureRequest(RequestBody):
    """A request for a figure at some parameters."""

    parameters: Values = Field({}, description="Values by name; missing ones are the defaults")
    seed: Seed | None = Field(None, description="Random seed; left out for the lesson's own")
    revealed: bool = Field(False, description="Whether to show what answers the question")
    nearest: bool = Field(False, description="Whether a number out of bounds becomes the nearest allowed one")


class FigurePublic(BaseModel):
    """The figure of a lesson at some parameters."""

    figure: dict[str, Any] = Field(description="The figure, in the form of `pftrack.teaching.lessons.Figure`")
    numbers: list[Number]
    parameters: dict[str, Value] = Field(description="In force")
    seed: int


class AnswerRequest(RequestBody):
    """A person's prediction: a number, or the name of a choice."""

    answer: StrictFloat | StrictInt | StrictStr


class VerdictPublic(_Public):
    """The verdict on a prediction."""

    right: bool
    given: float | str
    exact: float | str
    measured: float | None
    frame: int | None = Field(description="Frame of the run that shows the answer, if there is a run")
    words: list[Html] = Field(description="The verdict and its reason, HTML")


class ComputingPublic(BaseModel):
    """The run that answers the question is still being computed; ask again."""

    done: int
    total: int


class CheckedPublic(BaseModel):
    """The result of a check."""

    check: str
    title: str
    ours: float | None = None
    exact: float | None = None
    tolerance: float | None = None
    passed: bool = False
    problem: str | None = Field(None, description="Why it could not be computed, one sentence")


class ChecksPublic(BaseModel):
    """The results of the checks so far."""

    done: int
    total: int
    results: list[CheckedPublic]


def missing(experiment: str) -> str | None:
    """Return why a run of an experiment cannot be made here, one sentence; None if it can be made."""
    try:
        find_experiment(experiment)
    except RefusedError:
        return f"The experiment {experiment!r} is unknown; its package may not be installed."
    return None
