"""Follows: all classes of a server. They exist only in its memory: when one ends, only its answers are kept.

The server stores a poll while it is answered, so a crash costs a few seconds of answers. It deletes a poll without
answers, or one that its lecturer withdraws. Seats are never stored.
"""

import asyncio
from collections.abc import Container, Coroutine, Sequence
from datetime import UTC, datetime, timedelta

from sqlalchemy.exc import SQLAlchemyError

from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack_server.core.bodies import printable
from pftrack_server.core.errors import forbidden, gone, not_found, too_many, unavailable
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.resource_limits import most_connections
from pftrack_server.core.settings import Settings
from pftrack_server.sessions.create import new_spec
from pftrack_server.sessions.manager import Manager
from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.store import Store
from pftrack_server.store.database import LectureRow, PollRow
from pftrack_server.teaching import messages
from pftrack_server.teaching.follow import Follow, FollowedContent, Fork, Participant
from pftrack_server.teaching.lessons import Lessons
from pftrack_server.teaching.links import Claim, Links, addresses
from pftrack_server.teaching.polls import Poll

MOST = 50
"""Most classes at one time."""
MOST_POLLS = 5000
"""Most stored polls."""
SOCKETS_SHARE = 0.8
"""Share of the server's connections for followers; the others are the lecturer's."""
FORKS_SHARE = 0.25
"""Share of the server's session places for followers' copies; the others are the lecturer's."""
ROUND_S = 2.0
ENDED = "The lecturer has ended this class."
EXPIRED = "The time of this class is over."
FORGED = "This link was not made by this server; check for a typing mistake, or ask for the link again."

warnings = RateLimitedLogger(__name__)


class PollRecords:
    """The stored polls."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._writing = asyncio.Lock()

    async def check_room(self) -> None:
        """Refuse one more poll if the limit is reached.

        Raises:
            ConflictError: The limit is reached.
        """
        if await asyncio.to_thread(self._store.count, PollRow) >= MOST_POLLS:
            raise ConflictError(f"The server keeps at most {MOST_POLLS:,} polls; export and delete some of them first.")

    async def keep(self, follow: Follow) -> None:
        """Store a class's poll with its answers so far."""
        async with self._writing:
            poll = follow.poll
            if poll is not None and poll is not follow.written and poll.votes and poll.earlier is None:
                await asyncio.to_thread(self._store.save, poll.row(follow.content.title, len(follow.followers)))
                follow.written = poll

    async def try_to_keep(self, follow: Follow) -> None:
        """Store the poll; only log a failure, since the database may be writable again later."""
        try:
            await self.keep(follow)
        except (OSError, SQLAlchemyError) as error:
            warnings.warn("a poll could not be stored", error=str(error))

    async def withdraw(self, poll: Poll) -> None:
        """Delete a poll that is withdrawn before its answers are revealed."""
        async with self._writing:
            await asyncio.to_thread(self._store.remove, PollRow, poll.id)

    async def again(self, name: str) -> Poll:
        """Return a stored poll with its answers revealed.

        Raises:
            ApiError: The poll was deleted (404).
        """
        return Poll.again(await asyncio.to_thread(self._store.find, PollRow, name))

    async def all(self, lecture: str | None, hidden: Container[str]) -> list[messages.PollKept]:
        """Return the stored polls, newest first.

        Args:
            lecture: Name of a lecture; None for all polls.
            hidden: Ids of polls that are not revealed yet.
        """
        rows, lectures = await asyncio.gather(
            asyncio.to_thread(self._store.all, PollRow), asyncio.to_thread(self._store.all, LectureRow)
        )
        titles = {row.id: row.title for row in lectures}
        wanted = (row for row in rows if row.id not in hidden and lecture in {None, row.lecture})
        kept = ((messages.PollKept.model_validate(row), titles.get(row.lecture or "")) for row in wanted)
        return [poll.model_copy(update={"lecture_title": title}) for poll, title in kept]


class Follows:
    """All classes of a server.

    Attributes:
        links: Makes and reads their links.
        records: The stored polls.
    """

    def __init__(self, settings: Settings, manager: Manager, lessons: Lessons, records: PollRecords) -> None:
        self.links, self.records = Links(), records
        self._settings, self._manager, self._lessons = settings, manager, lessons
        self._follows: dict[str, Follow] = {}
        manager.is_followed = lambda name: any(name in follow.content.sessions for follow in self._follows.values())
        self._endings: set[asyncio.Task[None]] = set()
        self._rounds = asyncio.create_task(self._end_unused_forks())

    async def close(self) -> None:
        """End all classes."""
        self._rounds.cancel()
        for follow in self.all:
            self.end(follow, "The server was stopped; ask the lecturer for a new link.")
        await asyncio.gather(self._rounds, *self._endings, return_exceptions=True)

    @property
    def all(self) -> list[Follow]:
        """All classes, newest first."""
        return list(reversed(self._follows.values()))

    def get(self, name: str) -> Follow:
        """Return a class.

        Raises:
            ApiError: The class does not exist (404).
        """
        found = self._follows.get(name)
        if found is None:
            raise not_found("This class does not exist; it may have ended.")
        return found

    def check_room(self) -> None:
        """Refuse one more socket if the followers' share of connections is used up.

        Raises:
            ApiError: The share is used up (429).
        """
        if sum(follow.followers.sockets for follow in self._follows.values()) >= SOCKETS_SHARE * most_connections():
            raise too_many("The server's shell allows it no more connections (ulimit -n). Try again in a while.")

    def resolve(self, link: str) -> tuple[Claim, Follow]:
        """Return the content of a link, and its class.

        Raises:
            ApiError: The class is over (410), or this server did not sign the link (404).
        """
        claim = self.links.read(link)
        if claim is None:
            raise not_found(FORGED)
        follow = self._follows.get(claim.follow)
        if follow is None:
            raise gone("This class is over.")
        return claim, follow

    async def begin(self, wanted: messages.FollowCreate, base: str) -> Follow:
        """Begin a class.

        Args:
            wanted: Content and limits.
            base: Address at which the lecturer's browser reaches the server.

        Raises:
            ConflictError: There are too many classes.
            ApiError: A session or the lesson does not exist (404).
        """
        if len(self._follows) >= MOST:
            raise ConflictError(f"There are already {MOST} classes; end one first.")
        content = FollowedContent(wanted, self._titles(wanted.sessions), await self._lesson(wanted.lesson))
        name = next(name for name in iter(self.links.new_name, None) if name not in self._follows)
        reached = addresses(base, self._settings)
        follow = Follow(name, content, datetime.now(UTC), self.links, reached, self._manager.find)
        self._follows[name] = follow
        self._expire(follow, wanted.hours)
        follow.tell()
        return follow

    async def change(
        self, follow: Follow, wanted: messages.FollowUpdate, participant: Participant | None = None
    ) -> None:
        """Change what a class follows, or its limits.

        Args:
            follow: The class.
            wanted: The changes.
            participant: Who changes it, if it is a person with rights over this class alone.

        Raises:
            ApiError: The class ended meanwhile (410); the participant has no rights over a session (403); a session or
                the lesson does not exist (404).
            RefusedError: Nothing would be left to follow.
        """
        given = wanted.model_fields_set
        lesson = await self._lesson(wanted.lesson)
        if follow.ended is not None:
            raise gone(follow.ended)
        if participant is not None and not participant.reach.steered.issuperset(wanted.sessions):
            raise forbidden("This link gives rights over what the class already follows, and no other session.")
        before = follow.content
        content = FollowedContent(
            before.wanted.model_copy(update={name: getattr(wanted, name) for name in given}),
            self._titles(wanted.sessions) if "sessions" in given else before.sessions,
            lesson if "lesson" in given else before.lesson,
        )
        if not content.sessions and content.lesson is None:
            raise RefusedError("A class follows a session or a lesson; to follow nothing, end the class.")
        if "hours" in given:
            self._expire(follow, wanted.hours)
        follow.show(content)

    def end(self, follow: Follow, sentence: str = ENDED) -> None:
        """End a class for everybody, and end its followers' own sessions."""
        if self._follows.pop(follow.name, None) is None:
            return
        follow.end(sentence)
        self._do(self.records.try_to_keep(follow))
        for name in follow.forks.sessions:
            self._end_session(name)

    async def fork(self, participant: Participant, wanted: messages.ForkCreate) -> Fork:
        """Start a follower's own copy of a session, or let the follower change the lesson's figure.

        Raises:
            ConflictError: The follower already has a copy, or ended it meanwhile.
            ApiError: The class ended meanwhile (410); the follower is not present (403); the class does not follow the
                session, or follows no lesson (404); all places for copies are taken (503).
            ParameterError: The frame has not been computed.
        """
        follow, seat = participant.follow, participant.seat
        follow.check_present(seat)
        if follow.forks.of(seat) is None:  # a second copy is refused with its own message
            self._check_forks()
        if wanted.session is None:
            if follow.content.lesson_id is None:
                raise not_found("The class follows no lesson; name one of its sessions.")
            with follow.forks.reserve(seat) as fork:
                fork.lesson = follow.content.lesson_id
            return fork
        if wanted.session not in follow.content.sessions:
            raise not_found("The class no longer follows this session.")
        spec = _fork_spec(self._manager.get(wanted.session).spec, wanted.frame)
        spec.follow = follow.name
        with follow.forks.reserve(seat) as fork:
            await self._manager.create(spec)
            if follow.ended is not None or follow.forks.of(seat) is not fork:
                self._end_session(spec.id)
                raise gone(follow.ended) if follow.ended else ConflictError("You have ended it in the meantime.")
            fork.session = spec.id
        return fork

    def end_fork(self, participant: Participant) -> None:
        """End a follower's copy."""
        fork = participant.follow.forks.release(participant.seat)
        if fork is not None and fork.session:
            self._end_session(fork.session)

    # ------------------------------------------------------------ polls

    async def ask(
        self, follow: Follow, wanted: messages.PollCreate, participant: Participant | None
    ) -> messages.ComputingPublic | None:
        """Ask a class a question in place of the one before; or return the progress of the run that it needs.

        Args:
            follow: The class.
            wanted: The question.
            participant: Who asks, if it is a person with rights over this class alone.

        Raises:
            ConflictError: The server's limit of polls is reached.
            ApiError: The participant has no rights over stored answers (403); the lesson or the poll does not
                exist (404).
            RefusedError: The lesson's answer cannot be computed.
        """
        if wanted.kept is not None:
            if participant is not None:
                raise forbidden("This link gives rights over this class, not over earlier answers.")
            poll = await self.records.again(wanted.kept)
        else:
            await self.records.check_room()
            asked = await self._question(wanted)
            if isinstance(asked, messages.ComputingPublic):
                return asked
            poll = Poll.ask(*asked, wanted.lecture, wanted.lesson)
        await self.records.keep(follow)
        follow.ask(poll)
        return None

    async def reveal(self, follow: Follow) -> None:
        """Show everybody the counts of the answers.

        Raises:
            ConflictError: The class has no open question.
        """
        if follow.poll is None:
            raise ConflictError("The class has no open question at the moment.")
        follow.ask(follow.poll.reveal())
        await self.records.keep(follow)

    async def close_poll(self, follow: Follow) -> None:
        """Close the poll. Revealed answers are kept; others are deleted."""
        poll = follow.poll
        await self.records.keep(follow)
        follow.ask(None)
        if poll is not None and not poll.revealed:
            await self.records.withdraw(poll)

    async def kept_polls(self, lecture: str | None = None) -> list[messages.PollKept]:
        """Return the stored polls, newest first, except those that are not revealed yet."""
        open_ones = {each.poll.id for each in self.all if each.poll is not None and not each.poll.revealed}
        return await self.records.all(lecture, open_ones)

    # ------------------------------------------------------------ within

    async def _question(self, wanted: messages.PollCreate) -> tuple[str, Sequence[str]] | messages.ComputingPublic:
        """Return a question and its answers."""
        if wanted.lesson is None:
            return wanted.question or "", wanted.answers or ()
        lesson = await self._lessons.get(wanted.lesson)
        answers = await self._lessons.poll_answers(lesson)
        if isinstance(answers, messages.ComputingPublic):
            return answers
        return _plain(lesson.question.text, messages.LONGEST_QUESTION), [
            _plain(each, messages.LONGEST_ANSWER) for each in answers
        ]

    def _titles(self, sessions: Sequence[str]) -> dict[str, str]:
        return {name: self._manager.get(name).snapshot.name for name in sessions}

    async def _lesson(self, wanted: str | None) -> tuple[str, str] | None:
        """Return id and title of a lesson."""
        if wanted is None:
            return None
        found = await self._lessons.get(wanted)
        return found.id, found.title

    def _check_forks(self) -> None:
        most = max(1, int(FORKS_SHARE * self._settings.max_sessions))
        if sum(len(follow.forks) for follow in self._follows.values()) >= most:
            raise unavailable(f"All {most} places for own copies are taken; wait until one is free.")

    def _expire(self, follow: Follow, hours: float) -> None:
        if follow.timer is not None:
            follow.timer.cancel()
        follow.expires = datetime.now(UTC) + timedelta(hours=hours)
        follow.timer = asyncio.get_running_loop().call_later(3600 * hours, self.end, follow, EXPIRED)

    async def _end_unused_forks(self) -> None:
        """End unused copies of followers, and send news of copies that have ended."""
        while True:
            await asyncio.sleep(ROUND_S)
            for follow in self.all:
                await self.records.try_to_keep(follow)
                for name in follow.forks.unused_sessions():
                    self._end_session(name)
                follow.tell()

    def _end_session(self, name: str) -> None:
        found = self._manager.find(name)
        if found is not None:
            self._do(self._manager.end(found))

    def _do(self, work: Coroutine[None, None, None]) -> None:
        """Run work in the background; only the server's end waits for it."""
        task = asyncio.ensure_future(work)
        self._endings.add(task)
        task.add_done_callback(self._endings.discard)


def _plain(markdown: str, longest: int) -> str:
    """Return a sentence of a lesson as plain text, cut to the length that a poll shows."""
    text = printable(markdown.replace("$", "").replace("*", "").replace("`", ""))
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def _fork_spec(source: SessionSpec, wanted: int | None) -> SessionSpec:
    """Return the spec of a session that begins at the shown or an earlier frame of another.

    Raises:
        ParameterError: The frame has not been computed.
    """
    run = source.run
    frame = run.position if wanted is None else wanted
    if frame > run.computed:
        raise ParameterError("frame", frame, f"a frame that has been computed, 0 to {run.computed}")
    # A change takes effect from the next frame, so the copy takes the values of the class's next frame.
    timeline = tuple(change for change in run.recipe.timeline if change.frame <= frame + 1)
    recipe = run.recipe.model_copy(update={"timeline": timeline}).with_footage(truth=source.truth)
    return new_spec(recipe, upload=source.upload, position=frame)
