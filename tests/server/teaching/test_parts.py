"""The parts of a class by themselves: followers, forks, poll, links, what a page sends, and results that are kept."""

import asyncio
import json
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from pydantic import BaseModel, ValidationError

from pftrack.core.refusal import ConflictError, RefusedError
from pftrack_server.core.errors import ApiError
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.results import DiskCache
from pftrack_server.sessions.duplex import encode
from pftrack_server.teaching import links as found
from pftrack_server.teaching.access import AccessGuard
from pftrack_server.teaching.follow import LECTURER, MOST_SCENES, MOST_SOCKETS, UNUSED_S, Followers, Forks
from pftrack_server.teaching.follows import Follows
from pftrack_server.teaching.lessons import LessonResults
from pftrack_server.teaching.links import LETTERS, NOTICE, Claim, Links, addresses
from pftrack_server.teaching.messages import FollowCreate, FollowUpdate, PollCreate
from pftrack_server.teaching.polls import Poll

TOKEN = "sixteen characters"


def _nobody() -> Followers:
    return Followers(lambda: None)


# Followers.


async def test_a_class_is_full() -> None:
    """One more than may come is sent away; who is there may open more sockets, up to a limit.

    The lecturer does not count: a class of one has room for one follower beside.
    """
    room = _nobody()
    with ExitStack() as held:
        for seat in "aab":
            held.enter_context(room.take(seat, "/", 2))
        assert (len(room), room.sockets) == (2, 3)
        with pytest.raises(ApiError, match="followers, 2"), room.take("c", "/", 2):
            pass
        for _ in range(MOST_SOCKETS - 2):
            held.enter_context(room.take("a", "/", 2))
        with pytest.raises(ApiError, match="24 connections"), room.take("a", "/", 2):
            pass
        held.enter_context(room.take("b", "/", 2))
        assert (len(room), room.sockets) == (2, MOST_SOCKETS + 2)
    with room.take(LECTURER, "/", 1), room.take("a", "/", 1):
        assert len(room) == 1


async def test_scenes_are_for_some() -> None:
    """One more than may look at the scene is told of the flat view, and follows nevertheless.

    With a limit of 0 nobody new comes in; who is there may open more, and is gone with the last socket.
    """
    room = _nobody()
    with ExitStack() as held:
        for number in range(MOST_SCENES):
            held.enter_context(room.take(str(number), "/viz/one/", 100))
        with pytest.raises(ApiError, match="flat view"), room.take("late", "/viz/one", 100):
            pass
        assert "late" not in room, "who was refused is not there"
        held.enter_context(room.take("late", "/api/v1/follow/stream", 100))
        held.enter_context(room.take("late", "/elsewhere", 0))
        with pytest.raises(ApiError, match="followers, 0"), room.take("b", "/", 0):
            pass
        assert len(room) == MOST_SCENES + 1
    assert (len(room), "late" in room) == (0, False)


async def test_who_must_leave_is_interrupted() -> None:
    """A socket whose seat or path may not stay ends, and others go on; it may be told so again while it ends."""
    room, ended = _nobody(), asyncio.Event()
    review = partial(room.review, lambda seat, path: (seat, path) != ("a", "/x"))

    async def serve(seat: str, path: str) -> str:
        with room.take(seat, path, 9) as hold:
            try:
                async with hold:
                    await ended.wait()
            except TimeoutError:
                review()
                ended.set()
                return "sent away"
        return "stayed"

    served = [asyncio.ensure_future(serve(*each)) for each in (("a", "/x"), ("a", "/y"), ("b", "/x"))]
    await asyncio.sleep(0)
    review()
    assert await asyncio.gather(*served) == ["sent away", "stayed", "stayed"]


@pytest.mark.parametrize("is_accepted", [False, True])
async def test_who_is_sent_away_hears_why(is_accepted: bool) -> None:
    """A socket is accepted before it is closed: a browser is told of any other only that it failed."""
    room, said = _nobody(), []

    async def send(message: dict[str, Any]) -> None:
        if message["type"] in {each["type"] for each in said}:
            raise RuntimeError("it was accepted before")
        said.append(message)

    async def app(*_: object) -> None:
        if is_accepted:
            await send({"type": "websocket.accept"})
        room.review(lambda *_: False)
        await asyncio.Event().wait()

    content = SimpleNamespace(wanted=SimpleNamespace(most_followers=9))
    one: Any = SimpleNamespace(seat="a", follow=SimpleNamespace(followers=room, content=content, ended=None))
    services = {Follows: SimpleNamespace(check_room=lambda: None)}
    scope = {"path": "/x", "app": SimpleNamespace(state=SimpleNamespace(services=services))}
    await AccessGuard(app)._serve_socket(one, scope, app, send)
    assert [each["type"] for each in said] == ["websocket.accept", "websocket.close"]
    assert (said[1]["code"], said[1]["reason"]) == (4404, "The class no longer follows this.")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The clock of classes, which stands still."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr("pftrack_server.teaching.follow.time.monotonic", lambda: clock.now)
    return clock


# Forks.


def test_one_each() -> None:
    """A fork counts from when its session is begun until that is gone; one that could not be made does not count.

    Of one that is given back while it is made, another may be begun meanwhile, and stays.
    """
    sessions: dict[str, Any] = {"x": SimpleNamespace(visitors=0), "y": SimpleNamespace(visitors=0)}
    forks = Forks(sessions.get, lambda: None)
    with forks.reserve("a") as first:
        assert len(forks) == 1
        assert forks.of("a") is first
        with pytest.raises(ConflictError), forks.reserve("a"):
            pass
        first.session = "x"
    with forks.reserve("b") as second:
        second.session = "y"
    del sessions["x"]
    assert (len(forks), forks.sessions, forks.of("a")) == (1, ["y"], None)
    with forks.reserve("c") as third:
        third.lesson = "bayes"
    assert len(forks) == 2
    given_back = forks.release("c")
    assert given_back.lesson == "bayes"
    assert forks.release("c") is None
    with pytest.raises(OSError, match="disk"), forks.reserve("c"):
        raise OSError("disk")
    assert len(forks) == 1
    with forks.reserve("c"):
        forks.release("c")
        with forks.reserve("c") as other:
            other.session = "y"
    assert forks.of("c") is other


def test_what_nobody_uses_is_given_back(clock: SimpleNamespace) -> None:
    """A lesson that nobody turns, and a session whose page has been left, end after a while and not before."""
    visited: Any = SimpleNamespace(visitors=1)
    forks = Forks({"x": visited, "y": SimpleNamespace(visitors=0)}.get, lambda: None)
    for seat, session in (("b", "x"), ("c", "y")):
        with forks.reserve(seat) as fork:
            fork.session = session
    with forks.reserve("a") as fork:
        fork.lesson = "bayes"
    clock.now = UNUSED_S - 1.0
    forks.touch("a", "/api/v1/follow")
    forks.touch("d", "/api/v1/lessons/bayes/figure")
    assert forks.of("a") is fork
    forks.touch("a", "/api/v1/lessons/bayes/figure")
    assert forks.unused_sessions() == []
    clock.now += 1.0
    visited.visitors = 0
    assert forks.unused_sessions() == ["y"]
    clock.now += UNUSED_S - 2.0
    assert len(forks) == 3
    clock.now += 2.0
    assert len(forks) == 2


# Poll.


def test_a_poll() -> None:
    """The lecturer sees how many have answered, followers not even that. What is shown stays as it is."""
    poll = Poll.ask("?", ["a", "b", "c"])
    poll = poll.vote("x", poll.id, 2).vote("y", poll.id, 2).vote("x", poll.id, 0)
    assert poll.view(to_owner=True).model_dump(include={"votes", "counts"}) == {"votes": 2, "counts": None}
    assert poll.view(to_owner=False).model_dump(include={"votes", "counts"}) == {"votes": None, "counts": None}
    for wrong in ({"poll": "another"}, {"answer": 3}, {"answer": -1}):
        with pytest.raises(RefusedError):
            poll.vote(**{"seat": "x", "poll": poll.id, "answer": 1, **wrong})
    shown = poll.reveal().view(to_owner=False)
    assert (shown.votes, shown.counts) == (2, [1, 0, 1])
    with pytest.raises(ConflictError, match="revealed"):
        poll.reveal().vote("x", poll.id, 1)


# Addresses.


def test_the_lecturers_own_address() -> None:
    """Where the lecturer's browser reaches the server by a name, so do others; on the loopback interface nobody."""
    for settings in (Settings(), Settings(token=TOKEN)):
        assert addresses("http://localhost:8000", settings) == [("http://localhost:8000", False)]
    assert "--host" in NOTICE
    settings = Settings(token=TOKEN, allowed_hosts=("lab.example",))
    for base in ("https://lab.example", "https://lab.example/any/prefix"):
        assert addresses(base, settings) == [(base, True)]


def test_a_server_that_listens_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lecturer on the machine itself is told the names that others can use, with the port."""
    monkeypatch.setattr(found, "_names", lambda _: ["192.0.2.7", "198.51.100.9"])
    told = addresses("http://127.0.0.1:8123", Settings(host="0.0.0.0"))
    names = "192.0.2.7", "198.51.100.9", "127.0.0.1"
    assert told == [(f"http://{name}:8123", name != "127.0.0.1") for name in names]
    below = addresses("http://127.0.0.1:8123/space%20word", Settings(host="0.0.0.0"))
    assert [each.base for each in below] == [f"{each.base}/space%20word" for each in told]
    only = Settings(host="0.0.0.0", allowed_hosts=("198.51.100.9",))
    everybody = [each.base for each in addresses("http://[::1]:80", only) if each.everybody]
    assert everybody == ["http://198.51.100.9:80"]


def test_the_interfaces_of_this_machine() -> None:
    """What is found is this machine's and no loopback address; a server bound to one address has that one."""
    names = found._names(Settings(host="0.0.0.0"))
    assert "127.0.0.1" not in names
    bound = Settings(host="2001:db8::5", token=TOKEN)
    assert found._names(bound) == ["2001:db8::5"]
    assert addresses("http://[::1]:1", bound)[0].base == "http://[2001:db8::5]:1"


@pytest.fixture(scope="module")
def links() -> Links:
    return Links()


def test_a_link_says_class_and_role(links: Links) -> None:
    """What was signed is read, and the roles have links of their own. The key is a server's own, and of one life."""
    follower, owner = links.of("k7q2", "follower"), links.of("k7q2", "owner")
    assert links.read(follower) == Claim("k7q2", "follower", follower)
    assert links.read(owner) == Claim("k7q2", "owner", owner)
    assert len(follower) == 14
    assert follower[:5] == owner[:5] == "k7q2-"
    assert owner[5:].startswith(follower[5:]) is False
    assert Links().read(follower) is None


def test_a_link_is_read_however_it_is_typed(links: Links) -> None:
    """Capitals, missing dashes and letters that look alike lead to the same class."""
    name = next(name for name in iter(links.new_name, None) if {"0", "1"} & set(links.of(name, "follower")))
    link = links.of(name, "follower")
    for old, new in (("-", ""), ("-", " "), ("0", "O"), ("1", "l")):
        assert links.read(link.replace(old, new)).link == links.read(link.upper()).link == link


def test_every_other_letter_is_refused(links: Links) -> None:
    """A link with any one letter changed is refused.

    Each role is signed for itself, so no part of a lecturer's link is a follower's; a signature that is cut or longer
    does not hold.
    """
    owner, link = (links.of("k7q2", role).replace("-", "") for role in ("owner", "follower"))  # type: ignore[arg-type]
    others = [link[:at] + letter + link[at + 1 :] for at in range(len(link)) for letter in LETTERS]
    assert len(set(others) - {link}) == 12 * 31
    others += [link + "0", link[:-1], *(owner[:length] for length in range(len(owner)))]
    assert [other for other in others if links.read(other) and other != link] == []


@pytest.mark.parametrize("typed", ["", "k7q2", "-", "k7q2-" * 50, "k7q2-\N{SNOWMAN}", "\ud800", "../../etc", "%00"])
def test_what_is_no_link(links: Links, typed: str) -> None:
    """Nothing else is read as one."""
    assert links.read(typed) is None


def test_a_seat_belongs_to_one_class(links: Links) -> None:
    """What a browser keeps is read for the class that gave it, and not when it was changed."""
    kept = links.new_seat("k7q2")
    seat = links.read_seat("k7q2", kept)
    assert seat
    assert links.new_seat("k7q2") != kept
    assert links.read_seat("m4xb", kept) is None
    assert links.read_seat("k7q2", kept.replace(".", ".A")) is None
    assert links.read_seat("k7q2", "other." + kept.partition(".")[2]) is None
    assert [links.read_seat("k7q2", text) for text in ("", ".", "\N{SNOWMAN}", seat, "\ud800")] == [None] * 5


class Told(BaseModel):
    """Any message that carries an arrangement."""

    arrangement: dict[str, Any]


def test_arrangements_that_are_passed_on() -> None:
    """Whatever is accepted can be told."""
    arrangements = {}, {"x": [None, 1.5, {"y": "\N{SNOWMAN}"}]}, {"x": float("nan")}, {"x": 10**400}
    for arrangement in arrangements:
        kept = FollowUpdate(arrangement=arrangement).arrangement
        assert kept is not None
        assert json.loads(encode(Told(arrangement=kept)))["arrangement"].keys() == arrangement.keys()


POLL = {"question": "?", "answers": ["a", "b"]}
ONE = {"sessions": ["a"]}


@pytest.mark.parametrize(
    ("model", "wrong"),
    [
        (FollowUpdate, {"arrangement": {"x": "\ud800"}}),
        (FollowUpdate, {"arrangement": {"\ud800": 1}}),
        (FollowUpdate, {"arrangement": {"x": "y" * 17_000}}),
        (FollowUpdate, {"arrangement": {"x": ["\N{SNOWMAN}" * 6_000]}}),
        (FollowUpdate, {"arrangement": {"x": json.loads("[" * 900 + "]" * 900)}}),
        (FollowCreate, {}),
        (FollowCreate, {"sessions": ["a", "b", "c", "d", "e"]}),
        (FollowCreate, {"sessions": ["a", "a"]}),
        (FollowCreate, {**ONE, "most_followers": -1}),
        (FollowCreate, {**ONE, "most_followers": 1001}),
        (FollowCreate, {**ONE, "hours": float("nan")}),
        (FollowCreate, {**ONE, "hours": 0}),
        (FollowCreate, {**ONE, "title": ""}),
        (FollowCreate, {**ONE, "title": "\ud800"}),
        (FollowCreate, {**ONE, "surprise": 1}),
        (PollCreate, {**POLL, "answers": ["a"]}),
        (PollCreate, {**POLL, "answers": ["a"] * 9}),
        (PollCreate, {**POLL, "answers": ["", "b"]}),
        (PollCreate, {**POLL, "question": ""}),
        (PollCreate, {**POLL, "question": "x" * 301}),
    ],
)
def test_messages_that_are_refused(model: type[BaseModel], wrong: dict[str, Any]) -> None:
    """Nothing to follow, too many, limits out of bounds; half a character, too much, or too deep an arrangement.

    A question has words and two to eight answers.
    """
    with pytest.raises(ValidationError):
        model(**wrong)


class Answers:
    """Children that answer at once, or never."""

    async def run_beside(self, function: Callable[[], Any], **_: object) -> dict[str, list[int]]:
        if function is heavy:
            await asyncio.Event().wait()
        if function is refused:
            raise RefusedError("There is nothing to compute")
        return {"numbers": [1]}


def heavy() -> None:
    """What takes minutes."""


def light() -> None:
    """What takes a moment."""


def refused() -> None:
    """What cannot be computed."""


async def test_a_light_answer_does_not_wait_for_heavy_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many lessons take minutes; one that is refused says why, and one that was left alone begins anew."""
    monkeypatch.setattr("pftrack_server.teaching.lessons.MOMENT_S", 0.05)
    results = LessonResults(DiskCache(tmp_path / "kept"), cast("ChildTasks", Answers()))
    slow = [await results.get(f"slow {number}", heavy) for number in range(2)]
    job = await results.get("quick", light)
    await results.jobs.wait(job.id, 60)
    assert job.result == {"numbers": [1]}
    assert [each.result for each in slow] == [None, None]
    failed = await results.get("refused", refused)
    await results.jobs.wait(failed.id, 60)
    assert (failed.result, failed.error) == (None, "There is nothing to compute")
    assert await results.get("refused", refused) is failed, "nobody tries again at once"
    monkeypatch.setattr("pftrack_server.jobs.jobs.LOOK_S", 0.001)
    left = await results.get("left alone", heavy)
    await results.jobs.wait(left.id, 60)
    again = (await results.get("left alone", heavy)).state
    assert (left.state, again) == ("failed", "working"), "the next visitor has not left it"
    results.jobs._kept_s = -1.0
    assert await results.get("refused", refused) is not failed
    await results.jobs.close()
