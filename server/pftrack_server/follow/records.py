"""Records: what classes were asked and how many gave which answer, kept beyond the class and the server's life.

Seats are kept nowhere. A poll is written down while it is answered, so that a crash costs a few seconds of answers;
what nobody has answered, and what its lecturer has withdrawn, is not kept.
"""

import asyncio
from collections.abc import Container

from sqlalchemy.exc import SQLAlchemyError

from pftrack.core.files import csv_text
from pftrack.core.refusal import ConflictError
from pftrack_server.core.errors import NotFoundError
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.follow.follow import Follow
from pftrack_server.follow.poll import Poll
from pftrack_server.schemas.follows import PollKept
from pftrack_server.store import Store
from pftrack_server.store.tables import LectureRow, PollRow

MOST = 5000
"""Polls kept."""
HEAD = ("asked", "lecture", "shown", "question", "answer", "votes", "share_percent", "answered", "followers")

warnings = RateLimitedLogger(__name__)


class PollRecords:
    """The polls that are kept."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._writing = asyncio.Lock()
        self._written: dict[str, Poll] = {}

    async def check_room(self) -> None:
        """Refuse one more poll where as many are kept as may be.

        Raises:
            ConflictError: There are.
        """
        if await asyncio.to_thread(self._store.count, PollRow) >= MOST:
            raise ConflictError(f"The server keeps at most {MOST:,} polls; export and delete some of them first.")

    async def keep(self, follow: Follow) -> None:
        """Write down what a class is asked, as far as it is answered."""
        async with self._writing:
            poll = follow.poll
            is_new = poll is not self._written.get(follow.name)
            if poll is not None and is_new and poll.votes and poll.earlier is None:
                await asyncio.to_thread(self._store.save, poll.row(follow.content.title, len(follow.places)))
                self._written[follow.name] = poll
            if follow.ended is not None:
                self._written.pop(follow.name, None)

    async def try_to_keep(self, follow: Follow) -> None:
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
        return [
            PollKept(
                id=row.id,
                question=row.question,
                answers=row.answers,
                counts=row.counts,
                votes=sum(row.counts),
                followers=row.followers,
                title=row.title,
                lecture=row.lecture,
                lecture_title=titles.get(row.lecture or ""),
                asked=row.created,
            )
            for row in wanted
        ]


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
