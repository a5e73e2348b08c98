"""A follow: what one class sees, who is there, what it is asked, and what each is told of it."""

import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from pftrack.core.refusal import ConflictError
from pftrack_server.core.errors import ForbiddenError
from pftrack_server.follow.addresses import NOTICE, Address
from pftrack_server.follow.forks import Fork, Forks
from pftrack_server.follow.links import PREFIX, Links
from pftrack_server.follow.listeners import NewestListener
from pftrack_server.follow.places import LECTURER, Places
from pftrack_server.follow.poll import Poll
from pftrack_server.follow.roles import Reach, Standing, is_allowed
from pftrack_server.schemas import follows as schemas
from pftrack_server.sessions.duplex import Listeners, encode


@dataclass(frozen=True, slots=True)
class FollowedContent:
    """What a class follows.

    Attributes:
        named: What the lecturer calls it, if anything.
        sessions: Titles by name.
        lesson: Id and title, if one is followed.
        arrangement: Of the lecturer's page, passed on as it is.
    """

    named: str | None
    sessions: Mapping[str, str]
    lesson: tuple[str, str] | None
    arrangement: Mapping[str, Any]

    @property
    def title(self) -> str:
        """What it is called."""
        return self.named or (self.lesson[1] if self.lesson else next(iter(self.sessions.values())))

    @property
    def lesson_id(self) -> str | None:
        """Which lesson is followed, if one is."""
        return self.lesson and self.lesson[0]


class Follow:
    """One class; all methods belong to the event loop's thread.

    Args:
        name: The beginning of its links.
        shown: What it follows.
        links: Those of the server.
        addresses: Where the server is reached, the best first.
        title_of: Returns the title of a session, None if there is none.

    Attributes:
        places: Who is there.
        forks: Sessions of followers' own.
        expires: When it ends by itself.
        ended: Why it has ended, a sentence; None while it lasts.
    """

    def __init__(
        self,
        name: str,
        shown: FollowedContent,
        limits: schemas.FollowCreate,
        expires: datetime,
        links: Links,
        addresses: list[Address],
        title_of: Callable[[str], str | None],
    ) -> None:
        self.name, self.expires = name, expires
        self.places = Places(limits.most_followers, self.tell)
        self.forks = Forks(limits.most_forks, lambda session: title_of(session) is not None, self.tell)
        self.ended: str | None = None
        self._shown = shown
        self._poll: Poll | None = None
        self._links, self._addresses, self._title_of = links, addresses, title_of
        self._followers: Listeners[NewestListener] = Listeners()
        self._lecturers: Listeners[NewestListener] = Listeners()
        self._news: dict[str, str] = {}
        self._news_of_lecturers: dict[str, str] = {}
        self.tell()

    # ------------------------------------------------------------ who may what

    def reach(self, role: Standing, seat: str) -> Reach:
        """Return what somebody may name in an address."""
        followed = frozenset(self._shown.sessions)
        lesson = self._shown.lesson_id
        lessons = frozenset({lesson} if lesson else ())
        if role == "owner":
            return Reach(followed, followed, lessons, lessons, frozenset({self.name}))
        fork = self.forks.of(seat) or Fork()
        own = frozenset({fork.session} if fork.session else ())
        tried = frozenset({lesson} if lesson and fork.lesson == lesson else ())
        return Reach(followed | own, own, lessons, tried, frozenset())

    def end(self, sentence: str) -> None:
        """Send everybody away."""
        self.ended = sentence
        self._lecturers.close()
        self.places.review(lambda *_: False)

    # ------------------------------------------------------------ what a lecturer does

    @property
    def content(self) -> FollowedContent:
        """What it follows."""
        return self._shown

    def show(self, shown: FollowedContent) -> None:
        """Let the class follow something else, or otherwise; who looked at what is not followed any more must leave."""
        if shown.lesson != self._shown.lesson:
            self._news.pop("figure", None)
        self._shown = shown
        self.tell()
        self.places.review(self._may_stay)

    def show_figure(self, lesson: str, figure: bytes) -> None:
        """Pass on the figure of the lesson that is followed, as JSON, unread."""
        self._news["figure"] = (
            f'{{"version":1,"type":"figure","lesson":{json.dumps(lesson)},"figure":{figure.decode()}}}'
        )
        _wake(self._followers)

    @property
    def poll(self) -> Poll | None:
        """What the class is asked."""
        return self._poll

    def ask(self, poll: Poll | None) -> None:
        """Ask the class something, reveal what it answered, or ask nothing more."""
        self._poll = poll
        self.tell()

    # ------------------------------------------------------------ what a follower does

    def check_present(self, seat: str) -> None:
        """Refuse somebody who is not there.

        Raises:
            ForbiddenError: The follower has no place.
        """
        if seat not in self.places:
            raise ForbiddenError("Only followers can do this; open the link of the class first.")

    def vote(self, seat: str, poll: str, answer: int) -> schemas.VotePublic:
        """Take a follower's answer.

        Raises:
            ConflictError: Nothing is asked, something else, or no longer.
            ForbiddenError: The follower has no place.
            RefusedError: There is no such answer.
        """
        self.check_present(seat)
        if self._poll is None:
            raise ConflictError("The lecturer asks nothing at the moment.")
        self.ask(self._poll.vote(seat, poll, answer))
        return schemas.VotePublic(poll=poll, answer=answer)

    # ------------------------------------------------------------ telling

    def listen(self, seat: str) -> AbstractContextManager[NewestListener]:
        """Add a follower for as long as the context lasts."""
        return self._followers.add(
            NewestListener(lambda: encode(schemas.FollowHello(follow=self.view(seat))), lambda: self._news)
        )

    def listen_as_lecturer(self) -> AbstractContextManager[NewestListener]:
        """Add a lecturer for as long as the context lasts."""
        return self._lecturers.add(
            NewestListener(
                lambda: encode(schemas.OwnedHello(follow=self.owner_view())), lambda: self._news_of_lecturers
            )
        )

    def tell(self) -> None:
        """Tell lecturers and followers what has changed, if anything has."""
        if self._tell(self._news, schemas.FollowNews(follow=self.view())):
            _wake(self._followers)
        if self._tell(self._news_of_lecturers, schemas.OwnedNews(follow=self.owner_view())):
            _wake(self._lecturers)

    def view(self, seat: str | None = None) -> schemas.FollowPublic:
        """Return it as all followers see it, or as one does."""
        return schemas.FollowPublic(
            **self._shared_fields(to_owner=False), mine=None if seat is None else self._own_view(seat)
        )

    def owner_view(self) -> schemas.FollowOwned:
        """Return it as a lecturer sees it."""
        best = self._addresses[0]
        link = self._links.of(self.name, "follower")
        return schemas.FollowOwned(
            **self._shared_fields(to_owner=True),
            id=self.name,
            links=[
                schemas.LinkPublic(address=f"{each.base}{PREFIX}/{link}", everybody=each.everybody)
                for each in self._addresses
            ],
            owner_link=f"{best.base}{PREFIX}/{self._links.of(self.name, 'owner')}",
            notice=None if best.everybody else NOTICE,
            followers=len(self.places),
            most_followers=self.places.most,
        )

    def _shared_fields(self, *, to_owner: bool) -> dict[str, Any]:
        shown = self._shown
        return {
            "title": shown.title,
            "sessions": [schemas.FollowedPublic(id=name, title=title) for name, title in shown.sessions.items()],
            "lesson": shown.lesson_id,
            "arrangement": dict(shown.arrangement),
            "most_forks": self.forks.most,
            "forks": len(self.forks),
            "is_open": self.places.is_open,
            "expires": self.expires.isoformat(timespec="seconds"),
            "poll": self._poll and self._poll.view(to_owner=to_owner),
        }

    def _own_view(self, seat: str) -> schemas.MinePublic:
        fork = self.forks.of(seat)
        is_made = fork is not None and (fork.session or fork.lesson)
        vote = self._poll.votes.get(seat) if self._poll else None
        return schemas.MinePublic(
            fork=self.fork_view(fork) if fork and is_made else None,
            vote=schemas.VotePublic(poll=self._poll.id, answer=vote) if self._poll and vote is not None else None,
        )

    def fork_view(self, fork: Fork) -> schemas.ForkPublic:
        """Return what a follower has, as that follower sees it."""
        if fork.session is None:
            return schemas.ForkPublic(id=None, title=self._shown.title, page=f"learn/{fork.lesson}")
        title = self._title_of(fork.session) or ""
        return schemas.ForkPublic(id=fork.session, title=title, page=f"session/{fork.session}")

    def _may_stay(self, seat: str, path: str) -> bool:
        role: Standing = "owner" if seat == LECTURER else "follower"
        return is_allowed(role, self.reach(role, seat), "WS", path)

    @staticmethod
    def _tell(told: dict[str, str], message: schemas.FollowNews | schemas.OwnedNews) -> bool:
        text = encode(message)
        changed = told.get("follow") != text
        told["follow"] = text
        return changed


def _wake(listeners: Listeners[NewestListener]) -> None:
    for listener in listeners:
        listener.news.set()
