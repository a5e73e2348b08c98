"""Polls: one question to the class, one answer a follower, no names; and its answers as a row and as CSV."""

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
            ParameterError: The answer is not one of the list.
        """
        if poll != self.id:
            raise ConflictError("The lecturer asks another question now.")
        if self.revealed:
            raise ConflictError("The answers have been revealed; answering is closed.")
        if not 0 <= answer < len(self.answers):
            raise ParameterError("answer", answer, f"0 to {len(self.answers) - 1}")
        return replace(self, votes={**self.votes, seat: answer})

    def reveal(self) -> Self:
        """Return the poll with its answers for all to see."""
        return replace(self, revealed=True)

    def view(self, *, to_owner: bool) -> PollPublic:
        """Return the poll as lecturer or followers see it; until it is revealed nobody sees what was answered."""
        counts = self.counts
        told = {
            "votes": sum(counts) if to_owner or self.revealed else None,
            "counts": list(counts) if self.revealed else None,
        }
        return PollPublic(**fields_of(PollPublic, self) | told)

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
