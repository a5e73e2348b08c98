"""Polls: one question to the class, one answer per follower, no names; and the answers as a row and as CSV."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from pftrack.core.files import csv_text
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack_server.core.bodies import fields_of
from pftrack_server.store.database import PollRow
from pftrack_server.store.files import new_name, now
from pftrack_server.teaching.messages import PollKept, PollPublic

HEAD = ("asked", "lecture", "shown", "question", "answer", "votes", "share_percent", "answered", "followers")


@dataclass(frozen=True, slots=True)
class Poll:
    """A question and the answers to it.

    Attributes:
        id: Its name, so that an answer to an earlier question does not count for this one.
        question: The question.
        answers: The answers to choose from.
        votes: Index of the answer, by seat.
        revealed: Whether the class sees the answers; answering is then closed.
        lecture: The lecture in which it is asked, if any.
        lesson: The lesson that the question comes from, if any.
        asked: When it was asked.
        earlier: Stored votes for each answer of a poll that is shown again; None for an open poll.
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
        """Return a new poll without answers."""
        return cls(new_name(), question, tuple(answers), lecture=lecture, lesson=lesson)

    @classmethod
    def again(cls, row: PollRow) -> Self:
        """Return a stored poll with its answers revealed."""
        answers, counts = tuple(row.answers), tuple(row.counts)
        return cls(row.id, row.question, answers, revealed=True, lecture=row.lecture, asked=row.created, earlier=counts)

    @property
    def counts(self) -> tuple[int, ...]:
        """Votes for each answer."""
        if self.earlier is not None:
            return self.earlier
        chosen = list(self.votes.values())
        return tuple(chosen.count(place) for place in range(len(self.answers)))

    def vote(self, seat: str, poll: str, answer: int) -> Self:
        """Return the poll with a follower's answer, in place of an earlier one.

        Raises:
            ConflictError: The vote is for another question, or the answers have been revealed.
            ParameterError: The answer is not one of the list.
        """
        if poll != self.id:
            raise ConflictError("The lecturer has asked another question.")
        if self.revealed:
            raise ConflictError("The answers have been revealed; answering is closed.")
        if not 0 <= answer < len(self.answers):
            raise ParameterError("answer", answer, f"0 to {len(self.answers) - 1}")
        return replace(self, votes={**self.votes, seat: answer})

    def reveal(self) -> Self:
        """Return the poll with its answers revealed."""
        return replace(self, revealed=True)

    def view(self, *, to_owner: bool) -> PollPublic:
        """Return the view of the lecturer or the followers; until the poll is revealed it hides the answers."""
        counts = self.counts
        told = {
            "votes": sum(counts) if to_owner or self.revealed else None,
            "counts": list(counts) if self.revealed else None,
        }
        return PollPublic(**fields_of(PollPublic, self) | told)

    def row(self, title: str, followers: int) -> PollRow:
        """Return the poll's row in the database, which contains no seats.

        Args:
            title: Title of the content that the class sees.
            followers: Number of present followers.
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


def polls_csv(polls: list[PollKept]) -> str:
    """Return polls as CSV, one row per answer."""
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
