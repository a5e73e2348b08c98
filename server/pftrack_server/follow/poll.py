"""A poll: one question to the class, one answer a follower, and no names."""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from pftrack_server.errors import ConflictError, RefusedError
from pftrack_server.schemas.follows import PollPublic

__all__ = ["Poll"]


@dataclass(frozen=True, slots=True)
class Poll:
    """A question and the answers to it.

    Attributes:
        id: Its name, so that an answer to an earlier question does not count for this one.
        question: Of the lecturer.
        answers: To choose from.
        votes: Place of the answer by seat.
        revealed: Whether the class sees what was answered; then it answers no longer.
    """

    id: str
    question: str
    answers: tuple[str, ...]
    votes: Mapping[str, int] = field(default_factory=dict)
    revealed: bool = False

    @classmethod
    def ask(cls, question: str, answers: Sequence[str]) -> Self:
        """Return a poll that nobody has answered."""
        return cls(secrets.token_hex(4), question, tuple(answers))

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
        chosen = list(self.votes.values())
        counts = [chosen.count(place) for place in range(len(self.answers))]
        return PollPublic(
            id=self.id,
            question=self.question,
            answers=list(self.answers),
            votes=len(chosen) if to_owner or self.revealed else None,
            counts=counts if self.revealed else None,
            revealed=self.revealed,
        )
