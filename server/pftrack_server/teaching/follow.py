"""A follow: one class with its content, its followers, their copies, and the messages to each.

A follower is present while one of the follower's sockets is open. A *fork* is a follower's own copy of a session or of
the lesson. It ends after some time without use; a session's fork also ends with the session.
"""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Iterator, MutableMapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, NamedTuple, TypeAlias

from pftrack.core.refusal import ConflictError
from pftrack_server.core.base_path import GUEST, LINKS
from pftrack_server.core.errors import forbidden, too_many
from pftrack_server.sessions.duplex import Listener, Listeners, encode
from pftrack_server.sessions.session import Session
from pftrack_server.teaching import messages
from pftrack_server.teaching.links import NOTICE, Address, Claim, Links
from pftrack_server.teaching.polls import Poll
from pftrack_server.teaching.roles import Reach, Standing, is_allowed

LECTURER = ""
"""The seat of everybody who comes by the lecturer's link."""
MOST_SOCKETS = 24
"""Most sockets of one follower: enough for two pages with four sessions each."""
MOST_SCENES = 20
"""Most 3-D scenes of one class: viser encodes for each browser separately, which costs many times a shared drawing."""
SCENES = "/viz/"
UNUSED_S = 300.0
"""Time without use after which a fork ends, s."""


FindSession: TypeAlias = Callable[[str], Session | None]


class _Socket(NamedTuple):
    path: str
    hold: asyncio.Timeout


class Followers:
    """The present followers of a class, by their sockets; the lecturer has sockets here but is not counted.

    Args:
        changed: Called when a follower arrives or leaves.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._sockets: dict[str, set[_Socket]] = {}

    def __len__(self) -> int:
        """Return the number of present followers."""
        return len(self._sockets.keys() - {LECTURER})

    def __contains__(self, seat: str) -> bool:
        """Return whether a follower is present."""
        return seat in self._sockets

    @property
    def sockets(self) -> int:
        """Number of sockets, including the lecturer's."""
        return sum(map(len, self._sockets.values()))

    @contextmanager
    def take(self, seat: str, path: str, most: int) -> Iterator[asyncio.Timeout]:
        """Hold one more socket for a seat.

        Args:
            seat: The follower's seat.
            path: Path of the socket.
            most: Limit of followers.

        Yields:
            The timeout context in which to serve the socket; it expires when the follower must leave.

        Raises:
            ApiError: The class is full, or this follower has too many sockets (429).
        """
        self._check_room(seat, path, most)
        held = self._sockets.setdefault(seat, set())
        socket = _Socket(path, asyncio.timeout(None))
        held.add(socket)
        if len(held) == 1:
            self._changed()
        try:
            yield socket.hold
        finally:
            held.discard(socket)
            if not held:
                del self._sockets[seat]
                self._changed()

    def review(self, may_stay: Callable[[str, str], bool]) -> None:
        """End every socket that may not stay, by seat and path; one that is already ending is left alone."""
        now = asyncio.get_running_loop().time()
        for seat, sockets in self._sockets.items():
            for socket in sockets:
                if not (socket.hold.expired() or may_stay(seat, socket.path)):
                    socket.hold.reschedule(now)

    def _check_room(self, seat: str, path: str, most: int) -> None:
        if seat not in {LECTURER, *self._sockets} and len(self) >= most:
            raise too_many(f"The class has its limit of followers, {most}. Try again in a while.")
        if len(self._sockets.get(seat, ())) >= MOST_SOCKETS:
            raise too_many(f"This browser already has {MOST_SOCKETS} connections; close other class pages.")
        held = [socket for sockets in self._sockets.values() for socket in sockets]
        if path.startswith(SCENES) and sum(socket.path.startswith(SCENES) for socket in held) >= MOST_SCENES:
            raise too_many(f"{MOST_SCENES} followers already watch the 3-D scene; use the flat view.")


@dataclass(slots=True)
class Fork:
    """A follower's own copy, or the place reserved for one.

    Attributes:
        session: Name of the session, once there is one.
        lesson: Id of the lesson.
        used: Time of the last request to it (monotonic, s).
    """

    session: str | None = None
    lesson: str | None = None
    used: float = 0.0


class Forks:
    """The forks of one class, at most one per follower.

    Args:
        find: Finds a session by its name; a fork whose session has ended does not count.
        changed: Called when a fork is added or removed.
    """

    def __init__(self, find: FindSession, changed: Callable[[], None]) -> None:
        self._find = find
        self._changed = changed
        self._forks: dict[str, Fork] = {}

    def __len__(self) -> int:
        """Return the number of forks, including reserved ones."""
        return len(self._active())

    @property
    def sessions(self) -> list[str]:
        """Names of the forks' sessions."""
        return [fork.session for fork in self._active().values() if fork.session]

    def of(self, seat: str) -> Fork | None:
        """Return a follower's fork, or None."""
        return self._active().get(seat)

    def unused_sessions(self) -> list[str]:
        """Return the names of forked sessions without use for `IDLE_S` seconds."""
        now = time.monotonic()
        for fork in self._forks.values():
            found = self._find(fork.session) if fork.session else None
            if found is not None and found.visitors:
                fork.used = now
        return [fork.session for fork in self._forks.values() if fork.session and now - fork.used >= UNUSED_S]

    def touch(self, seat: str, path: str) -> None:
        """Note that a follower uses the fork, if the path of a request names it."""
        fork = self.of(seat)
        if fork is not None and {fork.session, fork.lesson} & set(path.split("/")):
            fork.used = time.monotonic()

    @contextmanager
    def reserve(self, seat: str) -> Iterator[Fork]:
        """Yield a fork for a follower; it is removed afterwards unless it was given a session or a lesson.

        Raises:
            ConflictError: The follower already has a fork.
        """
        self._forks = self._active()
        if seat in self._forks:
            raise ConflictError("You already have a copy; end it first.")
        fork = self._forks[seat] = Fork(used=time.monotonic())
        self._changed()
        try:
            yield fork
        finally:
            if not (fork.session or fork.lesson) and self._forks.get(seat) is fork:
                del self._forks[seat]
            self._changed()

    def release(self, seat: str) -> Fork | None:
        """Remove and return a follower's fork."""
        fork = self._forks.pop(seat, None)
        self._changed()
        return fork

    def _active(self) -> dict[str, Fork]:
        return {seat: fork for seat, fork in self._forks.items() if self._is_active(fork)}

    def _is_active(self, fork: Fork) -> bool:
        if fork.session:
            return self._find(fork.session) is not None
        return not fork.lesson or time.monotonic() - fork.used < UNUSED_S


class NewestListener(Listener):
    """One page's listener: it yields the newest message of each kind at its own pace, and skips older ones.

    Args:
        greeting: Encodes the first message.
        news: The newest text of each kind, encoded once for all pages; it stays the same object until there is a new
            text.
    """

    def __init__(self, greeting: Callable[[], str], news: dict[str, str]) -> None:
        super().__init__()
        self._greeting = greeting
        self._news = news

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages as they arrive, the greeting first."""
        told = {"follow": self._news.get("follow", "")}
        yield self._greeting()
        while True:
            await self.news.wait()
            self.news.clear()
            for kind, text in list(self._news.items()):
                if told.get(kind) != text:
                    told[kind] = text
                    yield text
            if self.closed:
                return


class _Audience(Listeners[NewestListener]):
    """Pages that get the same messages."""

    def __init__(self) -> None:
        super().__init__()
        self.news: dict[str, str] = {}

    def greet(self, greeting: Callable[[], str]) -> AbstractContextManager[NewestListener]:
        """Add a page while the context lasts."""
        return self.add(NewestListener(greeting, self.news))

    def tell(self, kind: str, text: str) -> None:
        """Send a message to all pages, unless it equals the last one of its kind."""
        if self.news.get(kind) != text:
            self.news[kind] = text
            for listener in self:
                listener.news.set()


@dataclass(frozen=True, slots=True)
class FollowedContent:
    """The content that a class follows.

    Attributes:
        wanted: The lecturer's request.
        sessions: Titles of the sessions, by name.
        lesson: Id and title of the lesson, if there is one.
    """

    wanted: messages.FollowUpdate
    sessions: dict[str, str]
    lesson: tuple[str, str] | None

    @property
    def title(self) -> str:
        """Title of the content."""
        return self.wanted.title or (self.lesson[1] if self.lesson else next(iter(self.sessions.values())))

    @property
    def lesson_id(self) -> str | None:
        """Id of the lesson, if there is one."""
        return self.lesson and self.lesson[0]


class Follow:
    """One class; call all methods in the event loop's thread.

    Args:
        name: The beginning of its links.
        content: The content that it follows.
        expires: When it ends by itself.
        links: The server's links.
        addresses: Addresses of the server, the best first.
        find: Finds a session by its name.

    Attributes:
        content: The content that it follows; `show` changes it.
        followers: The present followers.
        forks: The followers' own copies.
        poll: The open poll; `ask` changes it.
        written: The poll as it was last stored.
        ended: Why it has ended, a sentence; None while it runs.
        timer: The timer that ends it.
    """

    timer: asyncio.TimerHandle | None = None

    def __init__(
        self,
        name: str,
        content: FollowedContent,
        expires: datetime,
        links: Links,
        addresses: list[Address],
        find: FindSession,
    ) -> None:
        self.name, self.expires = name, expires
        self.followers = Followers(self.tell)
        self.forks = Forks(find, self.tell)
        self.written: Poll | None = None
        self.ended: str | None = None
        self.content = content
        self.poll: Poll | None = None
        self._links, self._addresses, self._find = links, addresses, find
        self._class, self._lecturers = _Audience(), _Audience()
        self.tell()

    # ------------------------------------------------------------ rights

    def reach(self, role: Standing, seat: str) -> Reach:
        """Return the names that a role and seat may use in addresses."""
        followed = frozenset(self.content.sessions)
        lesson = self.content.lesson_id
        lessons = frozenset({lesson} if lesson else ())
        if role == "owner":
            return Reach(followed, followed, lessons, lessons, frozenset({self.name}))
        fork = self.forks.of(seat) or Fork()
        own = frozenset({fork.session} if fork.session else ())
        tried = frozenset({lesson} if lesson and fork.lesson == lesson else ())
        return Reach(followed | own, own, lessons, tried, frozenset())

    def end(self, sentence: str) -> None:
        """End the class for everybody."""
        self.ended = sentence
        if self.timer is not None:
            self.timer.cancel()
        self._lecturers.close()
        self.followers.review(lambda *_: False)

    # ------------------------------------------------------------ for lecturers

    def show(self, content: FollowedContent) -> None:
        """Change the content or its arrangement; sockets on content that is no longer followed end."""
        if content.lesson != self.content.lesson:
            self._class.news.pop("figure", None)
        self.content = content
        self.tell()
        self.followers.review(self._may_stay)

    def show_figure(self, lesson: str, figure: bytes) -> None:
        """Send the followed lesson's figure on, as unread JSON."""
        text = f'{{"version":1,"type":"figure","lesson":{json.dumps(lesson)},"figure":{figure.decode()}}}'
        self._class.tell("figure", text)

    def ask(self, poll: Poll | None) -> None:
        """Open, update or close the class's poll."""
        self.poll = poll
        self.tell()

    # ------------------------------------------------------------ for followers

    def check_present(self, seat: str) -> None:
        """Refuse a follower who is not present.

        Raises:
            ApiError: The follower is not present (403).
        """
        if seat not in self.followers:
            raise forbidden("Only followers can do this; open the link of the class first.")

    def vote(self, seat: str, vote: messages.Vote) -> messages.Vote:
        """Take a follower's answer and return it.

        Raises:
            ConflictError: There is no open question, or another one.
            ApiError: The follower is not present (403).
            RefusedError: The answer is not one of the list.
        """
        self.check_present(seat)
        if self.poll is None:
            raise ConflictError("The class has no open question at the moment.")
        self.ask(self.poll.vote(seat, vote.poll, vote.answer))
        return vote

    # ------------------------------------------------------------ messages

    def listen(self, seat: str) -> AbstractContextManager[NewestListener]:
        """Add a follower's page while the context lasts."""
        return self._class.greet(lambda: encode(messages.FollowNews(type="hello", follow=self.view(seat))))

    def listen_as_lecturer(self) -> AbstractContextManager[NewestListener]:
        """Add a lecturer's page while the context lasts."""
        return self._lecturers.greet(lambda: encode(messages.OwnedNews(type="hello", follow=self.owner_view())))

    def tell(self) -> None:
        """Send lecturers and followers the state, if it has changed."""
        self._class.tell("follow", encode(messages.FollowNews(follow=self.view())))
        self._lecturers.tell("follow", encode(messages.OwnedNews(follow=self.owner_view())))

    def view(self, seat: str | None = None) -> messages.FollowPublic:
        """Return the view of all followers, or of one seat."""
        return messages.FollowPublic(
            **self._shared_fields(to_owner=False), mine=None if seat is None else self._own_view(seat)
        )

    def owner_view(self) -> messages.FollowOwned:
        """Return the lecturer's view."""
        best = self._addresses[0]
        return messages.FollowOwned(
            **self._shared_fields(to_owner=True),
            id=self.name,
            links=[
                messages.LinkPublic(address=self._link(each, "follower"), everybody=each.everybody)
                for each in self._addresses
            ],
            owner_link=self._link(best, "owner"),
            notice=None if best.everybody else NOTICE,
            followers=len(self.followers),
            most_followers=self.content.wanted.most_followers,
            forks=len(self.forks),
        )

    def _link(self, address: Address, role: Literal["owner", "follower"]) -> str:
        return f"{address.base}{LINKS}/{self._links.of(self.name, role)}"

    def _shared_fields(self, *, to_owner: bool) -> dict[str, Any]:
        content = self.content
        return {
            "title": content.title,
            "sessions": [messages.FollowedPublic(id=name, title=title) for name, title in content.sessions.items()],
            "lesson": content.lesson_id,
            "arrangement": content.wanted.arrangement,
            "expires": self.expires.isoformat(timespec="seconds"),
            "poll": self.poll and self.poll.view(to_owner=to_owner),
        }

    def _own_view(self, seat: str) -> messages.MinePublic:
        fork = self.forks.of(seat)
        is_made = fork is not None and (fork.session or fork.lesson)
        vote = self.poll.votes.get(seat) if self.poll else None
        return messages.MinePublic(
            fork=self.fork_view(fork) if fork and is_made else None,
            vote=messages.Vote(poll=self.poll.id, answer=vote) if self.poll and vote is not None else None,
        )

    def fork_view(self, fork: Fork) -> messages.ForkPublic:
        """Return a follower's view of a fork."""
        if fork.session is None:
            return messages.ForkPublic(id=None, title=self.content.title, page=f"learn/{fork.lesson}")
        found = self._find(fork.session)
        title = found.snapshot.name if found else ""
        return messages.ForkPublic(id=fork.session, title=title, page=f"session/{fork.session}")

    def _may_stay(self, seat: str, path: str) -> bool:
        role: Standing = "owner" if seat == LECTURER else "follower"
        return is_allowed(role, self.reach(role, seat), "WS", path)


class Participant(NamedTuple):
    """A person who came by the link of a class.

    Attributes:
        follow: The class.
        claim: Content of the link.
        seat: The follower's name within it; empty for an owner.
        role: The participant's role.
    """

    follow: Follow
    claim: Claim
    seat: str
    role: Standing

    @property
    def reach(self) -> Reach:
        """The names that the participant may use in addresses now."""
        return self.follow.reach(self.role, self.seat)

    @property
    def about(self) -> str:
        """Attributes that describe the participant to a page's scripts."""
        return f'data-role="{self.claim.role}" data-class="{self.claim.follow}"'

    def may_steer(self, session: str) -> bool:
        """Return whether the participant may steer a session, not only watch it."""
        return session in self.reach.steered


def participant_of(scope: MutableMapping[str, Any]) -> Participant | None:
    """Return the participant who came by a link; None for a client with the rights of the whole server."""
    found: Participant | None = scope.get(GUEST)
    return found
