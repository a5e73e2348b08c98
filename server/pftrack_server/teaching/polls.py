"""Polls: one question to the class, one answer a follower, no names; and the answers, kept beyond the class.

Nobody keeps seats. The server writes a poll down while it is answered, so a crash costs a few seconds of answers; it
forgets a poll that nobody has answered, or that its lecturer has withdrawn.
"""

import asyncio
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

from sqlalchemy.exc import SQLAlchemyError

from pftrack.core.files import csv_text
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack_server.core.errors import NotFoundError
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.store import Store
from pftrack_server.store.database import LectureRow, PollRow
from pftrack_server.store.files import new_name, now
from pftrack_server.teaching.messages import PollKept, PollPublic

if TYPE_CHECKING:
    from pftrack_server.teaching.follow import Follow

MOST = 5000
"""Polls kept."""
HEAD = ("asked", "lecture", "shown", "question", "answer", "votes", "share_percent", "answered", "followers")

warnings = RateLimitedLogger(__name__)


@dataclass(frozen=True, slots=True)
class Poll:
    """A question and the answers to it.

    Attributes:
        id: Its name, so that an answer to an earlier question does not count for this one.
        question: Of the lecturer.
        answers: To choose from.
        votes: Place of the answer by seat.
        revealed: Whether the class sees what was answered; then it answers no longer.
        lecture: In which lecture it is asked, if it is in one.
        lesson: Whose question it is, if it is a lesson's.
        asked: When.
        earlier: How many gave which answer, of one that is shown again; None of one that is asked now.
    """

    id: str
    question: str
    answers: tuple[str, ...]
    votes: Mapping[str, int] = field(default_factory=dict)
    revealed: bool = False
    lecture: str | None = None
    lesson: str | None = None
    asked: str = field(default_factory=now)
    earlier: tuple[int, ...] | None = None

    @classmethod
    def ask(cls, question: str, answers: Sequence[str], lecture: str | None = None, lesson: str | None = None) -> Self:
        """Return a poll that nobody has answered."""
        return cls(new_name(), question, tuple(answers), lecture=lecture, lesson=lesson)

    @classmethod
    def again(cls, row: PollRow) -> Self:
        """Return a poll that was kept, with its answers for all to see."""
        answers, counts = tuple(row.answers), tuple(row.counts)
        return cls(row.id, row.question, answers, revealed=True, lecture=row.lecture, asked=row.created, earlier=counts)

    @property
    def counts(self) -> tuple[int, ...]:
        """How many gave which answer."""
        if self.earlier is not None:
            return self.earlier
        chosen = list(self.votes.values())
        return tuple(chosen.count(place) for place in range(len(self.answers)))

    def vote(self, seat: str, poll: str, answer: int) -> Self:
        """Return the poll with one follower's answer, in place of an earlier one.

        Raises:
            ConflictError: It is another question, or its answers have been revealed.
            RefusedError: There is no such answer.
        """
        if poll != self.id:
            raise ConflictError("The lecturer asks another question now.")
        if self.revealed:
            raise ConflictError("The answers have been revealed; answering is closed.")
        if not 0 <= answer < len(self.answers):
            bound = f"0 to {len(self.answers) - 1}"
            raise RefusedError(f"answer must be {bound}, got {answer}", field="answer", bound=bound, value=answer)
        return replace(self, votes={**self.votes, seat: answer})

    def reveal(self) -> Self:
        """Return the poll with its answers for all to see."""
        return replace(self, revealed=True)

    def view(self, *, to_owner: bool) -> PollPublic:
        """Return the poll as lecturer or followers see it; until it is revealed nobody sees what was answered."""
        counts = self.counts
        return PollPublic(
            id=self.id,
            question=self.question,
            answers=list(self.answers),
            votes=sum(counts) if to_owner or self.revealed else None,
            counts=list(counts) if self.revealed else None,
            revealed=self.revealed,
            lesson=self.lesson,
        )

    def row(self, title: str, followers: int) -> PollRow:
        """Return what is kept of it: no seat is in it.

        Args:
            title: Of what the class sees.
            followers: How many are there.
        """
        return PollRow(
            id=self.id,
            lecture=self.lecture,
            title=title,
            question=self.question,
            answers=list(self.answers),
            counts=list(self.counts),
            followers=max(followers, len(self.votes)),
            created=self.asked,
        )


class PollRecords:
    """The polls that are kept."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._writing = asyncio.Lock()

    async def check_room(self) -> None:
        """Refuse one more poll where as many are kept as may be.

        Raises:
            ConflictError: There are.
        """
        if await asyncio.to_thread(self._store.count, PollRow) >= MOST:
            raise ConflictError(f"The server keeps at most {MOST:,} polls; export and delete some of them first.")

    async def keep(self, follow: "Follow") -> None:
        """Write down what a class is asked, as far as it is answered."""
        async with self._writing:
            poll = follow.poll
            if poll is not None and poll is not follow.written and poll.votes and poll.earlier is None:
                await asyncio.to_thread(self._store.save, poll.row(follow.content.title, len(follow.followers)))
                follow.written = poll

    async def try_to_keep(self, follow: "Follow") -> None:
        """Do the same where nobody waits for it: a database that cannot be written now may be able to later."""
        try:
            await self.keep(follow)
        except (OSError, SQLAlchemyError) as error:
            warnings.warn("a poll could not be written down", error=str(error))

    async def withdraw(self, poll: Poll) -> None:
        """Forget what was written down of a poll that is withdrawn before anybody sees what was answered."""
        async with self._writing:
            await asyncio.to_thread(self._store.remove, PollRow, poll.id)

    async def remove(self, name: str) -> None:
        """Forget a poll.

        Raises:
            NotFoundError: There is none.
        """
        if not await asyncio.to_thread(self._store.remove, PollRow, name):
            raise NotFoundError("There is no such poll; it may have been deleted.")

    async def again(self, name: str) -> Poll:
        """Return a poll that was kept, with its answers for all to see.

        Raises:
            NotFoundError: There is none.
        """
        row = await asyncio.to_thread(self._store.get, PollRow, name)
        if row is None:
            raise NotFoundError("There is no such poll; it may have been deleted.")
        return Poll.again(row)

    async def all(self, lecture: str | None, hidden: Container[str]) -> list[PollKept]:
        """Return what was answered, the newest first.

        Args:
            lecture: That of one lecture; None for all.
            hidden: Polls that are not revealed yet.
        """
        rows, lectures = await asyncio.gather(
            asyncio.to_thread(self._store.all, PollRow), asyncio.to_thread(self._store.all, LectureRow)
        )
        titles = {row.id: row.title for row in lectures}
        wanted = (row for row in rows if row.id not in hidden and lecture in {None, row.lecture})
        return [PollKept.model_validate(row).titled(titles.get(row.lecture or "")) for row in wanted]


def polls_csv(polls: list[PollKept]) -> str:
    """Return polls as CSV, a row for each answer."""
    rows = [
        (
            poll.asked,
            poll.lecture_title or "",
            poll.title,
            poll.question,
            answer,
            str(count),
            f"{100 * count / poll.votes:.1f}" if poll.votes else "",
            str(poll.votes),
            str(poll.followers),
        )
        for poll in polls
        for answer, count in zip(poll.answers, poll.counts, strict=False)
    ]
    return csv_text([HEAD, *rows])
