"""Follows: how a lecturer begins one, sets its limits and asks the class, and what lecturer and followers are told."""

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator
from pydantic_core import to_json

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack_server.core.bodies import FrameNumber, GivenTitle, Name, RequestBody
from pftrack_server.sessions.duplex import Message

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
MostFollowers = Annotated[int, Field(ge=1, le=1000), NOT_BOOLEAN]
MostForks = Annotated[int, Field(ge=0, le=1000), NOT_BOOLEAN]
PollQuestion = Annotated[str, Field(min_length=1, max_length=LONGEST_QUESTION)]
PollAnswer = Annotated[str, Field(min_length=1, max_length=LONGEST_ANSWER)]
PollAnswers = Annotated[list[PollAnswer], Field(min_length=2, max_length=8)]
Hours = Annotated[float, Field(gt=0, le=24, allow_inf_nan=False), NOT_BOOLEAN]


class FollowCreate(RequestBody):
    """What a class is to follow, and its limits."""

    sessions: Followed = Field([], description="One session, or up to four that are compared")
    lesson: Name | None = None
    title: GivenTitle | None = Field(None, description="That of the lesson or the first session, if left out")
    arrangement: Arrangement = Field(
        {}, description="How the lecturer's page arranges them; passed on to the followers' pages"
    )
    most_followers: MostFollowers = 200
    most_forks: MostForks = Field(4, description="Followers who try something of their own at one time")
    hours: Hours = Field(3.0, description="After which it ends by itself")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.sessions and self.lesson is None:
            raise ValueError("Input should name a session or a lesson to follow")
        return self


class FollowUpdate(RequestBody):
    """What changes; what is left out stays."""

    sessions: Followed | None = None
    lesson: Name | None = None
    title: GivenTitle | None = None
    arrangement: Arrangement | None = None
    most_followers: MostFollowers | None = None
    most_forks: MostForks | None = None
    is_open: bool | None = Field(None, description="Whether somebody new may come in")
    hours: Hours | None = Field(None, description="From now on")


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


class VoteRequest(RequestBody):
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
    lesson: str | None = Field(None, description="Whose question it is, if it is a lesson's")


class PollKept(BaseModel):
    """A poll that is over, and how many gave which answer; who did is known to nobody."""

    id: str
    question: str
    answers: list[str]
    counts: list[int] = Field(description="Of each answer")
    votes: int
    followers: int = Field(description="How many were there to answer")
    title: str = Field(description="Of what the class saw")
    lecture: str | None = Field(description="The lecture in which it was asked, if it was in one")
    lecture_title: str | None
    asked: str


class VotePublic(BaseModel):
    """A follower's own answer."""

    poll: str
    answer: int


class ForkPublic(BaseModel):
    """What a follower has: a session, or the lesson."""

    id: str | None = Field(description="Of the session; null for the lesson")
    title: str
    page: str


class MinePublic(BaseModel):
    """What one follower alone is told."""

    fork: ForkPublic | None
    vote: VotePublic | None


class _Follow(BaseModel):
    title: str
    sessions: list[FollowedPublic]
    lesson: str | None
    arrangement: dict[str, Any]
    most_forks: int
    forks: int
    is_open: bool
    expires: str
    poll: PollPublic | None


class FollowPublic(_Follow):
    """What a class follows, as followers see it; `mine` is null in what all are told."""

    mine: MinePublic | None = None


class FollowOwned(_Follow):
    """What a class follows, as the lecturer sees it."""

    id: str
    links: list[LinkPublic] = Field(description="For followers, the best first")
    owner_link: str = Field(
        description="For another device of the lecturer's; it gives the same rights over this alone"
    )
    notice: str | None = Field(description="What keeps others from following, a sentence")
    followers: int
    most_followers: int


class FollowHello(Message):
    """The first message to a follower."""

    type: Literal["hello"] = "hello"
    follow: FollowPublic


class FollowNews(Message):
    """Something has changed for all followers."""

    type: Literal["follow"] = "follow"
    follow: FollowPublic


class FigureShown(Message):
    """The lecturer's lesson shows another figure."""

    type: Literal["figure"] = "figure"
    lesson: str
    figure: dict[str, Any] = Field(description="As the lecturer's page got it")


class OwnedHello(Message):
    """The first message to a lecturer."""

    type: Literal["hello"] = "hello"
    follow: FollowOwned


class OwnedNews(Message):
    """Something has changed for the lecturer."""

    type: Literal["follow"] = "follow"
    follow: FollowOwned
