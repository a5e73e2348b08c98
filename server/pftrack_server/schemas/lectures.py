"""Lectures: what one consists of, as its file and its page have it, and what is known of each item."""

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack_server.core.bodies import FrameNumber, GivenTitle, Name, RequestBody
from pftrack_server.schemas.follows import PollAnswers, PollQuestion
from pftrack_server.work.sources import ComparedRun

Kind = Literal["lesson", "failure", "session", "comparison", "question", "poll"]
KINDS: tuple[Kind, ...] = ("lesson", "failure", "session", "comparison", "question", "poll")
MOST_ITEMS = 100
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

    # Whoever writes a file may name a lesson by its number, and may have answers that are numbers.
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
    notes: Annotated[str, Field(max_length=10_000)] = ""


class LectureAsks(BaseModel):
    """What the class is asked at an item, as it is sent to ask it."""

    question: str | None = None
    answers: list[str] | None = None
    lesson: str | None = None
    lecture: str


class LectureItemPublic(BaseModel):
    """What is known of an item."""

    item: dict[str, Any] = Field(description="As it is sent back, a LectureItem")
    kind: Kind
    title: str
    minutes: float = Field(description="How long it takes: what it says, or what is usual")
    page: str | None = Field(description="Where it is shown; null for a poll, which is asked over what is shown")
    asks: LectureAsks | None = Field(description="What the class is asked, if it is a poll or a lesson's question")
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
