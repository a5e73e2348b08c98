"""Messages of teaching: what pages send about classes, lectures and lessons, and what they get.

What a lesson says is Markdown in the library and HTML here: a field of the type `Html` takes the
one and holds the other.
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
    """What a class is to follow, and for how many; in a change what is left out stays."""

    sessions: Followed = Field([], description="One session, or up to four that are compared")
    lesson: Name | None = None
    title: GivenTitle | None = Field(None, description="That of the lesson or the first session, if left out")
    arrangement: Arrangement = Field({}, description="How the lecturer's page arranges them, for the followers' pages")
    most_followers: MostFollowers = Field(200, description="At one time; 0 closes the class to new followers")
    hours: Hours = Field(3.0, description="After which it ends by itself, from now on")


class FollowCreate(FollowUpdate):
    """What a class is to follow: at least one session or a lesson."""

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.sessions and self.lesson is None:
            raise ValueError("Input should name a session or a lesson to follow")
        return self


class PollCreate(RequestBody):
    """A question to the class: one's own with its answers, a lesson's, or one that was answered before."""

    question: PollQuestion | None = None
    answers: PollAnswers | None = None
    lesson: Name | None = Field(None, description="Whose question is asked; the server makes the answers of it")
    kept: Name | None = Field(None, description="A poll that was kept, whose answers are shown again")
    lecture: Name | None = Field(None, description="In which lecture it is asked; kept with the answers")

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.question is None) != (self.answers is None):
            raise ValueError("A question of one's own has its answers")
        if sum(each is not None for each in (self.question, self.lesson, self.kept)) != 1:
            raise ValueError("Input should be a question with its answers, a lesson, or a poll that was kept")
        return self


class Vote(RequestBody):
    """A follower's answer, by its place in the list."""

    poll: Name
    answer: Annotated[int, Field(ge=0, le=7), NOT_BOOLEAN]


class ForkCreate(RequestBody):
    """A follower wants a session that begins as one of the class's stands, or to turn the lesson's figure."""

    session: Name | None = Field(None, description="One of the class's; the lesson if left out")
    frame: FrameNumber | None = Field(None, description="The frame that is shown, if left out")


class FollowedPublic(BaseModel):
    """A session that is followed."""

    id: str
    title: str


class LinkPublic(BaseModel):
    """An address of the link for followers."""

    address: str
    everybody: bool = Field(description="Whether other machines can reach it")


class PollPublic(BaseModel):
    """A question to the class, and what was answered."""

    id: str
    question: str
    answers: list[str]
    votes: int | None = Field(description="How many have answered; null for followers until it is revealed")
    counts: list[int] | None = Field(description="Of each answer; null until it is revealed")
    revealed: bool
    lesson: str | None = Field(description="Whose question it is, if it is a lesson's")


class PollKept(BaseModel):
    """A poll that is over, and how many gave which answer; who did is known to nobody."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    question: str
    answers: list[str]
    counts: list[int] = Field(description="Of each answer")
    followers: int = Field(description="How many were there to answer")
    title: str = Field(description="Of what the class saw")
    lecture: str | None = Field(description="The lecture in which it was asked, if it was in one")
    lecture_title: str | None = None
    asked: str = Field(validation_alias="created")

    @computed_field(description="How many have answered")  # type: ignore[prop-decorator]
    @property
    def votes(self) -> int:
        """Return the number of answers."""
        return sum(self.counts)


class ForkPublic(BaseModel):
    """What a follower has: a session, or the lesson."""

    id: str | None = Field(description="Of the session; null for the lesson")
    title: str
    page: str


class MinePublic(BaseModel):
    """What belongs to one follower alone."""

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
    """What a class follows, as followers see it; `mine` is null in what goes to all."""

    mine: MinePublic | None = None


class FollowOwned(_Follow):
    """What a class follows, as the lecturer sees it."""

    id: str
    links: list[LinkPublic] = Field(description="For followers, the best first")
    owner_link: str = Field(description="For another device of the lecturer; gives rights over this class alone")
    notice: str | None = Field(description="What keeps others from following, a sentence")
    followers: int
    most_followers: int
    forks: int = Field(description="Followers who try something of their own")


class FollowNews(Message):
    """What a class follows now; `hello` is the first message to a follower."""

    type: Literal["hello", "follow"] = "follow"
    follow: FollowPublic


class FigureShown(Message):
    """The lecturer's lesson shows another figure."""

    type: Literal["figure"] = "figure"
    lesson: str
    figure: dict[str, Any] = Field(description="As the lecturer's page got it")


class OwnedNews(Message):
    """What has changed for the lecturer; `hello` is the first message."""

    type: Literal["hello", "follow"] = "follow"
    follow: FollowOwned


Kind = Literal["lesson", "failure", "session", "comparison", "question", "poll"]
KINDS: tuple[Kind, ...] = ("lesson", "failure", "session", "comparison", "question", "poll")
MOST_ITEMS = 100
LONGEST_NOTES = 10_000
Minutes = Annotated[float, Field(gt=0, le=180, allow_inf_nan=False), NOT_BOOLEAN]


class LectureRun(ComparedRun):
    """A run, and the frame at which its session begins."""

    position: FrameNumber | None = Field(None, description="That of a saved run, or the first, if left out")


class LectureComparison(RequestBody):
    """Two to four runs beside each other."""

    runs: Annotated[list[ComparedRun], Field(min_length=2, max_length=4)]
    position: FrameNumber = 0
    arrangement: Literal["side", "over"] = "side"


class LectureItem(RequestBody):
    """One thing that is shown or asked, of one of the kinds."""

    # In a file a lesson may be named by its number, and answers may be numbers.
    model_config = ConfigDict(extra="forbid", coerce_numbers_to_str=True)

    lesson: Name | None = Field(None, description="Id of a lesson")
    failure: Name | None = Field(None, description="Id of a failure")
    session: LectureRun | None = None
    comparison: LectureComparison | None = None
    question: Name | None = Field(None, description="Id of a lesson whose question the class is asked")
    poll: PollQuestion | None = Field(None, description="A question of one's own")
    answers: PollAnswers | None = Field(None, description="Of the poll")
    title: GivenTitle | None = Field(None, description="Its own, if left out")
    minutes: Minutes | None = Field(None, description="What is usual, if left out")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"an item is one of {', '.join(KINDS)}, got {' and '.join(given) or 'none'}")
        if (self.poll is None) != (self.answers is None):
            raise ValueError("a poll has answers, and nothing else has")
        return self

    @property
    def kind(self) -> Kind:
        """What it is."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)


class LectureUpdate(RequestBody):
    """A lecture as its page sends it; its file has the same, with the notes as its text."""

    title: GivenTitle
    items: list[LectureItem] = Field([], max_length=MOST_ITEMS)
    notes: Annotated[str, Field(max_length=LONGEST_NOTES)] = ""


class LectureItemPublic(BaseModel):
    """What is known of an item."""

    item: dict[str, Any] = Field(description="As it is sent back, a LectureItem")
    kind: Kind
    title: str
    minutes: float = Field(description="How long it takes: what it says, or what is usual")
    page: str | None = Field(description="Where it is shown; null for a poll, which is asked over what is shown")
    asks: PollCreate | None = Field(description="What the class is asked, if it is a poll or a lesson's question")
    problem: str | None = Field(description="Why it cannot be shown here, a sentence with its line in the file")


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
    """All of a lecture."""

    items: list[LectureItemPublic]
    notes: str


Html = Annotated[str, BeforeValidator(inline)]
"""A sentence."""
Paragraphs = Annotated[str, BeforeValidator(paragraphs)]


class _Public(BaseModel):
    model_config = ConfigDict(from_attributes=True)


class CheckPublic(_Public):
    """What a lesson claims and computes."""

    name: str
    title: str


class ScenarioPublic(_Public):
    """A run of an experiment, with the parameters that may be turned."""

    recipe: Recipe
    words: Html = Field("", description="What to look for in it, HTML")
    unlocked: tuple[str, ...]
    frame: int
    plots: tuple[str, ...] = Field(description="Ids of the plots to show; all of them if none is named")
    layers: tuple[str, ...] = Field(description="Names of layers to show beside those that are shown anyway")

    @computed_field(description="Of the experiment")
    def title(self) -> str:
        """Return the experiment's title, or its name where the experiment is not here."""
        name = self.recipe.experiment
        return name if missing(name) else find_experiment(name).title

    @computed_field(description="Why it cannot be run here, one sentence")
    def problem(self) -> str | None:
        """Return why the run cannot be made here."""
        return missing(self.recipe.experiment)


class LessonPublic(_Public):
    """A lesson as the overview shows it."""

    id: str
    number: int = Field(description="Place in the course; 0 for one beside it")
    title: str
    kind: Literal["demonstration", "scenario"]
    origin: str = Field(description="File or package that it comes from; empty for the project's own")
    checks: list[CheckPublic]
    uses: list[ScenarioPublic]
    minutes: float = Field(description="How long it takes a class")
    problem: str | None = Field(description="Why it cannot be run here, one sentence")


class LessonsPublic(BaseModel):
    """All lessons, those of the course first and in its order."""

    lessons: list[LessonPublic]
    problems: list[Problem]


class ChoicePublic(BaseModel):
    """A possible answer."""

    name: str
    words: Html = Field(description="HTML")


def _in_order(choices: dict[str, str] | None) -> list[ChoicePublic]:
    return [ChoicePublic(name=name, words=words) for name, words in (choices or {}).items()]


class QuestionPublic(_Public):
    """What is asked, without its answer."""

    text: Html = Field(description="HTML")
    kind: Literal["number", "choice", "point"]
    unit: str
    bounds: tuple[float, float] = Field(description="Lowest and highest number that is an answer at all")
    choices: Annotated[list[ChoicePublic], BeforeValidator(_in_order)]
    panel: str = Field(description='Of a "point": id of the panel of the figure in which it is placed')
    along: Literal["x", "y"]


class NeighbourPublic(_Public):
    """The lesson before or after."""

    id: str
    number: int
    title: str


class LessonDetail(LessonPublic):
    """A lesson with everything that its page needs; texts are HTML."""

    idea: Paragraphs
    tries: list[Html]
    notice: Html
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
    nearest: bool = Field(False, description="Whether a number out of bounds becomes the nearest allowed one")


class FigurePublic(BaseModel):
    """The figure of a lesson at some parameters."""

    figure: dict[str, Any] = Field(description="As `pftrack.teaching.lessons.Figure` has it")
    numbers: list[Number]
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
    frame: int | None = Field(description="Of a run, where there is one: the frame that shows the answer")
    words: list[Html] = Field(description="The verdict and its reason, HTML")


class ComputingPublic(BaseModel):
    """The run that answers the question is still computed; ask again."""

    done: int
    total: int


class CheckedPublic(BaseModel):
    """What a check came to."""

    check: str
    title: str
    ours: float | None = None
    exact: float | None = None
    tolerance: float | None = None
    passed: bool = False
    problem: str | None = Field(None, description="Why it could not be computed, one sentence")


class ChecksPublic(BaseModel):
    """What the checks came to so far."""

    done: int
    total: int
    results: list[CheckedPublic]


def missing(experiment: str) -> str | None:
    """Return why a run of an experiment cannot be made here, one sentence; None if it can."""
    try:
        find_experiment(experiment)
    except RefusedError:
        return f"The experiment {experiment!r} is not here: it may come from a package that is not installed."
    return None
